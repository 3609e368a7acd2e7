// Chapters 3 to 5: the camera matrix, roll, pitch and yaw, and the ray of a pixel.

import { cross, dot, lengthOf, minus, plusTimes, rowOf } from "../core/vectors.js";
import { pixelOf } from "../core/steps.js";
import { addMatrices } from "./matrices.js";
import { fixed, tuple } from "../figure/numbers.js";
import { OutsideView } from "../figure/outside.js";
import { drawDot, drawLine } from "../figure/shapes.js";
import { addPicture } from "./picture_view.js";
import { addOutside, cameraHandles, cornerHandles, imagePoint, vertexHandle, worldContent } from "./views.js";

/** @typedef {import("./figure.js").Figure} Figure */

/** @param {Figure} fig @param {"fx" | "fy" | "skew" | "cx" | "cy" | "roll" | "pitch" | "yaw"} key @param {Partial<Parameters<Figure["slider"]>[0]>} options */
function numberSlider(fig, key, options) {
  const { numbers } = fig.shared;
  fig.slider({ name: key, min: 0, max: 1, step: 1, digits: 0, get: () => numbers[key], set: (value) => { numbers[key] = value; }, ...options });
}

/** @param {Figure} fig */
function addAngles(fig) {
  numberSlider(fig, "roll", { symbol: "R", min: -180, max: 180, unit: "°" });
  numberSlider(fig, "pitch", { symbol: "R", min: -89, max: 89, unit: "°" });
  numberSlider(fig, "yaw", { symbol: "R", min: 0, max: 360, unit: "°" });
}

/** The eleven numbers of P. @param {Figure} fig */
export function buildMatrix(fig) {
  const { shared } = fig;
  addOutside(fig, { label: "The camera, its image plane and the world", content: () => worldContent(fig), handles: () => [...cameraHandles(fig), ...cornerHandles(fig)] });
  addPicture(fig, { handles: () => cornerHandles(fig) });
  fig.host.classList.add("double", "many");
  fig.group("K", "K: five intrinsic parameters");
  numberSlider(fig, "fx", { name: "fₓ", symbol: "K", min: 120, max: 700 });
  numberSlider(fig, "fy", { name: "fᵧ", symbol: "K", min: 120, max: 700 });
  numberSlider(fig, "skew", { name: "skew", symbol: "K", min: -150, max: 150 });
  numberSlider(fig, "cx", { name: "cₓ", symbol: "K", min: 0, max: 319, step: 0.5, digits: 1 });
  numberSlider(fig, "cy", { name: "cᵧ", symbol: "K", min: 0, max: 239, step: 0.5, digits: 1 });
  fig.group("R", "R: three angles");
  addAngles(fig);
  fig.group("C", "C: three coordinates");
  ["x", "y", "z"].forEach((axis, i) =>
    fig.slider({ name: axis, symbol: "C", min: i === 2 ? 0.2 : -6, max: 6, step: 0.05, get: () => shared.numbers.C[i], set: (value) => { shared.numbers.C[i] = value; } }),
  );
  addMatrices(fig, [
    { symbol: "P", columns: 4, get: () => shared.camera.P },
    { symbol: "K", title: "= K", columns: 3, get: () => shared.camera.K, digits: 1 },
    { symbol: "R", title: "R", columns: 3, get: () => shared.camera.R, digits: 3 },
    { symbol: "C", title: "[ I | −C ]", columns: 4, get: () => [1, 0, 0, -shared.numbers.C[0], 0, 1, 0, -shared.numbers.C[1], 0, 0, 1, -shared.numbers.C[2]], marked: (i) => i % 4 === 3 },
  ]);
}

