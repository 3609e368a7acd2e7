// The worker of the lecture's page: the core, and the newest image that each figure requested.

import { nextTurn } from "../core/session.js";

/** @typedef {{ key: string, id: number, text: string, width: number, height: number, integrator: string, samples: number, done: number, seed: number }} Request */

const PATH = "lecture.toml", STEPS = [1, 4, 16, 64, 256], BAND_SAMPLES = 160000, QUIET_MS = 250;

/** @param {any} scope the worker's global scope, which has the core as `wasm_bindgen` */
export function serveLecture(scope) {
  /** @type {any} */
  let core = null;
  /** @type {Map<string, Request>} */
  const waiting = new Map();
  /** @type {Map<string, any>} the prepared world of each figure */
  const worlds = new Map();
  let works = false;
  /** The time from which refinement may continue after the reader dragged something. */
  let quietAt = 0;
  /** The figure whose image is rendered now; "" if it is cancelled. */
  let current = "";

  function load(/** @type {Request} */ { key, text }) {
    const old = worlds.get(key);
    if (old?.text === text) return old;
    old?.camera.free();
    old?.world.free();
    worlds.delete(key);
    const files = new core.Files();
    files.add(PATH, new TextEncoder().encode(text));
    const world = core.World.load(PATH, files);
    const loaded = { text, world, camera: world.camera(undefined, 1, 1) };
    worlds.set(key, loaded);
    scope.postMessage({ type: "world", key, P: [...loaded.camera.P], corners: world.triangles(), notices: JSON.parse(world.about()).notices });
    return loaded;
  }

  /** True while refinement must wait: the reader drags something, or a figure has no image yet. */
  const mustYield = () => performance.now() < quietAt || [...waiting.values()].some(({ done }) => done === 0);

  /** Renders one step of an image in bands of rows, and ends early if the figure requests another image. */
  async function draw(/** @type {Request} */ asked) {
    const { key, id, width, height, integrator, seed } = asked;
    const { world, camera } = load(asked);
    if (asked.samples === 0) return;
    const samples = Math.min(STEPS.find((step) => step > asked.done) || asked.samples, asked.samples);
    const rows = Math.max(1, Math.ceil(BAND_SAMPLES / (width * samples)));
    const color = new Float32Array(3 * width * height);
    for (let row = 0; row < height; row += rows) {
      if (row > 0) await nextTurn();
      if (asked.done > 0 && mustYield()) {
        if (current === key && !waiting.has(key)) waiting.set(key, asked);
        return;
      }
      if (waiting.has(key) || current !== key) return;
      const region = [0, row, width, Math.min(rows, height - row)];
      const frame = world.render(camera, JSON.stringify({ channels: ["color"], integrator, samples, seed, region, ambient_occlusion: false }));
      color.set(frame.plane("color"), 3 * width * row);
      frame.free();
    }
    scope.postMessage({ type: "picture", key, id, samples, width, height, color }, [color.buffer]);
    if (samples < asked.samples && current === key) waiting.set(key, { ...asked, done: samples });
  }

  async function work() {
    if (works || !core) return;
    works = true;
    while (waiting.size) {
      const [asked] = [...waiting.values()].sort((a, b) => a.done - b.done || b.id - a.id);
      if (asked.done > 0 && performance.now() < quietAt) {
        await new Promise((resolve) => setTimeout(resolve, quietAt - performance.now()));
        continue;
      }
      waiting.delete(asked.key);
      current = asked.key;
      try {
        await draw(asked);
      } catch (error) {
        fail(asked.key, asked.id, error);
      }
      await nextTurn();
    }
    works = false;
  }

  function fail(/** @type {string} */ key, /** @type {number} */ id, /** @type {any} */ error) {
    let text = String(error?.message ?? error);
    try {
      text = JSON.parse(text).text;
    } catch {
      // The text is not JSON, and is reported unchanged.
    }
    scope.postMessage({ type: "failed", key, id, text });
  }

  scope.onmessage = async (/** @type {MessageEvent} */ { data }) => {
    if (data.type === "start") {
      try {
        await scope.wasm_bindgen({ module_or_path: data.module });
        core = scope.wasm_bindgen;
      } catch (error) {
        fail("", 0, error);
      }
    } else if (data.type === "busy") quietAt = performance.now() + QUIET_MS;
    else if (data.type === "cancel") {
      waiting.delete(data.key);
      if (current === data.key) current = "";
    } else waiting.set(data.key, { ...data, done: 0 });
    work();
  };
}
