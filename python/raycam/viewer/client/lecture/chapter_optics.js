// Chapters 16 to 18: materials, lenses, videos.

import { litPicture } from "./chapter_light.js";
import { fixed } from "./numbers.js";
import { drawLine } from "./shapes.js";
import { SIZE, worldText } from "./world.js";

/** @typedef {import("./figure.js").Figure} Figure */

const MATERIALS = /** @type {[string, (roughness: number) => string][]} */ ([
  ["matt", () => `color = "#c8503c"`],
  ["gold", (roughness) => `type = "metal"\nmetal = "gold"\nroughness = ${roughness}`],
  ["plastic", (roughness) => `type = "principled"\ncolor = "#c8503c"\nroughness = ${roughness}`],
  ["glass", (roughness) => `type = "glass"\nior = 1.5\nroughness = ${roughness}`],
]);

/** A canvas that shows a picture of the core alone. @param {Figure} fig @param {string} label @param {() => { canvas: HTMLCanvasElement | null }} picture */
function showPicture(fig, label, picture) {
  fig.canvas({
    ratio: SIZE[1] / SIZE[0], label,
    draw: (pen) => {
      const { canvas } = picture();
      if (canvas) pen.ctx.drawImage(canvas, 0, 0, pen.width, pen.height);
      else drawLine(pen, [[0, 0], [pen.width, 0], [pen.width, pen.height], [0, pen.height]], { color: "soft", fill: "soft", close: true });
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
  showPicture(fig, "The picture through a lens that bends straight lines", picture);
  fig.slider({ name: "k₁", symbol: "K", min: -0.4, max: 0.3, step: 0.01, get: () => k1, set: (value) => { k1 = value; } });
  fig.readout(() => [[`At distance 0.5 from the axis: 0.5 · (1 + k₁ · 0.25) = ${fixed(distortedRadius(0.5, k1), 4)}`]]);
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
  showPicture(fig, "The picture through a lens with an aperture", picture);
  fig.slider({ name: "aperture", symbol: "C", min: 0, max: 0.3, step: 0.01, get: () => aperture, set: (value) => { aperture = value; } });
  fig.slider({ name: "focus", symbol: "t", min: 2, max: 8, step: 0.1, digits: 1, get: () => focus, set: (value) => { focus = value; } });
  fig.readout(() => [[`A point at depth 6 becomes a disc of radius f · a · |1/6 − 1/${fixed(focus, 1)}| = ${fixed(discRadius(fig.shared.numbers.fx, aperture, 6, focus), 2)} pixels`]]);
}

/** The radius in pixels of the image of a point out of focus. @param {number} f @param {number} aperture @param {number} depth @param {number} focus */
export const discRadius = (f, aperture, depth, focus) => f * aperture * Math.abs(1 / depth - 1 / focus);

/** A camera on a circle. @param {Figure} fig */
export function buildVideo(fig) {
  const LAST = 71;
  let frame = 0;
  const camera = () => {
    const yaw = (360 * frame) / (LAST + 1);
    const angle = (yaw * Math.PI) / 180;
    return { ...fig.shared.numbers, roll: 0, pitch: 20, yaw, C: [0.3 - 5 * Math.cos(angle), -0.2 - 5 * Math.sin(angle), 2.3] };
  };
  const picture = litPicture(fig, () => ({ text: worldText(camera()), size: SIZE, integrator: "direct", samples: 1 }));
  showPicture(fig, "One frame of a video", picture);
  fig.slider({ name: "frame", min: 0, max: LAST, step: 1, digits: 0, get: () => frame, set: (value) => { frame = value; } });
  fig.stepper({ last: () => LAST, get: () => frame, set: (i) => { frame = i; }, ms: 42 });
  fig.readout(() => [[["R", `yaw = ${fixed(camera().yaw, 0)}°`], "    ", ["C", `C = (${camera().C.map((value) => fixed(value)).join(", ")})`], `    ${fixed(frame / 24, 2)} s at 24 frames per second`]]);
}