/** A point X and its pixel x = P X. @param {Figure} fig */
export function buildProject(fig) {
  const { shared } = fig;
  const corner = () => shared.numbers.triangles[0].corners[2];
  const imageOf = () => pixelOf(shared.camera.P, corner());
  const handles = () => [vertexHandle(fig, 2, { color: "X", symbol: "X", text: "X" })];
  addOutside(fig, {
    label: "A point X of the world and its image x",
    content: () => {
      const { u, v } = imageOf();
      const x = imagePoint(fig, u, v);
      return {
        ...worldContent(fig), faded: 0.6, strokes: [{ from: corner(), to: shared.numbers.C, color: "P", width: 2.5, symbol: "P" }],
        spots: [{ at: shared.numbers.C, color: "C", symbol: "C", text: "C" }, { at: x, color: "x", symbol: "x", text: "x" }],
      };
    },
    handles,
  });
  addPicture(fig, {
    handles: () => [{ ...handles()[0], text: "" }],
    overlay: (pen, place) => {
      const { u, v } = imageOf();
      drawDot(pen, place(u, v), "x", pen.lit("x") ? 9 : 6);
      pen.label({ at: place(u, v), text: `x = (${fixed(u, 1)}, ${fixed(v, 1)})`, symbol: "x" });
    },
  });
  fig.host.classList.add("double");
  fig.readout(() => {
    const X = [...corner(), 1];
    const x = [0, 1, 2].map((i) => shared.camera.P.slice(4 * i, 4 * i + 4).reduce((sum, value, k) => sum + value * X[k], 0));
    const { u, v } = imageOf();
    return [
      [["X", `X = ${tuple(corner())}`]],
      [["P", `P (X, 1) = ${tuple(x, 4)}`], `,  divided by its third number: `, ["x", `x = (${fixed(u)}, ${fixed(v)})`]],
    ];
  });
}

/** Roll, pitch and yaw turn R. @param {Figure} fig */
export function buildAngles(fig) {
  const { shared } = fig;
  addOutside(fig, {
    label: "The camera's axes: right, down and forward", view: new OutsideView({ azimuth: -12, elevation: 26, center: [1.9, -3.4, 1.75], radius: 1.45 }),
    content: () => {
      const { C } = shared.numbers;
      const [right, down] = [0, 1].map((i) => rowOf(shared.camera.R, i));
      return {
        ...worldContent(fig), faded: 0.7,
        strokes: [
          { from: C, to: plusTimes(C, 0.7, right), color: "R", text: "right", symbol: "R", arrow: true },
          { from: C, to: plusTimes(C, 0.7, down), color: "R", text: "down", symbol: "R", arrow: true },
        ],
      };
    },
    handles: () => cameraHandles(fig),
  });
  addPicture(fig);
  fig.host.classList.add("double");
  addAngles(fig);
  addMatrices(fig, [{ symbol: "R", columns: 3, get: () => shared.camera.R, digits: 3, marked: (i) => i >= 6 }]);
}

/** Back-projection: X' = P⁺x. @param {Figure} fig */
export function buildBackProject(fig) {
  const { shared } = fig;
  addOutside(fig, {
    label: "The line through the pixel and the centre, with the point X′", view: new OutsideView({ center: [0.7, -1.6, 0.9], radius: 2.8 }), picksPixel: true,
    content: () => {
      const { ray, numbers } = shared;
      const x = imagePoint(fig, numbers.pixel[0], numbers.pixel[1]);
      const unit = ray.r.map((value) => value / lengthOf(ray.r));
      const spots = [{ at: numbers.C, color: "C", symbol: "C", text: "C" }, { at: x, color: "x", symbol: "x", text: "x" }];
      if (ray.XPrime) spots.push({ at: ray.XPrime, color: "X′", symbol: "X′", text: "X′" });
      return { ...worldContent(fig), faded: 0.55, strokes: [{ from: plusTimes(numbers.C, -2, unit), to: plusTimes(numbers.C, 9, unit), color: "r", width: 1.6 }], spots };
    },
  });
  addPicture(fig);
  fig.host.classList.add("double");
  fig.readout(() => {
    const { ray, numbers } = shared;
    return [
      [["x", `x = (${numbers.pixel.join(", ")}, 1)`]],
      [["P", "P⁺"], ["x", "x"], ` = ${tuple(ray.X, 6)}`],
      [["X′", `X′ = ${ray.XPrime ? tuple(ray.XPrime, 3) : "at infinity"}`], "  after the division by the fourth number"],
    ];
  });
}

