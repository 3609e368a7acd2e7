// Chapters 7 to 9: the inside test by crossings, the closest hit, and the tree.

import { lengthOf, minus, plusTimes } from "../core/vectors.js";
import { triangleSteps } from "../core/steps.js";
import { fixed, tuple } from "../figure/numbers.js";
import { drawCrossings } from "../figure/crossings.js";
import { drawDot, drawLine } from "../figure/shapes.js";
import { buildTree, traverse } from "./tree.js";
import { planePatch } from "./chapter_camera.js";
import { addPicture } from "./picture_view.js";
import { addOutside, worldContent } from "./views.js";

/** @typedef {import("./figure.js").Figure} Figure */

/** Crossings of u with the edges, for a point f that the reader drags in the triangle's plane. @param {Figure} fig */
export function buildCrossings(fig) {
  const flat = [[0, 0, 0], [2, 0.25, 0], [0.75, 1.75, 0]];
  const f = [0.8125, 0.75, 0];
  let step = 3;
  let scale = 1;
  /** A multiple of 1/64: products of such numbers are exact, so u can pass exactly through a vertex. */
  const snap = (/** @type {number} */ value, /** @type {number} */ low, /** @type {number} */ high) => Math.round(64 * Math.max(low, Math.min(high, value))) / 64;
  const move = (/** @type {number[]} */ point, /** @type {number[]} */ [x, y]) => {
    point[0] = snap(x, -1.25, 3);
    point[1] = snap(y, -1.75, 2);
  };
  const glideTo = (/** @type {number[]} */ to) => {
    const from = [...f];
    fig.glide((share) => move(f, [0, 1].map((i) => from[i] + share * (to[i] - from[i]))));
  };
  let selected = 0;
  const points = () => [f, ...flat];
  const found = () => triangleSteps(flat.flat(), 0, { C: [f[0], f[1], 1], r: [0, 0, -1], forward: [0, 0, -1] });
  let left = 0;
  const place = (/** @type {number[]} */ [x, y]) => [left + scale * (x + 1.1), 20 + scale * (2 - y)];
  /** @type {number[] | null} */
  let held = null;
  fig.canvas({
    ratio: 0.72, label: "A triangle, the point f(t), the distant point g and the edges that u crosses. Drag f(t) or a vertex; the arrow keys move f(t), and Enter selects a vertex that they move.",
    draw: (pen) => {
      scale = Math.min((pen.width - 40) / 3.6, (pen.height - 44) / 3.8);
      left = (pen.width - 3.4 * scale) / 2;
      drawCrossings(pen, found(), place, step);
    },
    grab: (at) => {
      held = points().find((point) => Math.hypot(place(point)[0] - at[0], place(point)[1] - at[1]) < 18) || null;
      return held !== null;
    },
    drag: (at) => held && move(held, [(at[0] - left) / scale - 1.1, 2 - (at[1] - 20) / scale]),
    next: () => {
      selected = (selected + 1) % 4;
      return `Arrow keys move ${["f(t)", "a", "b", "c"][selected]}.`;
    },
    nudge: ([x, y]) => move(points()[selected], [points()[selected][0] + x / 64, points()[selected][1] - y / 64]),
  });
  fig.stepper({ last: () => 3, get: () => step, set: (i) => { step = i; } });
  fig.button("Send u through vertex b", () => {
    const { g } = found();
    glideTo(plusTimes(flat[1], 0.25, minus(flat[1], g)));
    step = 3;
  });
  fig.button("Put f(t) inside", () => glideTo([0, 1].map((i) => flat.reduce((sum, corner) => sum + corner[i] / 3, 0))));
  fig.readout(() => {
    const { alongU, alongEdge, crossed, crossings, u, inside } = found();
    const lines = [0, 1, 2].slice(0, step).map((i) => {
      const numbers = Number.isNaN(alongEdge[i]) ? "parallel to u" : `s = ${fixed(alongU[i], 3)} along u, q = ${fixed(alongEdge[i], 3)} along the edge`;
      return [`v${"₁₂₃"[i]}: ${numbers}: ${crossed[i] ? "crossed" : "not crossed"}`];
    });
    const on = [0, 1, 2].filter((i) => minus(flat[i], f)[0] * u[1] === minus(flat[i], f)[1] * u[0]).map((i) => "abc"[i]);
    if (on.length) lines.push([`u passes exactly through ${on.join(" and ")}, which counts as right of u`]);
    const sum = crossed.slice(0, step).filter(Boolean).length;
    return [[["u", `u = g − f(t) = ${tuple(u.slice(0, 2))}`]], ...lines, [step < 3 ? `${sum} ${sum === 1 ? "crossing" : "crossings"} so far` : `${crossings} ${crossings === 1 ? "crossing" : "crossings"}: ${crossings % 2 ? "odd" : "even"}, f(t) is ${inside ? "inside" : "outside"}`]];
  });
}

