// Chapters 19 to 21: the floor's homography, calibration from points, and exactness.

import { dot, lengthOf, minus, plusTimes } from "../core/vectors.js";
import { pixelOf, triangleSteps } from "../core/steps.js";
import { randomOf } from "./chapter_paths.js";
import { addMatrices } from "./matrices.js";
import { fixed, tuple } from "../figure/numbers.js";
import { drawDot, drawLine } from "../figure/shapes.js";
import { addPicture } from "./picture_view.js";

/** @typedef {import("./figure.js").Figure} Figure */

/** The solution of a square system, by elimination with row exchanges. @param {number[][]} rows with the right side as last number */
export function solveSystem(rows) {
  const m = rows.map((row) => [...row]);
  const size = m.length;
  for (let i = 0; i < size; i++) {
    const pivot = m.slice(i).reduce((best, row, k) => (Math.abs(row[i]) > Math.abs(m[best][i]) ? i + k : best), i);
    [m[i], m[pivot]] = [m[pivot], m[i]];
    for (let k = i + 1; k < size; k++) {
      const factor = m[k][i] / m[i][i];
      for (let j = i; j <= size; j++) m[k][j] -= factor * m[i][j];
    }
  }
  const x = new Array(size).fill(0);
  for (let i = size - 1; i >= 0; i--) x[i] = (m[i][size] - x.reduce((sum, value, j) => (j > i ? sum + m[i][j] * value : sum), 0)) / m[i][i];
  return x;
}

/** P from points and their pixels, with P34 = 1, by linear least squares (the direct linear transform). @param {number[][]} points @param {number[][]} pixels */
export function calibrate(points, pixels) {
  const scale = 1 / 300;
  const rows = points.flatMap(([x, y, z], i) => {
    const [u, v] = pixels[i].map((value) => value * scale);
    return [[x, y, z, 1, 0, 0, 0, 0, -u * x, -u * y, -u * z, u], [0, 0, 0, 0, x, y, z, 1, -v * x, -v * y, -v * z, v]];
  });
  const normal = Array.from({ length: 11 }, (_, i) => Array.from({ length: 12 }, (__, j) => rows.reduce((sum, row) => sum + row[i] * row[j], 0)));
  const p = [...solveSystem(normal), 1];
  return p.map((value, i) => (i < 8 ? value / scale : value));
}

/** Calibrates the camera from the corners in its image. @param {Figure} fig */
export function buildCalibration(fig) {
  const { shared } = fig;
  let noise = 1;
  const points = () => cornerPoints(shared.corners);
  const measured = () => {
    const random = randomOf(5);
    return points().map((point) => {
      const { u, v } = pixelOf(shared.camera.P, point);
      return [u + noise * (2 * random() - 1), v + noise * (2 * random() - 1)];
    });
  };
  addPicture(fig, {
    overlay: (pen, place) => {
      const P = calibrate(points(), measured());
      measured().forEach(([u, v], i) => {
        const back = pixelOf(P, points()[i]);
        drawDot(pen, place(u, v), "white", 5);
        drawDot(pen, place(back.u, back.v), "r", 3);
      });
    },
  });
  fig.slider({ name: "noise", min: 0, max: 6, step: 0.1, digits: 1, unit: " px", get: () => noise, set: (value) => { noise = value; } });
  addMatrices(fig, [
    { symbol: "P", title: "P / P₃₄", columns: 4, get: () => shared.camera.P.map((value) => value / shared.camera.P[11]) },
    { symbol: "r", title: "calibrated", columns: 4, get: () => calibrate(points(), measured()) },
  ]);
  fig.readout(() => {
    const P = calibrate(points(), measured());
    const squares = measured().map(([u, v], i) => {
      const back = pixelOf(P, points()[i]);
      return (u - back.u) ** 2 + (v - back.v) ** 2;
    });
    return [[`${squares.length} points, 11 unknowns; root mean square error ${fixed(Math.sqrt(squares.reduce((a, b) => a + b, 0) / squares.length), 3)} pixels`]];
  });
}

/** The distinct corners of the box and the free triangles. @param {number[]} corners */
export function cornerPoints(corners) {
  /** @type {number[][]} */
  const points = [];
  for (let i = 18; i < corners.length; i += 3) {
    const point = corners.slice(i, i + 3);
    if (!points.some((other) => lengthOf(minus(point, other)) < 1e-9)) points.push(point);
  }
  return points;
}

/** The places where rays at the shared edge of two triangles hit neither triangle, in float32 and in exact arithmetic. @param {number} turn degrees @param {number} count */
export function edgeLeaks(turn, count) {
  const angle = (turn * Math.PI) / 180;
  const spot = (/** @type {number} */ a, /** @type {number} */ radius) => [radius * Math.cos(a + angle), radius * Math.sin(a + angle), 0.3 * Math.cos(a)];
  const [p, q, left, right] = [spot(0, 1), spot(Math.PI, 1), spot(1.6, 0.9), spot(-1.4, 0.8)];
  const C = [0.1, 0.2, 3];
  return Array.from({ length: count }, (_, i) => {
    const at = plusTimes(p, (i + 0.5) / count, minus(q, p));
    const r = minus(at, C);
    const single = singleHit([p, q, left], C, r) || singleHit([q, p, right], C, r);
    const exact = [[p, q, left], [q, p, right]].some((corners) => triangleSteps(corners.flat(), 0, { C, r, forward: r }).inside);
    return { at, single, exact };
  });
}

