// Chapters 16 to 18: materials, lenses, videos.

import { dot, plusTimes, rowOf } from "../core/vectors.js";
import { litPicture } from "./chapter_light.js";
import { fixed } from "../figure/numbers.js";
import { drawDot, drawLine } from "../figure/shapes.js";
import { addPicture, drawPixel } from "./picture_view.js";
import { SIZE, worldText } from "./world.js";

/** @typedef {import("./figure.js").Figure} Figure */

const MATERIALS = /** @type {[string, (roughness: number) => string][]} */ ([
  ["matte", () => `color = "#c8503c"`],
  ["gold", (roughness) => `type = "metal"\nmetal = "gold"\nroughness = ${roughness}`],
  ["plastic", (roughness) => `type = "principled"\ncolor = "#c8503c"\nroughness = ${roughness}`],
  ["glass", (roughness) => `type = "glass"\nior = 1.5\nroughness = ${roughness}`],
]);

/** A canvas that shows an image of the core, with lines over it. @param {Figure} fig @param {string} label @param {() => { canvas: HTMLCanvasElement | null }} picture @param {(pen: import("../figure/board.js").Pen) => void} [overlay] */
function showPicture(fig, label, picture, overlay) {
  fig.canvas({
    ratio: SIZE[1] / SIZE[0], label,
    draw: (pen) => {
      const { canvas } = picture();
      if (canvas) pen.ctx.drawImage(canvas, 0, 0, pen.width, pen.height);
      else drawLine(pen, [[0, 0], [pen.width, 0], [pen.width, pen.height], [0, pen.height]], { color: "soft", fill: "soft", close: true });
      overlay?.(pen);
    },
  });
}

/** The box of different materials. @param {Figure} fig */
export function buildMaterial(fig) {
  let [choice, roughness] = [1, 0.2];
  const picture = litPicture(fig, () => {
    const text = worldText(fig.shared.numbers, { lights: ["sun", "sky"], size: [200, 150], box: MATERIALS[choice][1](roughness) });
    return { text, size: [200, 150], integrator: "path", samples: 64 };
  });
  showPicture(fig, "The box, made of the chosen material", picture);
  fig.choice({ name: "Material", options: MATERIALS.map(([name]) => name), get: () => choice, set: (i) => { choice = i; } });
  fig.slider({ name: "roughness", min: 0, max: 1, step: 0.05, get: () => roughness, set: (value) => { roughness = value; } });
}

/** Lens distortion. @param {Figure} fig */
export function buildDistortion(fig) {
  let k1 = -0.3;
  const picture = litPicture(fig, () => ({ text: worldText(fig.shared.numbers, { camera: `distortion = [${k1}, 0, 0, 0]` }), size: SIZE, integrator: "flat", samples: 4 }));
  showPicture(fig, "The picture through a lens that bends straight lines, and a grid of such lines", picture, (pen) => drawBentGrid(pen, fig.shared.numbers, k1));
  fig.slider({ name: "k₁", symbol: "K", min: -0.4, max: 0.3, step: 0.01, get: () => k1, set: (value) => { k1 = value; } });
  fig.readout(() => [[`At distance 0.5 from the principal point: 0.5 · (1 + k₁ · 0.25) = ${fixed(distortedRadius(0.5, k1), 4)}`]]);
}

/** The pixel of the direction (x, y, 1) in the camera's axes. @param {import("./world.js").Numbers} numbers @param {number} k1 @param {number} x @param {number} y */
function distortedPixel({ fx, fy, skew, cx, cy }, k1, x, y) {
  const part = distortedRadius(Math.hypot(x, y), k1) / (Math.hypot(x, y) || 1);
  return [fx * part * x + skew * part * y + cx, fy * part * y + cy];
}

/** Lines that are straight without distortion, a fifth of the focal length apart. @param {import("../figure/board.js").Pen} pen @param {import("./world.js").Numbers} numbers @param {number} k1 */
function drawBentGrid(pen, numbers, k1) {
  const place = (/** @type {number} */ x, /** @type {number} */ y) => distortedPixel(numbers, k1, x, y).map((value) => ((value + 0.5) * pen.width) / SIZE[0]);
  for (let i = -4; i <= 4; i++) {
    const along = Array.from({ length: 33 }, (_, k) => (k - 16) / 20);
    for (const line of [along.map((at) => place(i / 5, at)), along.map((at) => place(at, i / 5))]) drawLine(pen, line, { color: "K", width: i ? 1 : 2 });
  }
}

/** The distance from the axis after the first term of radial distortion. @param {number} radius @param {number} k1 */
export const distortedRadius = (radius, k1) => radius * (1 + k1 * radius ** 2);

