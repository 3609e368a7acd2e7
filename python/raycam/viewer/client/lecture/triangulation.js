// Two cameras: the epipolar line, and triangulation by the midpoint between two rays.

import { dot, lengthOf, minus, plusTimes, rowOf } from "../core/vectors.js";
import { pixelOf, rayOfPixel } from "../core/steps.js";
import { cameraOf } from "./camera.js";
import { litPicture } from "./chapter_light.js";
import { fixed, tuple } from "../figure/numbers.js";
import { OutsideView } from "../figure/outside.js";
import { drawDot, drawLine } from "../figure/shapes.js";
import { addPicture } from "./picture_view.js";
import { addOutside, rigFor, worldContent } from "./views.js";
import { SIZE, worldText } from "./world.js";

/** @typedef {import("./figure.js").Figure} Figure */

const LARGEST_ERROR = 20;

/** The numbers of a second camera, to the right of the first by a baseline. @param {import("./world.js").Numbers} numbers @param {number} baseline */
export function secondNumbers(numbers, baseline) {
  const right = rowOf(cameraOf(numbers).R, 0);
  return { ...numbers, C: plusTimes(numbers.C, baseline, right) };
}

/** Depth from a disparity: f B / δ. @param {number} f @param {number} baseline @param {number} disparity */
export const depthOfDisparity = (f, baseline, disparity) => (f * baseline) / disparity;

/**
 * The closest points of two lines C + t r, and their midpoint M; their vector is perpendicular to both lines.
 * @param {{ C: number[], r: number[] }} first @param {{ C: number[], r: number[] }} second
 */
export function midpointOfRays(first, second) {
  const w = minus(second.C, first.C);
  const [a, b, c] = [dot(first.r, first.r), dot(first.r, second.r), dot(second.r, second.r)];
  const [p, q] = [dot(first.r, w), dot(second.r, w)];
  const [t, tSecond] = [(p * c - b * q) / (a * c - b * b), (b * p - a * q) / (a * c - b * b)];
  const ends = [plusTimes(first.C, t, first.r), plusTimes(second.C, tSecond, second.r)];
  return { t, tSecond, ends, M: ends[0].map((value, i) => (value + ends[1][i]) / 2), gap: lengthOf(minus(ends[0], ends[1])) };
}

/** Draws the epipolar line: the first camera's ray in the second image. @param {import("../figure/board.js").Pen} pen @param {import("./state.js").Shared} shared @param {(point: number[]) => number[]} place */
function drawEpipolarLine(pen, { ray }, place) {
  const unit = ray.r.map((value) => value / lengthOf(ray.r));
  const ends = [place(plusTimes(ray.C, 0.7, unit)), place(plusTimes(ray.C, 1000, unit))];
  drawLine(pen, ends, { color: "ground", width: 5 });
  drawLine(pen, ends, { color: "r", width: pen.lit("r") ? 4.5 : 2.5 });
  pen.touch("r", ends);
}

/** The epipolar line of the selected pixel in a second camera. @param {Figure} fig */
export function buildEpipolar(fig) {
  const { shared } = fig;
  let baseline = 0.6;
  const second = () => secondNumbers(shared.numbers, baseline);
  const picture = litPicture(fig, () => ({ text: worldText(second()), size: SIZE, integrator: "flat", samples: 1 }));
  addPicture(fig);
  fig.canvas({
    ratio: SIZE[1] / SIZE[0], label: "The picture of the second camera, with the epipolar line",
    draw: (pen) => {
      const { canvas } = picture();
      pen.ctx.imageSmoothingEnabled = false;
      if (canvas) pen.ctx.drawImage(canvas, 0, 0, pen.width, pen.height);
      const { P } = cameraOf(second());
      const place = (/** @type {number[]} */ point) => {
        const { u, v } = pixelOf(P, point);
        return [u, v].map((value) => ((value + 0.5) * pen.width) / SIZE[0]);
      };
      const { steps } = shared;
      drawEpipolarLine(pen, shared, place);
      if (steps.winner) {
        drawDot(pen, place(steps.winner.f), "t", 6);
        pen.label({ at: place(steps.winner.f), text: "the same point", symbol: "f(t)" });
      }
    },
  });
  fig.host.classList.add("double", "even");
  fig.slider({ name: "baseline B", symbol: "C", min: 0.1, max: 1.5, step: 0.05, get: () => baseline, set: (value) => { baseline = value; } });
  fig.readout(() => {
    const { winner } = shared.steps;
    if (!winner) return [["The pixel shows no triangle."]];
    const disparity = shared.numbers.pixel[0] - pixelOf(cameraOf(second()).P, winner.f).u;
    const depth = winner.t * dot(shared.ray.r, shared.ray.forward);
    return [[`disparity δ = ${fixed(disparity, 2)} pixels`], [["t", `depth = f B / δ = ${fixed(shared.numbers.fx, 0)} · ${fixed(baseline)} / ${fixed(disparity, 2)} = ${fixed(depthOfDisparity(shared.numbers.fx, baseline, disparity), 3)}`], `    from the ray: ${fixed(depth, 3)}`]];
  });
}

