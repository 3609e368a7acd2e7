// Chapters 10 to 12: sun and bulb, diffuse and specular reflection, shadows.

import { dot, lengthOf, minus, plusTimes } from "../core/vectors.js";
import { triangleSteps } from "../core/steps.js";
import { fixed, tuple } from "../figure/numbers.js";
import { drawArrow, drawLine } from "../figure/shapes.js";
import { addPicture } from "./picture_view.js";
import { addOutside, bulbHandle, sharedPicture, sunHandle, sunStrokes, worldContent } from "./views.js";
import { BULB, SUN, toSun, worldText } from "./world.js";

/** @typedef {import("./figure.js").Figure} Figure */

/**
 * An image with light, rendered by the core while the figure is visible; before the first rendered image, the flat image is shown.
 * @param {Figure} fig
 * @param {() => { text: string, size: number[], integrator: string, samples: number, seed?: number }} wanted
 * @param {string} [key]
 */
export function litPicture(fig, wanted, key = fig.id) {
  /** @type {{ canvas: HTMLCanvasElement | null, samples: number, color: Float32Array | null }} */
  const newest = { canvas: null, samples: 0, color: null };
  return () => {
    const { size, ...rest } = wanted();
    fig.pictures.request(key, { ...rest, width: size[0], height: size[1] }, {
      onPicture: (picture) => {
        Object.assign(newest, picture);
        fig.shared.redraw();
      },
    });
    return { ...newest, canvas: newest.canvas || sharedPicture(fig) };
  };
}

/** The unit normal of a hit on the side of the ray's origin. @param {import("../core/steps.js").Candidate} found @param {number[]} r */
export function facingNormal({ n }, r) {
  const sign = dot(n, r) > 0 ? -1 : 1;
  return n.map((value) => (sign * value) / lengthOf(n));
}

/** cos θ at a point for light from a direction, and irradiances of the sun and the bulb in red. @param {number[]} f @param {number[]} n @param {{ bulb: number[], sun: number, height: number }} numbers */
export function irradianceOf(f, n, numbers) {
  const sun = Math.max(0, dot(n, toSun(numbers)));
  const off = minus(numbers.bulb, f);
  const distance = lengthOf(off);
  const bulb = Math.max(0, dot(n, off) / distance);
  return { sunCosine: sun, sun: SUN[0] * sun, distance, bulbCosine: bulb, bulb: (BULB[0] * bulb) / distance ** 2 };
}

/** The first triangle that occludes a point from another point; -1 if none does. @param {ArrayLike<number>} corners @param {number[]} from @param {number[]} to @param {number} own the triangle on which `from` lies */
export function blockerOf(corners, from, to, own) {
  const ray = { C: from, r: minus(to, from), forward: [0, 0, 1] };
  for (let i = 0; i < corners.length / 9; i++) {
    const found = i === own ? null : triangleSteps(corners, i, ray);
    if (found?.inside && found.t > 1e-9 && found.t < 1) return i;
  }
  return -1;
}

