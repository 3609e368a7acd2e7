// The worker of the lecture's page: the core, and the newest picture that was asked for.

import { nextTurn } from "../core/session.js";

/** @typedef {{ id: number, text: string, width: number, height: number, integrator: string, samples: number }} Wanted */

const BAND = 16; // rows between two looks for messages
const PATH = "lecture.toml";

/** @param {any} scope the worker's global scope, which has the core as `wasm_bindgen` */
export function serveLecture(scope) {
  /** @type {any} */
  let core = null;
  /** @type {Wanted | null} */
  let wanted = null;
  let works = false;
  /** @type {any} the world of the newest text */
  let loaded = { text: "" };
  const say = (/** @type {any} */ message, /** @type {Transferable[]} */ transfer = []) => scope.postMessage(message, transfer);

  function load(/** @type {Wanted} */ { id, text }) {
    loaded.world?.free();
    loaded = { text: "" };
    const files = new core.Files();
    files.add(PATH, new TextEncoder().encode(text));
    const world = core.World.load(PATH, files);
    const camera = world.camera(undefined, ...[1, 1]);
    loaded = { text, world, camera };
    const [P, K, R, C] = [[...camera.P], [...camera.K], [...camera.R], [...camera.C]];
    const about = JSON.parse(world.about());
    const { offset } = camera;
    const [corners, ids, colors] = [world.triangles(), world.triangleIds(), world.triangleColors()];
    say({ type: "world", id, P, K, R, C, offset, names: about.objects, corners, ids, colors });
  }

  async function draw(/** @type {Wanted} */ asked) {
    if (loaded.text !== asked.text) load(asked);
    const { width, height, integrator } = asked;
    for (let samples = 1; ; samples = Math.min(4 * samples, asked.samples)) {
      const color = new Float32Array(3 * width * height);
      const band = samples === 1 ? height : Math.max(1, Math.floor(BAND / Math.sqrt(samples)));
      for (let top = 0; top < height; top += band) {
        const region = [0, top, width, Math.min(band, height - top)];
        const request = { channels: ["color"], integrator, samples, region, ambient_occlusion: false };
        const frame = loaded.world.render(loaded.camera, JSON.stringify(request));
        color.set(frame.plane("color"), 3 * width * top);
        frame.free();
        if (samples > 1) await nextTurn();
        if (wanted) return;
      }
      say({ type: "picture", id: asked.id, samples, color }, [color.buffer]);
      await nextTurn();
      if (wanted || samples >= asked.samples) return;
    }
  }

  async function work() {
    if (works || !core) return;
    works = true;
    while (wanted) {
      const asked = wanted;
      wanted = null;
      try {
        await draw(asked);
      } catch (error) {
        fail(asked.id, error);
      }
    }
    works = false;
  }

  function fail(/** @type {number} */ id, /** @type {any} */ error) {
    const text = String(error?.message ?? error);
    try {
      say({ type: "failed", id, text: JSON.parse(text).text });
    } catch {
      say({ type: "failed", id, text });
    }
  }

  scope.onmessage = async (/** @type {MessageEvent} */ { data }) => {
    if (data.type === "start") {
      try {
        await scope.wasm_bindgen({ module_or_path: data.module });
        core = scope.wasm_bindgen;
      } catch (error) {
        fail(0, error);
      }
    } else wanted = data;
    work();
  };
}