/** Two rays that pass each other, and the midpoint of their closest points. @param {Figure} fig */
export function buildTriangulate(fig) {
  const { shared } = fig;
  let baseline = 1.2;
  const error = [4, -3];
  const second = () => secondNumbers(shared.numbers, baseline);
  const picture = litPicture(fig, () => ({ text: worldText(second()), size: SIZE, integrator: "flat", samples: 1 }));
  const now = () => {
    const { winner } = shared.steps;
    if (!winner) return null;
    const { P } = cameraOf(second());
    const exact = pixelOf(P, winner.f);
    const pixel = [exact.u + error[0], exact.v + error[1]];
    const ray = rayOfPixel(P, pixel[0], pixel[1]);
    return { f: winner.f, exact: [exact.u, exact.v], pixel, ray, P, ...midpointOfRays(shared.ray, ray) };
  };
  addOutside(fig, {
    label: "Two cameras, the rays of their pixels, and the midpoint of the closest points", view: new OutsideView({ azimuth: -14, elevation: 46, center: [0.9, -2.1, 0.9], radius: 2.5 }), picksPixel: true,
    content: () => ({ ...worldContent(fig), faded: 0.5, second: rigFor(second(), picture().canvas), ...contentOfMidpoint(shared, now()) }),
  });
  const setError = (/** @type {number[]} */ values) => values.forEach((value, i) => { error[i] = Math.max(-LARGEST_ERROR, Math.min(LARGEST_ERROR, Math.round(2 * value) / 2)); });
  let scale = 1;
  fig.canvas({
    ratio: SIZE[1] / SIZE[0], label: "The picture of the second camera. Drag the measured pixel; the arrow keys move it.",
    draw: (pen) => {
      scale = pen.width / SIZE[0];
      pen.ctx.imageSmoothingEnabled = false;
      const { canvas } = picture();
      if (canvas) pen.ctx.drawImage(canvas, 0, 0, pen.width, pen.height);
      drawMeasured(pen, shared, now());
    },
    grab: () => now() !== null,
    drag: (at, from) => {
      const found = now();
      if (!found) return;
      setError(Math.hypot(...at.map((value, i) => value / scale - 0.5 - found.exact[i])) > LARGEST_ERROR ? error.map((value, i) => value + (at[i] - from[i]) / scale) : at.map((value, i) => value / scale - 0.5 - found.exact[i]));
      shared.changed();
    },
    nudge: ([x, y]) => {
      setError([error[0] + 0.5 * x, error[1] + 0.5 * y]);
      shared.changed();
    },
  });
  fig.host.classList.add("double");
  ["column", "row"].forEach((name, i) => fig.slider({ name: `Δ ${name}`, symbol: "r′", min: -LARGEST_ERROR, max: LARGEST_ERROR, step: 0.5, digits: 1, unit: " px", get: () => error[i], set: (value) => { error[i] = value; } }));
  fig.slider({ name: "baseline B", symbol: "C", min: 0.3, max: 2, step: 0.05, get: () => baseline, set: (value) => { baseline = value; } });
  fig.readout(() => {
    const found = now();
    if (!found) return [["The pixel shows no triangle."]];
    const { t, tSecond, M, gap, f } = found;
    if (!M.every(Number.isFinite)) return [["The two rays are parallel."]];
    return [
      [["t", `t = ${fixed(t, 4)}`], "    ", ["r′", `t′ = ${fixed(tSecond, 4)}`], `    the rays pass each other at ${fixed(gap, 4)} m`],
      [["M", `M = ${tuple(M, 3)}`], "    ", ["f(t)", `true point ${tuple(f, 3)}`], `    error ${fixed(lengthOf(minus(M, f)), 4)} m`],
    ];
  });
}

/** The rays, their closest points and the midpoint from outside. @param {import("./state.js").Shared} shared @param {(ReturnType<typeof midpointOfRays> & { ray: { C: number[], r: number[] }, f: number[] }) | null} found */
function contentOfMidpoint({ ray }, found) {
  if (!found || !found.M.every(Number.isFinite)) return {};
  const beyond = (/** @type {{ C: number[], r: number[] }} */ { C, r }, /** @type {number} */ t) => plusTimes(C, (Math.sign(t) || 1) * Math.min(1.15 * Math.abs(t), 9 / lengthOf(r)), r);
  return {
    strokes: [
      { from: ray.C, to: beyond(ray, found.t), color: "r", symbol: "r", width: 2.5, text: "r" }, { from: found.ray.C, to: beyond(found.ray, found.tSecond), color: "r′", symbol: "r′", width: 2.5, text: "r′" },
      { from: found.ends[0], to: found.ends[1], color: "M", symbol: "M", width: 4 },
    ],
    spots: [
      { at: ray.C, color: "C", symbol: "C", text: "C" }, { at: found.ray.C, color: "C′", symbol: "C′", text: "C′" },
      { at: found.f, color: "soft-ink", symbol: "f(t)", text: "true point", radius: 4 }, { at: found.M, color: "M", symbol: "M", text: "M", radius: 6 },
    ],
  };
}

/** Draws the measured pixel in the second image, the true pixel, and the epipolar line. @param {import("../figure/board.js").Pen} pen @param {import("./state.js").Shared} shared @param {{ P: number[], exact: number[], pixel: number[] } | null} found */
function drawMeasured(pen, shared, found) {
  if (!found) return;
  const place = (/** @type {number[]} */ pixel) => pixel.map((value) => ((value + 0.5) * pen.width) / SIZE[0]);
  drawEpipolarLine(pen, shared, (point) => {
    const { u, v } = pixelOf(found.P, point);
    return place([u, v]);
  });
  drawDot(pen, place(found.exact), "t", 5);
  pen.label({ at: place(found.exact), text: "true pixel", symbol: "f(t)" });
  const [x, y] = place(found.pixel);
  const size = pen.lit("r′") ? 11 : 9;
  for (const [color, width] of /** @type {[string, number][]} */ ([["r′", 6], ["white", 2.5]])) {
    drawLine(pen, [[x - size, y - size], [x + size, y + size]], { color, width });
    drawLine(pen, [[x - size, y + size], [x + size, y - size]], { color, width });
  }
  pen.touch("r′", [[x, y]]);
  pen.label({ at: [x, y], text: "measured", symbol: "r′" });
}
