// The steps of the lecture for one pixel, in float64: the numbers of raycam.explain, computed with the same formulas.
// Source: Nicholas Dwork, Making Virtual Worlds (Computer Graphics Lecture 1).

import { apply, cross, dot, lengthOf, minus, plusTimes, product, rowOf } from "./vectors.js";

const ROUNDING = 2 ** -47; // relative error up to which a value counts as 0

/**
 * @typedef {object} Candidate one triangle and the ray
 * @property {number} index in the list of triangles
 * @property {number[][]} corners a, b, c
 * @property {number[]} n
 * @property {number} above n·(a - C)
 * @property {number} below n·r
 * @property {number} t
 * @property {number[]} f
 * @property {number[][]} edges v1, v2, v3
 * @property {number[]} g
 * @property {number[]} u
 * @property {number[]} alongU
 * @property {number[]} alongEdge
 * @property {boolean[]} crossed
 * @property {boolean[]} onEdge
 * @property {number} crossings
 * @property {boolean} inside
 */

const near = (/** @type {number} */ value, /** @type {number} */ scale) => Math.abs(value) <= ROUNDING * scale;

/** @param {number[]} m row by row */
export const determinant = (m) => dot(rowOf(m, 0), cross(rowOf(m, 1), rowOf(m, 2)));

/** The solution of m x = y by Cramer's rule. @param {number[]} m @param {number[]} y */
function solved(m, y) {
  const [a, b, c] = [0, 1, 2].map((j) => [m[j], m[3 + j], m[6 + j]]);
  const all = dot(a, cross(b, c));
  return [dot(y, cross(b, c)) / all, dot(a, cross(y, c)) / all, dot(a, cross(b, y)) / all];
}

/**
 * Steps 1 and 2: the ray of the pixel whose centre is (u, v), and the intermediate results.
 * @param {number[]} P row by row
 * @param {number} u
 * @param {number} v
 */
export function rayOfPixel(P, u, v) {
  const x = [u, v, 1];
  const M = [0, 1, 2].flatMap((i) => P.slice(4 * i, 4 * i + 3));
  // Rows of equal length lose fewer digits: (D P)⁺ D x = P⁺ x.
  const rows = [0, 1, 2].map((i) => P.slice(4 * i, 4 * i + 4));
  const scales = rows.map((row) => 1 / Math.hypot(...row));
  const scaled = rows.map((row, i) => row.map((value) => value * scales[i]));
  const gram = scaled.flatMap((a) => scaled.map((b) => a.reduce((sum, value, k) => sum + value * b[k], 0)));
  const weights = solved(gram, x.map((value, i) => value * scales[i]));
  const X = [0, 1, 2, 3].map((k) => scaled.reduce((sum, row, i) => sum + row[k] * weights[i], 0));
  const lengths = [0, 1, 2].map((i) => lengthOf(rowOf(M, i)));
  const C = solved(M.map((value, i) => value / lengths[Math.floor(i / 3)]), [0, 1, 2].map((i) => -P[4 * i + 3] / lengths[i]));
  const atInfinity = near(X[3], Math.hypot(...X));
  const XPrime = atInfinity ? null : X.slice(0, 3).map((value) => value / X[3]);
  const line = XPrime ? minus(XPrime, C) : X.slice(0, 3);
  const sign = Math.sign(determinant(M));
  const forward = rowOf(M, 2).map((value) => (sign * value) / lengths[2]);
  const along = dot(forward, line);
  return { x, M, X, XPrime, C, line, forward, along, detM: determinant(M), r: along > 0 ? line : line.map((value) => -value) };
}

/** @typedef {ReturnType<typeof rayOfPixel>} PixelRay */

/**
 * @typedef {object} LensRay the core's data about a camera and a pixel
 * @property {string} model of the lens; "parallel" for parallel rays
 * @property {number[]} coefficients
 * @property {number[]} origin
 * @property {number[]} direction of unit length
 * @property {number[]} R row by row, at the moment of the pixel's line
 * @property {number[]} back the pixel to which the camera projects a point of the ray
 * @property {string[]} further names of the camera's other properties
 */

/**
 * The camera matrix of a pinhole at the moment of a pixel's line, row by row.
 * @param {number[]} K row by row
 * @param {LensRay} ray
 */
export function matrixAt(K, { R, origin }) {
  const M = product(K, R);
  return [0, 1, 2].flatMap((i) => [...rowOf(M, i), -dot(rowOf(M, i), origin)]);
}

/**
 * Steps 1 and 2 of a pixel that no camera matrix describes.
 * @param {number[]} K row by row
 * @param {number} u
 * @param {number} v
 * @param {LensRay} lens
 */
export function rayThroughLens(K, u, v, lens) {
  const imagePoint = solved(K, [u, v, 1]).slice(0, 2);
  const inCamera = apply(lens.R, lens.direction);
  const undistorted = inCamera[2] > 0 ? inCamera.slice(0, 2).map((value) => value / inCamera[2]) : null;
  return { x: [u, v, 1], C: lens.origin, r: lens.direction, forward: rowOf(lens.R, 2), imagePoint, undistorted, inCamera, lens };
}

