// Images that the core renders for the figures. Each figure requests images with its key; a new request replaces the previous request with the same key.

import { toneMap } from "../image/tone.js";
import { compiledCore, textOf } from "../transport/worker.js";

/** @typedef {{ canvas: HTMLCanvasElement, samples: number, color: Float32Array }} Picture */
/** @typedef {{ text: string, width: number, height: number, integrator: string, samples: number, seed?: number }} Wanted `samples` 0 loads the world alone */
/** @typedef {{ onPicture?: (picture: Picture) => void, onWorld?: (world: any) => void }} Receivers */

/** Minimum milliseconds between two messages that report dragging. */
const HOLD_MS = 100;

export class Pictures {
  /** @param {(text: string) => void} say called with errors */
  constructor(say) {
    this.say = say;
    this.id = 0;
    this.held = 0;
    /** @type {Worker | null} */
    this.worker = null;
    /** @type {Map<string, Receivers & { id: number, message: any, done?: boolean }>} */
    this.asked = new Map();
  }

  async open() {
    try {
      const module = await compiledCore();
      const script = [textOf("core-glue"), "\nglobalThis.wasm_bindgen = wasm_bindgen;\n", textOf("client")];
      this.worker = new Worker(URL.createObjectURL(new Blob(script, { type: "text/javascript" })));
      this.worker.onmessage = ({ data }) => this.receive(data);
      this.worker.onerror = (event) => this.say(event.message || "The renderer did not start; reload the page or try another browser.");
      this.worker.postMessage({ type: "start", module });
      for (const { message } of this.asked.values()) this.worker.postMessage(message);
    } catch (error) {
      this.say(`This browser cannot run raycam: ${error}`);
    }
  }

  /** @param {string} key @param {Wanted} wanted @param {Receivers} receivers */
  request(key, wanted, receivers) {
    const old = this.asked.get(key);
    const text = JSON.stringify(wanted);
    if (old && old.message.asText === text) return;
    this.id += 1;
    const message = { seed: 0, ...wanted, asText: text, type: "draw", key, id: this.id };
    this.asked.set(key, { ...receivers, id: this.id, message });
    this.worker?.postMessage(message);
  }

  /** Delays the refinement while the reader drags something. */
  hold() {
    const now = performance.now();
    if (now - this.held < HOLD_MS) return;
    this.held = now;
    this.worker?.postMessage({ type: "busy" });
  }

  /** Stops the unfinished images of a figure; they begin again when they are requested. @param {string} id the figure's id, with which its keys begin */
  cancel(id) {
    for (const [key, { done }] of this.asked) {
      if (done || key.replace(/\d$/, "") !== id) continue;
      this.asked.delete(key);
      this.worker?.postMessage({ type: "cancel", key });
    }
  }

  /** @param {any} message */
  receive(message) {
    const asked = this.asked.get(message.key);
    if (message.type === "failed") this.say(message.text);
    else if (message.type === "world") asked?.onWorld?.(message);
    else if (asked) {
      const { width, height, color, samples } = message;
      asked.done = asked.id === message.id && samples >= asked.message.samples;
      const canvas = document.createElement("canvas");
      [canvas.width, canvas.height] = [width, height];
      const image = new ImageData(width, height);
      toneMap(color, 0, "standard", image.data);
      canvas.getContext("2d")?.putImageData(image, 0, 0);
      asked.onPicture?.({ canvas, samples, color });
    }
  }
}
