// The worker of a page: the core, and a session that it serves.

import { Session, nextTurn } from "./session.js";

const IDLE = 30; // milliseconds between two checks for work

/** Parses an error of the core, which is JSON; returns an empty object for other errors. */
function parsed(/** @type {string} */ text) {
  try {
    return JSON.parse(text);
  } catch {
    return {};
  }
}

/**
 * Serves the page that started this worker.
 * @param {any} scope the worker's global scope, which has the core as `wasm_bindgen`
 */
export function serve(scope) {
  /** @type {Session | null} */
  let session = null;
  let core = /** @type {any} */ (null);
  let works = false;
  const say = (/** @type {any} */ message) => scope.postMessage(message);

  async function start(/** @type {any} */ { wasm, ...rest }) {
    core = scope.wasm_bindgen;
    await core({ module_or_path: wasm });
    say({ type: "ready", version: core.version() });
    if (rest.world || rest.files) open(rest);
  }

  function open(/** @type {any} */ { world, files, path, options, first }) {
    session?.changed(); // ends the old session's work
    session = null;
    let loaded;
    if (world) loaded = core.World.unpack(new Uint8Array(world));
    else {
      const given = new core.Files();
      for (const [name, bytes] of files) given.add(name, new Uint8Array(bytes));
      loaded = core.World.load(path, given);
    }
    session = new Session(core, loaded, options, say);
    session.welcome();
    for (const message of first || []) session.receive(message);
  }

  async function workOn() {
    if (works) return;
    works = true;
    for (let served = session; served; served = session) {
      try {
        if (!(await served.work()) && served === session) break;
      } catch (error) {
        if (served === session) fail(error);
      }
      const waits = served.moved === served.version && performance.now() - served.touched < 150;
      await (waits ? sleep(IDLE) : nextTurn());
    }
    works = false;
  }

  function fail(/** @type {any} */ error) {
    if (session) session.samples = session.target; // stops the refinement, because the same work would fail again
    const text = String(error?.message ?? error);
    const { code, ...told } = parsed(text);
    const broken = error instanceof WebAssembly.RuntimeError || error instanceof RangeError || code === "internal";
    if (told.text) say({ type: broken ? "broken" : "failed", ...told });
    else say({ type: broken ? "broken" : "failed", text: broken ? `Rendering failed, because the page has too little memory or raycam has a bug: ${text}` : text });
  }

  scope.onmessage = async (/** @type {MessageEvent} */ { data }) => {
    try {
      if (data.type === "start") await start(data);
      else if (data.type === "open") open(data);
      else session?.receive(data);
    } catch (error) {
      fail(error);
    }
    workOn();
  };
}

/** @param {number} ms */
function sleep(ms) {
  return new Promise((resolve) => setTimeout(resolve, ms));
}