/** @typedef {ReturnType<typeof rayThroughLens>} BentRay */
/** @typedef {{ C: number[], r: number[], forward: number[] }} Ray */

/**
 * Steps 3 and 4 for one triangle: its plane, and inside or outside.
 * @param {ArrayLike<number>} corners nine numbers for each triangle
 * @param {number} index
 * @param {Ray} ray
 * @returns {Candidate}
 */
export function triangleSteps(corners, index, { C, r }) {
  const points = [0, 3, 6].map((k) => [0, 1, 2].map((i) => corners[9 * index + k + i]));
  const [a, b, c] = points;
  const edges = [minus(b, a), minus(c, b), minus(a, c)];
  const [v1, toC] = [edges[0], minus(c, a)];
  let n = cross(toC, v1);
  if (lengthOf(n) <= ROUNDING * lengthOf(v1) * lengthOf(toC)) n = [0, 0, 0];
  const [above, below] = [dot(n, minus(a, C)), dot(n, r)];
  const t = near(below, lengthOf(r) * lengthOf(n)) ? NaN : above / below;
  const f = plusTimes(C, t, r);
  const g = plusTimes(a, 1, edges[2]);
  const u = minus(g, f);
  const left = cross(n, u);
  const starts = points.map((point) => minus(point, f));
  const side = starts.map((start) => dot(left, start));
  const size = Math.max(...points.flat().map(Math.abs)) + Math.max(...C.map(Math.abs)) + Math.max(...f.map(Math.abs));
  const cosine = Math.abs(below) / ((lengthOf(n) || 1) * lengthOf(r));
  const tolerance = (ROUNDING * size) / (cosine || 1);
  const alongEdge = side.map((at, i) => (at === side[(i + 1) % 3] ? NaN : at / (at - side[(i + 1) % 3])));
  const alongU = alongEdge.map((q, i) => dot(plusTimes(starts[i], q, edges[i]), u) / (dot(u, u) || 1));
  const crossed = alongU.map((s, i) => side[i] > 0 !== side[(i + 1) % 3] > 0 && s >= 0 && s <= 1);
  const onEdge = edges.map((edge, i) => {
    const length = lengthOf(edge);
    const beside = Math.abs(dot(cross(n, edge), starts[i])) / ((length || 1) * (lengthOf(n) || 1));
    const along = -dot(starts[i], edge) / (length || 1);
    return beside <= tolerance && along >= -tolerance && along <= length + tolerance;
  });
  const crossings = crossed.filter(Boolean).length;
  const inside = t >= 0 && (crossings % 2 === 1 || onEdge.some(Boolean));
  return { index, corners: points, n, above, below, t, f, edges, g, u, alongU, alongEdge, crossed, onEdge, crossings, inside };
}

/**
 * Steps 3 and 4: how many triangles each test excludes, the nearest hits, the narrowest misses, and the closest hit.
 * @param {Ray} ray
 * @param {ArrayLike<number>} corners
 */
export function stepsOf(ray, corners) {
  const counts = { withoutArea: 0, parallel: 0, behind: 0, outside: 0, inside: 0 };
  /** @type {Candidate[]} */
  let hits = [];
  /** @type {[number, Candidate][]} */
  let misses = [];
  for (let index = 0; index < corners.length / 9; index++) {
    const found = triangleSteps(corners, index, ray);
    if (!found.n.some((value) => value !== 0)) counts.withoutArea++;
    else if (Number.isNaN(found.t)) counts.parallel++;
    else if (found.t < 0) counts.behind++;
    else if (found.inside) {
      counts.inside++;
      hits = [...hits, found].sort((p, q) => p.t - q.t || p.index - q.index).slice(0, 3);
    } else {
      counts.outside++;
      misses = [...misses, /** @type {[number, Candidate]} */ ([missOf(found), found])].sort((p, q) => p[0] - q[0]).slice(0, 2);
    }
  }
  const shown = [...hits, ...misses.slice(0, hits.length ? 1 : 2).map(([, found]) => found)];
  shown.sort((p, q) => p.t - q.t || p.index - q.index);
  return { counts, triangles: corners.length / 9, candidates: shown, winner: hits[0] || null };
}

/** The distance of f from the middle of a triangle, in sizes of the triangle. @param {Candidate} found */
function missOf({ corners: [a, b, c], f }) {
  const middle = a.map((value, i) => (value + b[i] + c[i]) / 3);
  return lengthOf(minus(f, middle)) / Math.max(...[a, b, c].map((corner) => lengthOf(minus(corner, middle))));
}

/** Depth along the principal axis and distance from C to the hit. @param {Ray} ray @param {number} t */
export function rangesOf({ r, forward }, t) {
  return { distance: t * lengthOf(r), depth: t * dot(r, forward) };
}

/** The pixel coordinates of a point's projection. @param {number[]} P @param {number[]} point */
export function pixelOf(P, point) {
  const M = [0, 1, 2].flatMap((i) => P.slice(4 * i, 4 * i + 3));
  const [x, y, z] = apply(M, point).map((value, i) => value + P[4 * i + 3]);
  return { u: x / z, v: y / z, inFront: z * Math.sign(determinant(M)) > 0 };
}
