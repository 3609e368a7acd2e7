// The inside test: a triangle in its plane, the walk u from f(t) to g, and the edges that the walk crosses.

import { cross, dot, lengthOf, minus, plusTimes } from "../core/vectors.js";
import { drawArrow, drawDot, drawLine, drawRing } from "./shapes.js";

/** @typedef {import("../core/steps.js").Candidate} Candidate */

/**
 * Draws the crossings of the first `step` edges.
 * @param {import("./board.js").Pen} pen
 * @param {Pick<Candidate, "corners" | "edges" | "f" | "g" | "alongEdge" | "crossed" | "inside">} found
 * @param {(point: number[]) => number[]} place maps a point of the plane to its position in the figure
 * @param {number} [step]
 */
export function drawCrossings(pen, { corners, edges, f, g, alongEdge, crossed, inside }, place, step = 3) {
  drawLine(pen, corners.map(place), { color: "edge", width: 1, fill: inside ? "inside" : "soft", close: true });
  corners.forEach((corner, i) => {
    const isDone = i < step;
    drawArrow(pen, place(corner), place(plusTimes(corner, 1, edges[i])), isDone ? "edge" : "soft-ink", isDone ? 3 : 1.5);
    pen.touch("abc"[i], [place(corner)]);
    pen.label({ at: place(plusTimes(corner, 0.5, edges[i])), text: `v${"₁₂₃"[i]}`, color: pen.color("edge") });
    pen.label({ at: place(corner), text: "abc"[i], symbol: "abc"[i] });
  });
  drawLine(pen, [place(corners[0]), place(g)], { color: "edge", width: 1, dash: [4, 4] });
  drawArrow(pen, place(f), place(g), "u", pen.lit("u") ? 5 : 3);
  pen.touch("u", [place(f), place(g)]);
  pen.label({ at: place(f.map((value, i) => 0.5 * (value + g[i]))), text: "u", symbol: "u" });
  corners.forEach((corner, i) => {
    if (i >= step || Number.isNaN(alongEdge[i])) return;
    const at = place(plusTimes(corner, alongEdge[i], edges[i]));
    if (crossed[i]) {
      drawDot(pen, at, "r", 8);
      pen.avoid(at);
    }
    if (!crossed[i] && at.every((value, k) => value > 0 && value < [pen.width, pen.height][k])) drawDot(pen, at, "soft-ink", 4);
  });
  corners.forEach((corner, i) => {
    drawRing(pen, place(corner), "edge", 11);
    drawDot(pen, place(corner), "edge", pen.lit("abc"[i]) ? 8 : 6);
  });
  drawDot(pen, place(g), "u", 6);
  pen.label({ at: place(g), text: "g = a + v₃", symbol: "g" });
  drawRing(pen, place(f), "t", 14);
  drawDot(pen, place(f), "t", 8);
  pen.label({ at: place(f), text: `f(t): ${inside ? "inside" : "outside"}`, symbol: "f(t)" });
}

/** The function that maps a point to coordinates in the triangle's plane: along v₁ and perpendicular to v₁, from corner a. @param {Candidate} found */
export function planeCoordinates({ corners, edges, n }) {
  const x = edges[0].map((value) => value / (lengthOf(edges[0]) || 1));
  const across = cross(n, x);
  const y = across.map((value) => value / (lengthOf(across) || 1));
  return (/** @type {number[]} */ point) => [dot(x, minus(point, corners[0])), dot(y, minus(point, corners[0]))];
}

/** The function that maps points of the plane to positions in a figure, so that `points` fill the figure. @param {number[][]} points @param {{ width: number, height: number }} size @param {number} [margin] */
export function fitted(points, { width, height }, margin = 34) {
  const [low, high] = [Math.min, Math.max].map((pick) => [0, 1].map((i) => pick(...points.map((point) => point[i]))));
  const scale = Math.min((width - 2 * margin) / (high[0] - low[0] || 1), (height - 2 * margin) / (high[1] - low[1] || 1));
  return (/** @type {number[]} */ [x, y]) => [width / 2 + scale * (x - (low[0] + high[0]) / 2), height / 2 - scale * (y - (low[1] + high[1]) / 2)];
}
