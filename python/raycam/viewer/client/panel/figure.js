// The figure of a pixel: the ray and the triangle from outside, and the crossings in the triangle's plane.

import { dot, lengthOf, minus, plusTimes } from "../core/navigation.js";
import { cross, rayOfPixel } from "../core/steps.js";

/** @typedef {import("../core/steps.js").Candidate} Candidate */
/** @typedef {import("../core/steps.js").PixelRay} PixelRay */
/** @typedef {{ kind: string, at: number[][], text?: string }} Mark a line, polygon, arrow or dot, in the plane of the page */

const [WIDTH, HEIGHT, MARGIN] = [420, 250, 26];

/**
 * A new SVG element.
 * @param {string} tag
 * @param {Record<string, string | number>} attributes
 * @param {string} [text]
 */
export function svgElement(tag, attributes, text = "") {
  const made = /** @type {SVGElement} */ (document.createElementNS(document.getElementById("figure")?.namespaceURI || null, tag));
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, String(value));
  if (text) made.textContent = text;
  return made;
}

/** @param {number[]} v */
const unit = (v) => v.map((value) => value / (lengthOf(v) || 1));

/**
 * Draws marks so that they fill a box of the figure.
 * @param {Mark[]} given
 * @param {number} top
 */
function drawn(given, top) {
  const marks = given.filter(({ at }) => at.flat().every((value) => Math.abs(value) < 1e30)); // what a page can draw
  const points = marks.flatMap(({ at }) => at);
  const low = [0, 1].map((i) => Math.min(...points.map((point) => point[i])));
  const high = [0, 1].map((i) => Math.max(...points.map((point) => point[i])));
  const scale = Math.min((WIDTH - 2 * MARGIN) / (high[0] - low[0] || 1), (HEIGHT - 2 * MARGIN - 10) / (high[1] - low[1] || 1));
  const place = (/** @type {number[]} */ [x, y]) => [
    WIDTH / 2 + scale * (x - (low[0] + high[0]) / 2),
    top + HEIGHT / 2 + 8 - scale * (y - (low[1] + high[1]) / 2),
  ];
  return marks.flatMap(({ kind, at, text }) => {
    const placed = at.map(place);
    const list = placed.map((point) => point.map((value) => value.toFixed(2)).join(",")).join(" ");
    const [x, y] = placed[placed.length - 1];
    const shape =
      kind.startsWith("dot") ? svgElement("circle", { cx: x, cy: y, r: 4, class: kind })
      : svgElement(kind.startsWith("area") ? "polygon" : "polyline", { points: list, class: kind, ...(kind.startsWith("arrow") ? { "marker-end": "url(#head)" } : {}) });
    if (!text) return [shape];
    const [from] = placed;
    const middle = kind.startsWith("dot") ? [x + 7, y - 6] : [(from[0] + x) / 2 + 5, (from[1] + y) / 2 - 4];
    return [shape, svgElement("text", { x: Math.min(middle[0], WIDTH - 9 * text.length).toFixed(1), y: middle[1].toFixed(1) }, text)];
  });
}

/** The scene from the side of the ray. @param {number[]} P @param {number[]} size @param {number} offset @param {PixelRay} ray @param {Candidate | null} found */
function fromOutside(P, size, offset, ray, found) {
  const end = found ? found.f : plusTimes(ray.C, 6 / lengthOf(ray.r), ray.r);
  const along = unit(minus(end, ray.C));
  const side = unit(cross(along, [0, 0, 1]).some((value) => Math.abs(value) > 1e-6) ? cross(along, [0, 0, 1]) : [1, 0, 0]);
  const up = cross(side, along);
  const page = (/** @type {number[]} */ point) => {
    const [x, y, z] = [along, up, side].map((axis) => dot(minus(point, ray.C), axis));
    return [x + 0.35 * z, y - 0.28 * z];
  };
  const far = 0.28 * lengthOf(minus(end, ray.C)); // where the image plane is drawn
  const onPlane = (/** @type {number} */ u, /** @type {number} */ v) => {
    const { r, forward } = rayOfPixel(P, u, v);
    return plusTimes(ray.C, far / dot(r, forward), r);
  };
  const [right, bottom] = size.map((side_) => side_ - 1 + offset);
  const frame = [[offset, offset], [right, offset], [right, bottom], [offset, bottom]].map(([u, v]) => onPlane(u, v));
  /** @type {Mark[]} */
  const marks = [
    ...frame.map((corner) => ({ kind: "line camera", at: [ray.C, corner].map(page) })),
    { kind: "area image", at: frame.map(page) },
    { kind: "arrow camera", at: [ray.C, plusTimes(ray.C, 1.5 * far, ray.forward)].map(page), text: "v" },
  ];
  if (found) marks.push({ kind: "area triangle", at: found.corners.map(page) });
  marks.push({ kind: found ? "line ray" : "arrow ray", at: [ray.C, end].map(page), text: "r" });
  if (found) {
    const size_ = Math.max(...found.edges.map(lengthOf));
    const towards = Math.sign(-found.below) || 1; // drawn on the camera's side
    marks.push({ kind: "arrow normal", at: [end, plusTimes(end, 0.5 * size_ * towards, unit(found.n))].map(page), text: towards > 0 ? "n" : "-n" });
    found.corners.forEach((corner, i) => marks.push({ kind: "dot corner", at: [page(corner)], text: "abc"[i] }));
    marks.push({ kind: "dot hit", at: [page(end)], text: "f(t)" });
  }
  marks.push({ kind: "dot pixel", at: [page(onPlane(ray.x[0], ray.x[1]))], text: "x" }, { kind: "dot camera", at: [page(ray.C)], text: "C" });
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
 * Fills an SVG element with the figure of a pixel.
 * @param {SVGElement} svg
 * @param {{ P: number[], size: number[], offset: number, ray: PixelRay, found: Candidate | null }} shown
 */
export function showFigure(svg, { P, size, offset, ray, found }) {
  const head = svgElement("marker", { id: "head", viewBox: "0 0 8 8", refX: 7, refY: 4, markerWidth: 7, markerHeight: 7, orient: "auto-start-reverse" });
  head.append(svgElement("path", { d: "M0,0 L8,4 L0,8 z", fill: "context-stroke" }));
  const parts = [head, svgElement("text", { x: 8, y: 16, class: "title" }, "From outside"), ...drawn(fromOutside(P, size, offset, ray, found), 0)];
  if (found) {
    const told = `In the triangle's plane: ${found.crossings} ${found.crossings === 1 ? "crossing" : "crossings"}, ${found.inside ? "inside" : "outside"}`;
    parts.push(svgElement("text", { x: 8, y: HEIGHT + 16, class: "title" }, told), ...drawn(inPlane(found), HEIGHT));
  }
  svg.setAttribute("viewBox", `0 0 ${WIDTH} ${found ? 2 * HEIGHT : HEIGHT}`);
  svg.setAttribute("aria-label", found ? `The ray, the triangle and its plane; ${found.crossings} crossings` : "The ray, which meets no triangle's plane");
  svg.replaceChildren(...parts);
}