/** The sign of the ray. @param {Figure} fig */
export function buildSign(fig) {
  const { shared } = fig;
  addOutside(fig, {
    label: "X′ − C, the axis v, and the ray that points forward", view: new OutsideView({ center: [1.2, -2.4, 1.2], radius: 2.5 }),
    content: () => {
      const { ray, numbers } = shared;
      const tip = plusTimes(numbers.C, 1.9 / lengthOf(ray.r), ray.r);
      const strokes = [{ from: numbers.C, to: tip, color: "r", symbol: "r", text: "r", arrow: true, width: 4 }];
      if (ray.XPrime) strokes.push({ from: numbers.C, to: ray.XPrime, color: "X′", symbol: "X′", text: "X′ − C", arrow: true, width: 2 });
      return { ...worldContent(fig), faded: 0.55, strokes };
    },
    handles: () => cameraHandles(fig),
  });
  numberSlider(fig, "yaw", { symbol: "R", min: 0, max: 360, unit: "°" });
  fig.readout(() => {
    const { forward, along, line } = shared.ray;
    return [
      [["v", `v = third row of R = ${tuple(forward, 3)}`], "    ", ["X′", `X′ − C = ${tuple(line, 3)}`]],
      [["v", "v"], " · ", ["X′", "(X′ − C)"], ` = ${fixed(along, 3)} ${along > 0 ? "> 0: " : "< 0: "}`, ["r", along > 0 ? "r = X′ − C" : "r = C − X′"], along > 0 ? "  X′ is in front of the camera" : "  X′ is behind the camera"],
    ];
  });
}

/** The normal of the plane, by the cross product. @param {Figure} fig */
export function buildNormal(fig) {
  const { shared } = fig;
  const corners = () => shared.numbers.triangles[0].corners;
  addOutside(fig, {
    label: "Two edges of a triangle and their cross product", view: new OutsideView({ azimuth: 66, elevation: 18, center: [0.5, -0.8, 0.45], radius: 1.2 }),
    content: () => {
      const [a, b, c] = corners();
      const n = cross(minus(c, a), minus(b, a));
      const middle = a.map((value, i) => (value + b[i] + c[i]) / 3);
      const first = shared.corners.length / 9 - 2;
      return {
        corners: shared.corners.slice(9 * first, 9 * first + 9), colors: shared.colors.slice(first), faded: 0.85,
        patches: [{ corners: planePatch(middle, n), color: "plane", symbol: "n" }],
        strokes: [
          { from: a, to: b, color: "edge", symbol: "b", text: "b − a", arrow: true, width: 3 }, { from: a, to: c, color: "edge", symbol: "c", text: "c − a", arrow: true, width: 3 },
          { from: a, to: plusTimes(a, 1, n), color: "n", symbol: "n", text: "n", arrow: true, width: 4 },
        ],
      };
    },
    handles: () => [0, 1, 2].map((k) => vertexHandle(fig, k)),
  });
  fig.readout(() => {
    const [a, b, c] = corners();
    const [v1, v2] = [minus(b, a), minus(c, a)];
    const n = cross(v2, v1);
    return [
      [`b − a = ${tuple(v1)}    c − a = ${tuple(v2)}`],
      [["n", `n = (c − a) × (b − a) = ${tuple(n, 3)}`], `    n · (b − a) = ${fixed(dot(n, v1), 3)}    n · (c − a) = ${fixed(dot(n, v2), 3)}    area = |n| / 2 = ${fixed(lengthOf(n) / 2, 3)}`],
    ];
  });
}

