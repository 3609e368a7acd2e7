// The figures of one pixel's explanation: the ray and the triangle from outside, and the crossings in the triangle's plane.

import { triangleSteps } from "../core/steps.js";
import { cross, dot, lengthOf, minus, plusTimes } from "../core/vectors.js";
import { drawCrossings, fitted, planeCoordinates } from "./crossings.js";
import { OutsideView } from "./outside.js";
import { outsidePanel } from "./panels.js";

/**
 * @typedef {object} FigureCamera
 * @property {number[]} up the world's
 * @property {number[]} size columns and rows of the image
 * @property {number[]} C start of the ray
 * @property {number[]} v the principal axis, a unit vector
 * @property {number[][]} rays start and direction, six numbers, of the image's corners: top left, top right, bottom right, bottom left
 * @property {boolean} isFlat true if straight lines stay straight in the image
 * @property {number[]} [region] column, row, columns and rows of the image's part that is shown; all of it if missing
 */
/**
 * @typedef {object} PixelSteps
 * @property {number[]} r
 * @property {number[] | null} triangle nine numbers
 * @property {ArrayLike<number>} corners of the triangles around the hit, nine numbers each
 * @property {number[][]} colors sRGB of each
 */
/** @typedef {FigureCamera & PixelSteps} PixelFigure */

const LONGEST = 4, PLANE_SHARE = 0.28, MIN_COSINE = 0.15;

/** The camera as figures draw it, at `eye` with its image plane at a distance; null if the rays of its corners are too oblique. @param {FigureCamera} camera @param {CanvasImageSource | null} picture @param {number[]} eye @param {number} distance */
export function rigOf({ C, v, size, rays, isFlat, region }, picture, eye, distance) {
  const place = (/** @type {number[]} */ start, /** @type {number[]} */ way) => plusTimes(plusTimes(eye, 1, minus(start, C)), distance / dot(way, v), way);
  if (!rays.every((ray) => dot(ray.slice(3), v) > MIN_COSINE * lengthOf(ray.slice(3)))) return null;
  return { C: eye, v, size, distance, corners: rays.map((ray) => place(ray.slice(0, 3), ray.slice(3))), picture: isFlat ? picture : null, region };
}

/** A view at a right angle to a direction, a little from above, that contains points. @param {number[]} along @param {number[]} up @param {number[][]} points */
export function viewBeside(along, up, points) {
  const side = cross(along, up);
  const p = up[0] ? [0, 1, 0] : [1, 0, 0];
  const azimuth = (Math.atan2(dot(side, cross(up, p)), dot(side, p)) * 180) / Math.PI;
  const center = points[0].map((_, i) => (Math.min(...points.map((at) => at[i])) + Math.max(...points.map((at) => at[i]))) / 2);
  const radius = 1.1 * Math.max(...points.map((at) => lengthOf(minus(at, center)))) || 1;
  return new OutsideView({ azimuth, elevation: 22, center, radius, up });
}

/** The fraction of the ray that is drawn, which is smaller for a small triangle. @param {PixelFigure} figure @param {import("../core/steps.js").Candidate | null} found */
function shareOf({ C }, found) {
  return found ? Math.min(1, (LONGEST * Math.max(...found.edges.map(lengthOf))) / (lengthOf(minus(found.f, C)) || 1)) : 1;
}

/** The triangle's steps; null without a triangle. @param {PixelFigure} figure */
export function stepsOfFigure({ triangle, C, r, v }) {
  return triangle && triangleSteps(triangle, 0, { C, r, forward: v });
}

/** The view and the content of the figure from outside. @param {PixelFigure} figure @param {CanvasImageSource | null} picture */
export function outsideOf(figure, picture) {
  const { C, r, v, up, corners, colors } = figure;
  const found = stepsOfFigure(figure);
  const end = found && Number.isFinite(found.t) ? found.f : plusTimes(C, 6 / lengthOf(r), r);
  const share = shareOf(figure, found);
  const eye = plusTimes(end, share, minus(C, end));
  const length = lengthOf(minus(end, eye)) || 1;
  const distance = PLANE_SHARE * length;
  const rig = rigOf(figure, picture, eye, distance);
  const strokes = [{ from: eye, to: end, color: "r", symbol: "r", text: "r", arrow: !found, width: 2.5 }];
  const spots = [{ at: eye, color: "C", symbol: "C", text: "C" }];
  if (rig) spots.push({ at: plusTimes(eye, distance / dot(r, v), r), color: "x", symbol: "x", text: "x" });
  if (found) {
    const toward = (Math.sign(-found.below) || 1) / (lengthOf(found.n) || 1);
    const longest = Math.max(...found.edges.map(lengthOf));
    strokes.push({ from: end, to: plusTimes(end, 0.5 * longest * toward, found.n), color: "n", symbol: "n", text: toward > 0 ? "n" : "−n", arrow: true, width: 2.5 });
    found.corners.forEach((at, k) => spots.push({ at, color: "a", symbol: "abc"[k], text: "abc"[k] }));
    spots.push({ at: end, color: "t", symbol: "f(t)", text: "f(t)" });
  }
  const view = viewBeside(minus(end, eye), up, [eye, end, ...(found ? found.corners : [])]);
  const patches = found ? [{ corners: found.corners, color: "inside", line: "edge" }] : [];
  return { view, share, content: { corners, colors, faded: 0.5, rig, strokes, spots, patches } };
}

/** The figures of a pixel. @param {PixelFigure} figure @param {CanvasImageSource | null} picture @returns {import("./panels.js").Panel[]} */
export function pixelPanels(figure, picture) {
  const { view, share, content } = outsideOf(figure, picture);
  const panels = [outsidePanel(`From outside${share < 1 ? "; the ray is drawn shorter, in its exact direction" : ""}`, "The camera, the ray and the triangle.", view, content)];
  const found = stepsOfFigure(figure);
  if (found && Number.isFinite(found.t)) {
    const flat = planeCoordinates(found);
    const { corners, f, g } = found;
    const crossings = `${found.crossings} ${found.crossings === 1 ? "crossing" : "crossings"}`;
    panels.push({
      title: `In the triangle's plane: ${crossings}, ${found.inside ? "inside" : "outside"}`,
      ratio: 0.6, label: `The triangle in its plane, and the walk from f(t) to g: ${crossings}`,
      draw: (pen) => {
        const fit = fitted([...corners, f, g].map(flat), pen);
        drawCrossings(pen, found, (point) => fit(flat(point)));
      },
    });
  }
  return panels;
}
