// The figure of a pixel: the ray and the triangle from outside, and the crossings in the triangle's plane.

import { cross, dot, lengthOf, minus, plusTimes } from "./vectors.js";

/** @typedef {import("./steps.js").Candidate} Candidate */
/** @typedef {{ kind: string, at: number[][], text?: string }} Mark a line, area, arrow or dot, in the plane of the page */
/** @typedef {{ kind: string, at: number[][], text: string, textAt: number[] }} Shape the same in units of the figure */
/**
 * @typedef {object} Asked
 * @property {(u: number, v: number) => { C: number[], r: number[] }} rayAt the ray of a place of the picture
 * @property {number[]} size
 * @property {number} offset
 * @property {number[]} up the world's
 * @property {import("./steps.js").Ray & { x: number[] }} ray
 * @property {Candidate | null} found
 */

const [WIDTH, HEIGHT, MARGIN] = [420, 250, 26];
const LONGEST = 4; // lengths of the triangle's longest edge that the ray is drawn long at most

/** @param {number[]} v */
const unit = (v) => v.map((value) => value / (lengthOf(v) || 1));

/**
 * Marks as shapes that fill a box of the figure.
 * @param {Mark[]} given
 * @param {number} top
 * @returns {Shape[]}
 */
function placed(given, top) {
  const marks = given.filter(({ at }) => at.flat().every((value) => Math.abs(value) < 1e30)); // what a page can draw
  const points = marks.flatMap(({ at }) => at);
  const low = [0, 1].map((i) => Math.min(...points.map((point) => point[i])));
  const high = [0, 1].map((i) => Math.max(...points.map((point) => point[i])));
  const scale = Math.min((WIDTH - 2 * MARGIN) / (high[0] - low[0] || 1), (HEIGHT - 2 * MARGIN - 10) / (high[1] - low[1] || 1));
  const place = (/** @type {number[]} */ [x, y]) => [
    WIDTH / 2 + scale * (x - (low[0] + high[0]) / 2),
    top + HEIGHT / 2 + 8 - scale * (y - (low[1] + high[1]) / 2),
  ];
  return marks.map(({ kind, at, text = "" }) => {
    const shape = at.map(place);
    const [[fromX, fromY], [x, y]] = [shape[0], shape[shape.length - 1]];
    const middle = kind.startsWith("dot") ? [x + 7, y - 6] : [(fromX + x) / 2 + 5, (fromY + y) / 2 - 4];
    return { kind, at: shape, text, textAt: [Math.min(middle[0], WIDTH - 9 * text.length), middle[1]] };
  });
}

/**
 * The drawn part of the ray's length: beside a small triangle it is shorter, and the camera with it.
 * @param {import("./steps.js").Ray} ray
 * @param {Candidate | null} found
 */
function shareOf(ray, found) {
  return found ? Math.min(1, (LONGEST * Math.max(...found.edges.map(lengthOf))) / lengthOf(minus(found.f, ray.C))) : 1;
}