/** The test of Möller and Trumbore (1997), rounded to float32 after each operation. @param {number[][]} corners @param {number[]} C @param {number[]} r */
function singleHit([a, b, c], C, r) {
  const f = Math.fround;
  const sub = (/** @type {number[]} */ x, /** @type {number[]} */ y) => x.map((value, i) => f(f(value) - f(y[i])));
  const times = (/** @type {number[]} */ x, /** @type {number[]} */ y) => [1, 2, 0].map((i) => f(f(f(x[i]) * f(y[(i + 1) % 3])) - f(f(x[(i + 1) % 3]) * f(y[i]))));
  const inner = (/** @type {number[]} */ x, /** @type {number[]} */ y) => f(f(f(f(x[0]) * f(y[0])) + f(f(x[1]) * f(y[1]))) + f(f(x[2]) * f(y[2])));
  const [e1, e2, s] = [sub(b, a), sub(c, a), sub(C, a)];
  const h = times(r, e2);
  const determinant = inner(e1, h);
  const u = f(inner(s, h) / determinant);
  const q = times(s, e1);
  const v = f(inner(r, q) / determinant);
  return u >= 0 && v >= 0 && f(u + v) <= 1;
}

/** Rays that pass between two triangles along their shared edge, in float32. @param {Figure} fig */
export function buildExact(fig) {
  let turn = 62;
  const COUNT = 400;
  fig.canvas({
    ratio: 0.5, label: "Rays along the shared edge of two triangles; red dots are rays that meet neither in float32",
    draw: (pen) => {
      const leaks = edgeLeaks(turn, COUNT);
      const scale = Math.min(pen.width / 2.4, pen.height / 2.1);
      const place = (/** @type {number[]} */ [x, y]) => [pen.width / 2 + scale * x, pen.height / 2 - scale * y];
      const angle = (turn * Math.PI) / 180;
      const spot = (/** @type {number} */ a, /** @type {number} */ radius) => place([radius * Math.cos(a + angle), radius * Math.sin(a + angle)]);
      drawLine(pen, [spot(0, 1), spot(Math.PI, 1), spot(1.6, 0.9)], { color: "edge", fill: "inside", close: true });
      drawLine(pen, [spot(0, 1), spot(Math.PI, 1), spot(-1.4, 0.8)], { color: "edge", fill: "plane", close: true });
      for (const { at, single } of leaks) if (!single) drawDot(pen, place(at), "r", 3.5);
    },
  });
  fig.slider({ name: "turn", min: 0, max: 360, step: 1, digits: 0, unit: "°", get: () => turn, set: (value) => { turn = value; } });
  fig.readout(() => {
    const leaks = edgeLeaks(turn, COUNT);
    return [[["r", `float32: ${leaks.filter(({ single }) => !single).length} of ${COUNT} rays leak through the edge`], `    with raycam's two rules: ${leaks.filter(({ exact }) => !exact).length}`]];
  });
}

/** The image P (e, 0) of a direction's point at infinity, homogeneous. @param {number[]} P @param {number[]} direction */
const farPoint = (P, direction) => [0, 1, 2].map((i) => dot(P.slice(4 * i, 4 * i + 3), direction));

/** The vanishing point of parallel lines with a direction, as a pixel. @param {number[]} P @param {number[]} direction */
export function vanishingPoint(P, direction) {
  const [x, y, z] = farPoint(P, direction);
  return [x / z, y / z];
}

/** The point (X, Y) of the floor at a pixel, by the inverse of the homography H: the columns 1, 2 and 4 of P. @param {number[]} P @param {number[]} pixel */
export function floorPoint(P, [u, v]) {
  const rows = [0, 1, 2].map((i) => [P[4 * i], P[4 * i + 1], P[4 * i + 3], [u, v, 1][i]]);
  const [x, y, w] = solveSystem(rows);
  return [x / w, y / w];
}

/** Parallel lines of the floor, their vanishing point, and the floor's homography. @param {Figure} fig */
export function buildFloor(fig) {
  const { shared } = fig;
  let angle = 105;
  const direction = () => [Math.cos((angle * Math.PI) / 180), Math.sin((angle * Math.PI) / 180), 0];
  addPicture(fig, {
    overlay: (pen, place) => {
      const { P } = shared.camera;
      const d = direction();
      const [u, v] = vanishingPoint(P, d);
      for (let k = -3; k <= 3; k++) {
        const middle = [-d[1] * k, d[0] * k, 0];
        const seen = Array.from({ length: 29 }, (_, i) => pixelOf(P, plusTimes(middle, (i - 14) / 4, d))).filter(({ inFront }) => inFront).map((each) => place(each.u, each.v));
        if (seen.length < 2) continue;
        drawLine(pen, seen, { color: "#d32f2f", width: 2 });
        drawLine(pen, [seen[seen.length - 1], place(u, v)], { color: "#ff8a80", width: 1, dash: [4, 4] });
      }
      drawDot(pen, place(u, v), "r", 6);
      pen.label({ at: place(u, v), text: "vanishing point", color: pen.color("r") });
    },
  });
  fig.slider({ name: "direction", symbol: "r", min: 80, max: 155, step: 1, digits: 0, unit: "°", get: () => angle, set: (value) => { angle = value; } });
  fig.readout(() => {
    const far = farPoint(shared.camera.P, direction());
    const [u, v] = vanishingPoint(shared.camera.P, direction());
    const [x, y] = floorPoint(shared.camera.P, shared.numbers.pixel);
    return [[["P", `P (e, 0) = ${tuple(far, 4)}`]], [`divided by its third number: vanishing point (${fixed(u, 1)}, ${fixed(v, 1)})`], [["x", `pixel (${shared.numbers.pixel.join(", ")})`], ` is the point (${fixed(x, 3)}, ${fixed(y, 3)}) of the floor`]];
  });
}