/** Depth of field. @param {Figure} fig */
export function buildFocus(fig) {
  let [aperture, focus] = [0.12, 3.9];
  const picture = litPicture(fig, () => {
    const text = worldText(fig.shared.numbers, { size: [240, 180], camera: `aperture = { radius = ${aperture}, focus = ${focus} }` });
    return { text, size: [240, 180], integrator: "flat", samples: 64 };
  });
  const { shared } = fig;
  const depth = () => (shared.steps.winner ? shared.steps.winner.t * dot(shared.ray.r, shared.ray.forward) : 6);
  fig.canvas({
    ratio: 0.6, label: "The lens from the side: rays of one point pass the aperture and meet behind it, in front of the sensor, on it or behind it",
    draw: (pen) => drawLens(pen, aperture, focus, depth()),
  });
  addPicture(fig, { label: "The picture through a lens with an aperture", image: () => picture().canvas });
  fig.host.classList.add("double");
  fig.slider({ name: "aperture A", symbol: "L", min: 0, max: 0.3, step: 0.01, get: () => aperture, set: (value) => { aperture = value; } });
  fig.slider({ name: "focus z₀", symbol: "t", min: 2, max: 8, step: 0.1, digits: 1, get: () => focus, set: (value) => { focus = value; } });
  fig.readout(() => [[`The point at depth ${fixed(depth(), 3)} becomes a disc of radius f A |1/${fixed(depth(), 3)} − 1/${fixed(focus, 1)}| = ${fixed(discRadius(shared.numbers.fx, aperture, depth(), focus), 2)} pixels`]]);
}

/** A thin lens from the side; the part behind the lens is not to scale. @param {import("../figure/board.js").Pen} pen @param {number} aperture @param {number} focus @param {number} depth */
function drawLens(pen, aperture, focus, depth) {
  const [lens, middle, sensor] = [0.72 * pen.width, pen.height / 2, 0.9 * pen.width];
  const rim = (aperture / 0.3) * 0.36 * pen.height;
  const front = (/** @type {number} */ z) => lens - (Math.min(z, 8.4) / 8.4) * 0.68 * pen.width;
  const image = lens + (sensor - lens) / (1 + 1 / focus - 1 / Math.max(depth, 0.7)); // lens equation, with the sensor at distance 1
  drawLine(pen, [[8, middle], [pen.width - 8, middle]], { color: "axis", width: 1, dash: [4, 5] });
  drawLine(pen, [[front(focus), 0.14 * pen.height], [front(focus), 0.86 * pen.height]], { color: "t", width: pen.lit("t") ? 4 : 2, dash: [6, 5] });
  pen.label({ at: [front(focus), 0.14 * pen.height], text: "in focus: z₀", symbol: "t" });
  for (const y of [-rim, 0, rim]) {
    const beyond = middle - (y * (pen.width - 8 - image)) / (image - lens);
    drawLine(pen, [[front(depth), middle], [lens, middle + y], [pen.width - 8, beyond]], { color: "L", width: 1.6 });
  }
  const spread = Math.abs((rim * (sensor - image)) / (image - lens));
  drawLine(pen, [[lens, middle - 0.4 * pen.height], [lens, middle - rim]], { color: "ink", width: 5 });
  drawLine(pen, [[lens, middle + rim], [lens, middle + 0.4 * pen.height]], { color: "ink", width: 5 });
  drawLine(pen, [[sensor, middle - 0.4 * pen.height], [sensor, middle + 0.4 * pen.height]], { color: "K", width: pen.lit("K") ? 4 : 2 });
  drawLine(pen, [[sensor, middle - spread], [sensor, middle + spread]], { color: "r", width: 6 });
  pen.label({ at: [sensor, middle - 0.4 * pen.height], text: "sensor", symbol: "K" });
  pen.label({ at: [lens, middle - 0.4 * pen.height], text: "lens", color: pen.color("ink") });
  pen.label({ at: [sensor, middle + spread], text: "disc", symbol: "r" });
  drawDot(pen, [front(depth), middle], "x", 6);
  pen.label({ at: [front(depth), middle], text: "point", symbol: "x" });
}

/** The radius in pixels of the image of a point out of focus. @param {number} f @param {number} aperture @param {number} depth @param {number} focus */
export const discRadius = (f, aperture, depth, focus) => f * aperture * Math.abs(1 / depth - 1 / focus);

/** How far a sideways camera has moved when a row is read. @param {number} speed @param {number} readout in seconds @param {number} row */
export const movedAtRow = (speed, readout, row) => (speed * readout * row) / (SIZE[1] - 1);