/** Sun and bulb. @param {Figure} fig */
export function buildLights(fig) {
  const { shared } = fig;
  const { numbers } = shared;
  let which = 0;
  const picture = litPicture(fig, () => ({ text: worldText(numbers, { lights: [which ? "bulb" : "sun", "sky"], size: [240, 180] }), size: [240, 180], integrator: "direct", samples: 4 }));
  addOutside(fig, {
    label: "The light, the hit and its normal", picksPixel: true,
    content: () => {
      const { winner } = shared.steps;
      const f = winner?.f || [0, 0, 0];
      const n = winner ? facingNormal(winner, shared.ray.r) : [0, 0, 1];
      const light = which ? numbers.bulb : plusTimes(f, 2, toSun(numbers));
      return {
        ...worldContent(fig), faded: 0.8, chosen: winner?.index,
        strokes: [...(which ? [] : sunStrokes(fig)), { from: f, to: plusTimes(f, 0.8, n), color: "n", symbol: "n", text: "n", arrow: true }, { from: f, to: light, color: "L", symbol: "L", text: which ? "" : "to the sun", arrow: !which }],
      };
    },
    handles: () => [which ? bulbHandle(fig) : sunHandle(fig)],
  });
  addPicture(fig, { label: "The lit picture", handles: () => [which ? bulbHandle(fig) : sunHandle(fig)], image: () => picture().canvas });
  fig.host.classList.add("double");
  fig.choice({ name: "Light", options: ["Sun", "Bulb"], get: () => which, set: (i) => { which = i; } });
  fig.slider({ name: "sun's direction", symbol: "L", min: -180, max: 180, step: 1, digits: 0, unit: "°", get: () => numbers.sun, set: (value) => { numbers.sun = value; } });
  fig.slider({ name: "sun's height", symbol: "L", min: 5, max: 90, step: 1, digits: 0, unit: "°", get: () => numbers.height, set: (value) => { numbers.height = value; } });
  fig.readout(() => {
    const { winner } = shared.steps;
    if (!winner) return [["The pixel shows no triangle."]];
    const { sunCosine, sun, distance, bulbCosine, bulb } = irradianceOf(winner.f, facingNormal(winner, shared.ray.r), numbers);
    if (!which) return [["cos θ = ", ["n", "n"], ["L", " · l"], ` = ${fixed(sunCosine, 5)}`], [["L", `E = S cos θ = ${fixed(SUN[0])} · ${fixed(sunCosine, 5)} = ${fixed(sun, 3)} W/m² (red part)`]]];
    return [[`distance d = ${fixed(distance, 4)} m,  cos θ = ${fixed(bulbCosine, 5)}`], [["L", `E = I cos θ / d² = ${BULB[0]} · ${fixed(bulbCosine, 5)} / ${fixed(distance, 4)}² = ${fixed(bulb, 3)} W/m² (red part)`]]];
  });
}

/** The diffuse and the specular part of the modified Phong model (Lafortune and Willems, 1994), in radians. @param {number} light angle @param {number} view angle @param {number} diffuse @param {number} specular @param {number} shininess */
export function phongParts(light, view, diffuse, specular, shininess) {
  const alpha = Math.cos(view + light);
  const f = specular * ((shininess + 2) / (2 * Math.PI)) * Math.max(0, alpha) ** shininess;
  return { diffuse: (diffuse / Math.PI) * Math.cos(light), specular: f * Math.cos(light) };
}

/** A number as an exponent. @param {number} value */
const raised = (value) => [...String(value)].map((digit) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[Number(digit)]).join("");

