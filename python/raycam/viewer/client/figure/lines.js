// The figures of a pixel's light and of its search tree: lines through the world, drawn over the image and in a
// view from outside.

import { lengthOf, minus } from "../core/vectors.js";
import { outsidePanel } from "./panels.js";
import { rigOf, viewBeside } from "./pixel.js";
import { drawDot, drawLine } from "./shapes.js";

/**
 * @typedef {object} FigureLine
 * @property {string} name next to its end; empty for none
 * @property {string} color a symbol
 * @property {number} width
 * @property {boolean} dashed
 * @property {boolean} arrow true if it has a direction
 * @property {number[][]} points
 * @property {number[][][]} pixels its visible parts in the image, which a lens may bend
 */
/**
 * @typedef {object} Lines
 * @property {FigureLine[]} lines
 * @property {{ text: string, at: number[], pixel: number[] | null }[]} marks
 * @property {number[]} end of the ray
 * @property {ArrayLike<number>} corners of the triangles around the ray, nine numbers each
 * @property {number[][]} colors sRGB of each
 */
/** @typedef {import("./pixel.js").FigureCamera & Lines} LinesFigure */

const DISTANCE_SHARE = 0.2, VEIL = 0.62, HALO = 2.5, DASH = [6, 5];

/** The view and the content of the figure from outside. @param {LinesFigure} figure @param {CanvasImageSource | null} picture */
export function outsideOfLines(figure, picture) {
  const { C, up, end, lines, marks, corners, colors } = figure;
  const length = lengthOf(minus(end, C)) || 1;
  const near = lines.flatMap((line) => line.points).filter((point) => lengthOf(minus(point, end)) < length);
  const rig = rigOf(figure, picture, C, DISTANCE_SHARE * length);
  const strokes = lines.flatMap(({ name, color, width, dashed, arrow, points: [start, ...rest] }) => rest.map((to, i) => ({
    from: i ? rest[i - 1] : start, to, color, symbol: color, text: i === rest.length - 1 ? name : "", width, dash: dashed ? DASH : undefined, arrow,
  })));
  const spots = [{ at: C, color: "C", symbol: "C", text: "C" }, ...marks.map(({ at, text }) => ({ at, color: "t", symbol: "t", text }))];
  return { view: viewBeside(minus(end, C), up, [C, end, ...near]), content: { corners, colors, faded: 0.45, rig, strokes, spots } };
}

/** Draws a paler copy of the image, and the lines over it. @param {import("./board.js").Pen} pen @param {LinesFigure} figure @param {CanvasImageSource | null} picture */
function drawOverPicture(pen, { size, region = [0, 0, ...size], lines, marks }, picture) {
  const { ctx } = pen;
  const scale = pen.width / region[2];
  const place = (/** @type {number[]} */ [u, v]) => [scale * (u - region[0]), scale * (v - region[1])];
  if (picture) {
    ctx.globalAlpha = VEIL;
    ctx.drawImage(picture, 0, 0, pen.width, pen.height);
    ctx.globalAlpha = 1;
  }
  for (const isHalo of [true, false]) {
    for (const { color, width, dashed, pixels } of lines) {
      const thick = pen.lit(color) ? width + 2 : width;
      for (const part of pixels) drawLine(pen, part.map(place), { color: isHalo ? "ground" : color, width: isHalo ? thick + HALO : thick, dash: dashed && !isHalo ? DASH : [] });
    }
  }
  for (const { name, color, pixels } of lines) {
    for (const part of pixels) pen.touch(color, part.map(place));
    const last = pixels.at(-1)?.at(-1);
    if (name && last) pen.label({ at: place(last), text: name, symbol: color });
  }
  for (const { text, pixel } of marks) {
    if (!pixel) continue;
    drawDot(pen, place(pixel), "t", 5);
    pen.label({ at: place(pixel), text, symbol: "t" });
  }
}

/** The figures of lines. @param {LinesFigure} figure @param {CanvasImageSource | null} picture @returns {import("./panels.js").Panel[]} */
export function linesPanels(figure, picture) {
  const { size, region = [0, 0, ...size] } = figure;
  const { view, content } = outsideOfLines(figure, picture);
  return [
    outsidePanel("From outside", "The camera and the lines in the world.", view, content),
    { title: "In the image", ratio: region[3] / region[2], label: "The image with the same lines.", draw: (pen) => drawOverPicture(pen, figure, picture) },
  ];
}