/** The scene from the side of the ray. @param {Asked} asked @returns {Mark[]} */
function fromOutside({ rayAt, size, offset, up, ray, found }) {
  const end = found ? found.f : plusTimes(ray.C, 6 / lengthOf(ray.r), ray.r);
  const along = unit(minus(end, ray.C));
  const side = unit(cross(along, up).some((value) => Math.abs(value) > 1e-6) ? cross(along, up) : [1, 0, 0]);
  const above = cross(side, along);
  const page = (/** @type {number[]} */ point) => {
    const [x, y, z] = [along, above, side].map((axis) => dot(minus(point, end), axis));
    return [x + 0.35 * z, y - 0.28 * z];
  };
  const share = shareOf(ray, found);
  const eye = (/** @type {number[]} */ C) => plusTimes(end, share, minus(C, end));
  const start = eye(ray.C);
  const far = 0.28 * lengthOf(minus(end, start)); // where the image plane is drawn
  const onPlane = (/** @type {number} */ u, /** @type {number} */ v) => {
    const { C, r } = rayAt(u, v);
    return plusTimes(eye(C), far / dot(r, ray.forward), r);
  };
  const [right, bottom] = size.map((extent) => extent - 1 + offset);
  const corners = /** @type {[number, number][]} */ ([[offset, offset], [right, offset], [right, bottom], [offset, bottom]]);
  const frame = corners.map(([u, v]) => onPlane(u, v));
  /** @type {Mark[]} */
  const marks = [
    ...frame.map((corner, i) => ({ kind: "line camera", at: [eye(rayAt(...corners[i]).C), corner].map(page) })),
    { kind: "area image", at: frame.map(page) },
    { kind: "arrow camera", at: [start, plusTimes(start, 1.5 * far, ray.forward)].map(page), text: "v" },
  ];
  if (found) marks.push({ kind: "area triangle", at: found.corners.map(page) });
  marks.push({ kind: found ? "line ray" : "arrow ray", at: [start, end].map(page), text: "r" });
  if (found) {
    const longest = Math.max(...found.edges.map(lengthOf));
    const towards = Math.sign(-found.below) || 1; // drawn on the camera's side
    marks.push({ kind: "arrow normal", at: [end, plusTimes(end, 0.5 * longest * towards, unit(found.n))].map(page), text: towards > 0 ? "n" : "-n" });
    found.corners.forEach((corner, i) => marks.push({ kind: "dot corner", at: [page(corner)], text: "abc"[i] }));
    marks.push({ kind: "dot hit", at: [page(end)], text: "f(t)" });
  }
  marks.push({ kind: "dot pixel", at: [page(onPlane(ray.x[0], ray.x[1]))], text: "x" }, { kind: "dot camera", at: [page(start)], text: "C" });
  return marks;
}

/** The triangle as it lies in its plane, and the walk from f(t) to g. @param {Candidate} found @returns {Mark[]} */
function inPlane({ corners, edges, n, f, g, crossed, alongEdge }) {
  const [x, y] = [unit(edges[0]), unit(cross(n, edges[0]))];
  const page = (/** @type {number[]} */ point) => [x, y].map((axis) => dot(minus(point, corners[0]), axis));
  return [
    { kind: "area triangle", at: corners.map(page) },
    ...edges.map((edge, i) => ({ kind: "arrow edge", at: [corners[i], plusTimes(corners[i], 1, edge)].map(page), text: `v${i + 1}` })),
    { kind: "line faint", at: [corners[0], g].map(page) },
    { kind: "arrow walk", at: [f, g].map(page), text: "u" },
    ...corners.map((corner, i) => ({ kind: "dot corner", at: [page(corner)], text: "abc"[i] })),
    { kind: "dot hit", at: [page(f)], text: "f(t)" },
    { kind: "dot corner", at: [page(g)], text: "g" },
    ...edges.flatMap((edge, i) => (crossed[i] ? [{ kind: "dot crossing", at: [page(plusTimes(corners[i], alongEdge[i], edge))] }] : [])),
  ];
}

/**
 * Size, shapes and description of the figure of a pixel; titles are shapes of the kind "title".
 * @param {Asked} asked
 */
export function figureOf(asked) {
  const { found } = asked;
  const title = (/** @type {string} */ text, /** @type {number} */ y) => ({ kind: "title", at: [], text, textAt: [8, y] });
  const shorter = shareOf(asked.ray, found) < 1 ? ": the ray is drawn shorter, directions are true" : "";
  const shapes = [title(`From outside${shorter}`, 16), ...placed(fromOutside(asked), 0)];
  if (found) {
    const told = `In the triangle's plane: ${found.crossings} ${found.crossings === 1 ? "crossing" : "crossings"}, ${found.inside ? "inside" : "outside"}`;
    shapes.push(title(told, HEIGHT + 16), ...placed(inPlane(found), HEIGHT));
  }
  const label = found ? `The ray, the triangle and its plane; ${found.crossings} crossings` : "The ray, which meets no triangle's plane";
  return { width: WIDTH, height: found ? 2 * HEIGHT : HEIGHT, shapes, label };
}