/** All planes along one ray, and the closest hit. @param {Figure} fig */
export function buildClosest(fig) {
  const { shared } = fig;
  let step = 99;
  const all = () => Array.from({ length: shared.corners.length / 9 }, (_, i) => triangleSteps(shared.corners, i, shared.ray));
  const last = () => shared.corners.length / 9;
  addOutside(fig, {
    label: "The points where the ray meets the planes of the triangles", picksPixel: true,
    content: () => {
      const tried = all().slice(0, step);
      const best = closestOf(tried);
      const current = tried.length < last() ? tried[tried.length - 1] : best;
      const spots = tried.filter(({ t }) => t > 0 && t * lengthOf(shared.ray.r) < 12).map(({ f, inside, index }) => ({ at: f, color: inside ? (index === best?.index ? "r" : "t") : "soft-ink", radius: inside ? 7 : 4 }));
      return {
        ...worldContent(fig), faded: 0.5, chosen: current?.index,
        patches: current && step < last() ? [{ corners: planePatch(current.corners[0].map((_, k) => (current.corners[0][k] + current.corners[1][k] + current.corners[2][k]) / 3), current.n, 1.2), color: "plane", line: "n", symbol: "n" }] : [],
        strokes: [{ from: shared.ray.C, to: plusTimes(shared.ray.C, best ? best.t : 9 / lengthOf(shared.ray.r), shared.ray.r), color: "r", width: 2.5, symbol: "r" }],
        spots: [...spots, { at: shared.ray.C, color: "C", symbol: "C", text: "C" }],
      };
    },
  });
  addPicture(fig);
  fig.host.classList.add("double");
  fig.stepper({ last, get: () => Math.min(step, last()), set: (i) => { step = i; }, ms: 500 });
  fig.readout(() => {
    const tried = all().slice(0, step);
    const best = closestOf(tried);
    const lines = tried.filter(({ t }) => t > 0).sort((a, b) => a.t - b.t).filter(({ inside }, i) => inside || i < 2)
      .map(({ index, t, inside, crossings }) => [["t", `t = ${fixed(t, 4)}`], `   ${shared.names[index]}: ${crossings} ${crossings === 1 ? "crossing" : "crossings"}, ${inside ? (index === best?.index ? "the closest hit" : "a hit, but farther") : "outside"}`]);
    return /** @type {(string | [string, string])[][]} */ ([[`${tried.length} of ${last()} triangles tried; the pixel shows ${best ? shared.names[best.index] : "the background"}`], ...lines.slice(0, 5)]);
  });
}

/** @param {import("../core/steps.js").Candidate[]} tried */
export function closestOf(tried) {
  return tried.filter(({ inside }) => inside).sort((a, b) => a.t - b.t || a.index - b.index)[0] || null;
}

/** Boxes around groups of triangles: most triangles are never tried. @param {Figure} fig */
export function buildTreeFigure(fig) {
  let [count, angle, step] = [200, 20, 99];
  let corners = scatter(count);
  let tree = buildTree(corners);
  const from = [-0.2, 0.5, 0];
  const ray = () => ({ C: from, r: [Math.cos((angle * Math.PI) / 180), Math.sin((angle * Math.PI) / 180), 0], forward: [1, 0, 0] });
  fig.canvas({
    ratio: 0.55, label: "Many triangles in nested boxes, and the boxes that a ray enters",
    draw: (pen) => {
      const scale = Math.min(pen.width / 2.3, pen.height / 1.1);
      const place = (/** @type {number[]} */ [x, y]) => [0.3 * scale + x * scale, pen.height - 0.05 * scale - y * scale];
      const { visited, tested, hit } = traverse(tree, corners, ray());
      for (let i = 0; i < corners.length / 9; i++) {
        const points = [0, 3, 6].map((k) => place([corners[9 * i + k], corners[9 * i + k + 1]]));
        const fill = i === hit?.index ? "r" : tested.includes(i) ? "t" : "soft";
        drawLine(pen, points, { color: fill === "soft" ? "soft-ink" : fill, width: 0.7, fill, close: true });
      }
      visited.slice(0, step).forEach(({ low, high, depth }) => {
        const box = [[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]].map(place);
        drawLine(pen, box, { color: "P", width: Math.max(0.8, 3 - 0.4 * depth), close: true });
      });
      const end = plusTimes(from, hit ? hit.t : 2.4, ray().r);
      drawLine(pen, [place(from), place(end)], { color: "r", width: 2.5 });
      drawDot(pen, place(from), "C", 6);
      pen.label({ at: place(from), text: "C", symbol: "C" });
    },
  });
  fig.slider({ name: "direction", symbol: "r", min: -25, max: 25, step: 0.5, digits: 1, unit: "°", get: () => angle, set: (value) => { angle = value; } });
  fig.slider({
    name: "triangles", min: 10, max: 1000, step: 10, digits: 0, get: () => count,
    set: (value) => {
      count = value;
      corners = scatter(count);
      tree = buildTree(corners);
    },
  });
  fig.stepper({ last: () => traverse(tree, corners, ray()).visited.length, get: () => Math.min(step, traverse(tree, corners, ray()).visited.length), set: (i) => { step = i; }, ms: 350 });
  fig.readout(() => {
    const { visited, tested, hit } = traverse(tree, corners, ray());
    return [[`Without the tree: ${count} triangles. With it: ${visited.length} boxes entered and ${tested.length} triangles tried. ${hit ? `Hit at t = ${fixed(hit.t, 3)}.` : "No hit."}`]];
  });
}

/** Small upright triangles, scattered by a fixed sequence. @param {number} count */
export function scatter(count) {
  /** @type {number[]} */
  const corners = [];
  for (let i = 0; i < count; i++) {
    const [x, y, turn] = [(0.5 + 0.7548776662 * (i + 1)) % 1, (0.5 + 0.5698402910 * (i + 1)) % 1, (0.618034 * i) % 1];
    for (let k = 0; k < 3; k++) {
      const a = 2 * Math.PI * (turn + k / 3);
      // The third coordinate makes the triangle cross the plane of the drawing.
      corners.push(0.15 + 1.5 * x + 0.02 * Math.cos(a), y + 0.02 * Math.sin(a), k === 0 ? 0.02 : -0.02);
    }
  }
  return corners;
}

