// The transport of a page that renders without a server: a worker with the core. A worker that fails is replaced.

import { bytesOfBase64, inflate } from "../image/planes.js";

/** @typedef {Record<string, any> & { type: string }} Message */

const PATIENCE = 4000; // milliseconds without a message after which a worker is replaced when another world is opened

export class WorkerTransport {
  /** @param {() => { width: number, height: number, ratio: number }} size of the space for the image */
  constructor(size) {
    this.live = true;
    this.size = size;
    /** @type {Worker | null} */
    this.worker = null;
    /** @type {any} what is shown: bytes of a world, or files, with options */
    this.opened = null;
    this.waiting = 0;
    /** Called instead of `say` with errors of worlds, which contain a line number if it is known. @type {((message: any) => void) | null} */
    this.onFailure = null;
  }

  /** @returns {boolean} true if this page contains the core */
  static get isThere() {
    return typeof document !== "undefined" && document.getElementById("core-wasm") !== null;
  }

  /** @param {(message: Message) => void} say */
  async open(say) {
    this.say = say;
    say({ type: "status", text: "starting" });
    this.wasm = await compiledCore();
    const world = textOf("core-world");
    if (world) this.opened = { world: (await inflate(bytesOfBase64(world))).buffer, options: JSON.parse(textOf("core-options")) };
    this.start();
  }

  start() {
    const script = [textOf("core-glue"), "\nglobalThis.wasm_bindgen = wasm_bindgen;\n", textOf("client")];
    const url = URL.createObjectURL(new Blob(script, { type: "text/javascript" }));
    this.worker = new Worker(url);
    this.worker.onmessage = ({ data }) => this.receive(data);
    this.worker.onerror = (event) => this.receive({ type: "broken", text: event.message || "the worker did not start" });
    this.worker.postMessage({ type: "start", wasm: this.wasm, ...this.opened, first: [{ type: "size", ...this.size() }] });
  }

  /**
   * Shows another world.
   * @param {{ path: string, files: [string, ArrayBuffer][], options: any }} opened
   */
  show(opened) {
    this.opened = opened;
    const first = [{ type: "size", ...this.size() }];
    if (!this.worker) {
      if (this.wasm) this.start();
      return;
    }
    this.worker.postMessage({ type: "open", ...opened, first });
    clearTimeout(this.waiting);
    this.waiting = setTimeout(() => this.receive({ type: "stuck" }), PATIENCE);
  }

  /** @param {Message} message */
  receive(message) {
    clearTimeout(this.waiting);
    if (message.type === "broken" || message.type === "stuck") {
      this.worker?.terminate();
      this.worker = null;
      if (message.type === "broken") this.opened = null;
      if (this.wasm) this.start();
    }
    if (message.type === "broken" || message.type === "failed") {
      if (this.onFailure) this.onFailure(message);
      else this.say?.({ ...message, type: "error" });
    } else this.say?.(message);
  }

  /** @param {import("../messages").ClientMessage} message */
  send(message) {
    this.worker?.postMessage(message);
  }
}

/** The core of this page, compiled while it is unpacked. @returns {Promise<WebAssembly.Module>} */
export function compiledCore() {
  const unpacked = new Blob([bytesOfBase64(textOf("core-wasm"))]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  return WebAssembly.compileStreaming(new Response(unpacked, { headers: { "Content-Type": "application/wasm" } }));
}

/** @param {string} id */
export function textOf(id) {
  return document.getElementById(id)?.textContent || "";
}