/** A square in the plane with a normal. @param {number[]} middle @param {number[]} n @param {number} [half] */
export function planePatch(middle, n, half = 1.1) {
  const unit = n.map((value) => value / (lengthOf(n) || 1));
  const p = cross(unit, Math.abs(unit[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0]);
  const e = p.map((value) => value / (lengthOf(p) || 1));
  const g = cross(unit, e);
  return [[1, 1], [-1, 1], [-1, -1], [1, -1]].map(([s, t]) => plusTimes(plusTimes(middle, s * half, e), t * half, g));
}

/** t along the ray, and the distance from the plane. @param {Figure} fig */
export function buildPlane(fig) {
  const { shared } = fig;
  const LAST = 600;
  let step = 240;
  const full = () => (shared.found && Number.isFinite(shared.found.t) ? 1.5 * Math.abs(shared.found.t) : 10 / lengthOf(shared.ray.r));
  const now = () => (step / LAST) * full();
  const heightAt = (/** @type {number} */ t) => (shared.found ? dot(shared.found.n, minus(plusTimes(shared.ray.C, t, shared.ray.r), shared.found.corners[0])) : 0);
  addOutside(fig, {
    label: "The ray, the plane of the triangle, and f(t)", picksPixel: true,
    content: () => {
      const { ray, found, numbers } = shared;
      const f = plusTimes(ray.C, now(), ray.r);
      const middle = found ? found.corners[0].map((_, i) => (found.corners[0][i] + found.corners[1][i] + found.corners[2][i]) / 3) : [0, 0, 0];
      return {
        ...worldContent(fig), faded: 0.45, chosen: found?.index,
        patches: found ? [{ corners: planePatch(middle, found.n, 1.3), color: "plane", line: "n", symbol: "n" }] : [],
        strokes: [
          { from: numbers.C, to: plusTimes(ray.C, full(), ray.r), color: "r", width: 1.2, symbol: "r" }, { from: numbers.C, to: f, color: "r", width: 3.5, symbol: "r", arrow: true },
        ],
        spots: [{ at: numbers.C, color: "C", symbol: "C", text: "C" }, { at: f, color: "t", symbol: "f(t)", text: "f(t)" }],
      };
    },
  });
  fig.canvas({
    ratio: 0.75, label: "n · (f(t) − a) as a function of t: a straight line",
    draw: (pen) => {
      const { found } = shared;
      const [left, right, top, bottom] = [44, pen.width - 16, 20, pen.height - 34];
      const most = Math.max(Math.abs(heightAt(0)), Math.abs(heightAt(full())), 1e-9) * 1.15;
      const place = (/** @type {number} */ t, /** @type {number} */ h) => [left + (t / full()) * (right - left), (top + bottom) / 2 - (h / most) * ((bottom - top) / 2)];
      drawLine(pen, [[left, top], [left, bottom]], { color: "soft-ink", width: 1 });
      drawLine(pen, [place(0, 0), place(full(), 0)], { color: "soft-ink", width: 1 });
      drawLine(pen, [place(0, heightAt(0)), place(full(), heightAt(full()))], { color: "n", width: pen.lit("n") ? 4 : 2.5 });
      pen.label({ at: place(0, heightAt(0)), text: "n · (f(t) − a)", symbol: "n" });
      drawLine(pen, [place(now(), 0), place(now(), heightAt(now()))], { color: "t", width: 1.5, dash: [4, 4] });
      drawDot(pen, place(now(), heightAt(now())), "t", 6);
      if (found && found.t > 0) {
        drawDot(pen, place(found.t, 0), "r", 6);
        pen.label({ at: place(found.t, 0), text: `t = ${fixed(found.t, 3)}`, symbol: "t" });
      }
    },
  });
  fig.host.classList.add("double");
  fig.slider({ name: "t", symbol: "t", min: 0, max: LAST, step: 1, digits: 0, unit: " ‰", get: () => step, set: (value) => { step = value; }, text: () => fixed(now(), 3) });
  fig.stepper({ last: () => LAST, get: () => step, set: (i) => { step = i; }, ms: 6, stride: 50 });
  fig.readout(() => {
    const { found } = shared;
    if (!found) return [["No triangle is near this pixel's ray. Select another pixel."]];
    return [
      [["n", `n · (a − C) = ${fixed(found.above, 4)}`], "    ", `n · r = ${fixed(found.below, 4)}`, "    ", ["t", `t = ${fixed(found.above, 4)} / ${fixed(found.below, 4)} = ${fixed(found.t, 4)}`]],
      [["t", `now: t = ${fixed(now(), 5)}`], `,  n · (f(t) − a) = ${fixed(heightAt(now()), 3)}`],
    ];
  });
}