/** Diffuse and specular reflection. @param {Figure} fig */
export function buildReflection(fig) {
  let [light, view, diffuse, shininess] = [40, 20, 0.6, 20];
  const radians = (/** @type {number} */ degrees) => (degrees * Math.PI) / 180;
  const parts = (/** @type {number} */ angle) => phongParts(radians(-light), radians(angle), diffuse, 1 - diffuse, shininess);
  fig.canvas({
    ratio: 0.55, label: "Light that arrives at a surface, and how much of it leaves in each direction",
    draw: (pen) => {
      const [x, y, unit] = [pen.width / 2, pen.height - 30, Math.min(pen.width / 2.2, pen.height - 50)];
      const place = (/** @type {number} */ degrees, /** @type {number} */ radius) => [x + radius * unit * Math.sin(radians(degrees)), y - radius * unit * Math.cos(radians(degrees))];
      const angles = Array.from({ length: 181 }, (_, i) => i - 90);
      const most = Math.max(...angles.map((angle) => parts(angle).diffuse + parts(angle).specular), 0.25);
      const lobe = (/** @type {(angle: number) => number} */ value) => angles.map((angle) => place(angle, (0.8 * value(angle)) / most));
      drawLine(pen, lobe((angle) => parts(angle).diffuse + parts(angle).specular), { color: "n", fill: "plane", close: true });
      drawLine(pen, lobe((angle) => parts(angle).diffuse), { color: "t", fill: "inside", close: true });
      drawLine(pen, [[10, y], [pen.width - 10, y]], { color: "ink", width: 3 });
      drawArrow(pen, [x, y], place(0, 0.95), "n");
      pen.label({ at: place(0, 0.95), text: "n", symbol: "n" });
      drawArrow(pen, place(-light, 1), place(-light, 0.06), "L", 3);
      pen.label({ at: place(-light, 1), text: "light", symbol: "L" });
      drawLine(pen, [place(light, 0.06), place(light, 1)], { color: "soft-ink", dash: [5, 5], width: 1.5 });
      pen.label({ at: place(light, 1), text: "mirror direction", color: pen.color("soft-ink") });
      drawArrow(pen, [x, y], place(view, 0.9), "C", 3);
      pen.label({ at: place(view, 0.9), text: "to the camera", symbol: "C" });
    },
  });
  fig.slider({ name: "light θ", symbol: "L", min: 0, max: 85, step: 1, digits: 0, unit: "°", get: () => light, set: (value) => { light = value; } });
  fig.slider({ name: "camera", symbol: "C", min: -85, max: 85, step: 1, digits: 0, unit: "°", get: () => view, set: (value) => { view = value; } });
  fig.slider({ name: "diffuse share k", min: 0, max: 1, step: 0.01, get: () => diffuse, set: (value) => { diffuse = value; } });
  fig.slider({ name: "shininess h", min: 1, max: 200, step: 1, digits: 0, get: () => shininess, set: (value) => { shininess = value; } });
  fig.readout(() => {
    const now = parts(view);
    return [
      [`diffuse: k / π · cos θ = ${fixed(diffuse)} / π · cos ${light}° = ${fixed(now.diffuse, 4)}`],
      [`specular: ${fixed(1 - diffuse)} · (${shininess} + 2) / (2π) · cos${shininess === 1 ? "" : raised(shininess)} ${Math.abs(view - light)}° · cos ${light}° = ${fixed(now.specular, 4)}`],
    ];
  });
}

/** The second ray, to the light. @param {Figure} fig */
export function buildShadow(fig) {
  const { shared } = fig;
  const { numbers } = shared;
  const picture = litPicture(fig, () => ({ text: worldText(numbers, { lights: ["bulb", "sky"], size: [240, 180] }), size: [240, 180], integrator: "direct", samples: 4 }));
  const blocker = () => (shared.steps.winner ? blockerOf(shared.corners, shared.steps.winner.f, numbers.bulb, shared.steps.winner.index) : -1);
  addOutside(fig, {
    label: "The ray of the pixel, and the second ray to the bulb", picksPixel: true,
    content: () => {
      const { winner } = shared.steps;
      const f = winner?.f || [0, 0, 0];
      const strokes = winner ? [{ from: numbers.C, to: f, color: "r", symbol: "r", width: 2.5 }, { from: f, to: numbers.bulb, color: blocker() < 0 ? "L" : "soft-ink", symbol: "L", width: 3 }] : [];
      return { ...worldContent(fig), faded: 0.75, chosen: blocker(), strokes, spots: winner ? [{ at: f, color: "t", symbol: "f(t)", text: "f(t)" }] : [] };
    },
    handles: () => [bulbHandle(fig)],
  });
  addPicture(fig, { label: "The picture with shadows", handles: () => [bulbHandle(fig)], image: () => picture().canvas });
  fig.host.classList.add("double");
  fig.readout(() => {
    const { winner } = shared.steps;
    if (!winner) return [["The pixel shows no triangle."]];
    return [[["f(t)", `f(t) = ${tuple(winner.f)}`], blocker() < 0 ? "   Nothing lies between f(t) and the bulb: lit." : `   ${shared.names[blocker()]} lies between f(t) and the bulb: in shadow.`]];
  });
}