/** A rolling shutter: each row is read from another place. @param {Figure} fig */
export function buildShutter(fig) {
  const { shared } = fig;
  let [speed, readout] = [8, 50];
  const picture = litPicture(fig, () => {
    const { numbers, camera } = shared;
    const end = plusTimes(numbers.C, (speed * readout) / 1000, rowOf(camera.R, 0));
    const { roll, pitch, yaw } = numbers;
    const shutter = `shutter = { readout = ${readout / 1000}, end = { location = [${end.join(", ")}], roll = ${roll}, pitch = ${pitch}, yaw = ${yaw} } }`;
    return { text: worldText(numbers, { camera: readout && speed ? shutter : "" }), size: SIZE, integrator: "flat", samples: 1 };
  });
  const moved = () => movedAtRow(speed, readout / 1000, shared.numbers.pixel[1]);
  const shift = () => (shared.steps.winner ? -shiftOfMove(shared.numbers.fx, moved(), shared.steps.winner.t * dot(shared.ray.r, shared.ray.forward)) : 0);
  addPicture(fig, { label: "All rows read at once" });
  fig.canvas({
    ratio: SIZE[1] / SIZE[0], label: "The rows read one after another while the camera moves to the right",
    draw: (pen) => {
      const { canvas } = picture();
      const scale = pen.width / SIZE[0];
      const [u, v] = shared.numbers.pixel;
      pen.ctx.imageSmoothingEnabled = false;
      if (canvas) pen.ctx.drawImage(canvas, 0, 0, pen.width, pen.height);
      drawLine(pen, [[0, (v + 0.5) * scale], [pen.width, (v + 0.5) * scale]], { color: "t", width: 1.5, dash: [6, 5] });
      pen.label({ at: [pen.width - 60, (v + 0.5) * scale], text: `row ${v}`, symbol: "t" });
      if (shared.steps.winner) drawPixel(pen, [(u + shift() + 0.5) * scale, (v + 0.5) * scale]);
    },
  });
  fig.host.classList.add("double", "even");
  fig.slider({ name: "speed", symbol: "C", min: -10, max: 10, step: 0.5, digits: 1, unit: " m/s", get: () => speed, set: (value) => { speed = value; } });
  fig.slider({ name: "readout", symbol: "t", min: 0, max: 60, step: 1, digits: 0, unit: " ms", get: () => readout, set: (value) => { readout = value; } });
  fig.readout(() => {
    const [, row] = shared.numbers.pixel;
    const { winner } = shared.steps;
    const when = [["t", `row ${row} is read after ${row} / ${SIZE[1] - 1} · ${readout} ms = ${fixed((readout * row) / (SIZE[1] - 1), 1)} ms`]];
    if (!winner) return /** @type {[string, string][][]} */ ([when]);
    const depth = winner.t * dot(shared.ray.r, shared.ray.forward);
    return /** @type {(string | [string, string])[][]} */ ([when, [["C", `moved: ${fixed(moved(), 3)} m`], `,  so the point at depth ${fixed(depth, 3)} appears at column ${shared.numbers.pixel[0]} − ${fixed(shared.numbers.fx, 0)} · ${fixed(moved(), 3)} / ${fixed(depth, 3)} = ${fixed(shared.numbers.pixel[0] + shift(), 1)}`]]);
  });
}

/** The shift in pixels of a point at a depth if the camera moves sideways. @param {number} f @param {number} move @param {number} depth */
export const shiftOfMove = (f, move, depth) => (f * move) / depth;

/** A camera on a circle. @param {Figure} fig */
export function buildVideo(fig) {
  const LAST = 71;
  let frame = 0;
  const camera = () => {
    const yaw = (360 * frame) / (LAST + 1);
    const angle = (yaw * Math.PI) / 180;
    return { ...fig.shared.numbers, roll: 0, pitch: 20, yaw, C: [0.3 - 5 * Math.cos(angle), -0.2 - 5 * Math.sin(angle), 2.3] };
  };
  const picture = litPicture(fig, () => ({ text: worldText(camera(), { lights: ["sun", "sky"] }), size: SIZE, integrator: "direct", samples: 1 }));
  showPicture(fig, "One frame of a video", picture);
  fig.slider({ name: "frame", min: 0, max: LAST, step: 1, digits: 0, get: () => frame, set: (value) => { frame = value; } });
  fig.stepper({ last: () => LAST, get: () => frame, set: (i) => { frame = i; }, ms: 42 });
  fig.readout(() => [[["R", `yaw = ${fixed(camera().yaw, 0)}°`], "    ", ["C", `C = (${camera().C.map((value) => fixed(value)).join(", ")})`], `    ${fixed(frame / 24, 2)} s at 24 frames per second`]]);
}
