// The world from outside, by a parallel projection that the reader turns: triangles, camera, image plane, ray, lights.

import { cross, dot, lengthOf, minus, plusTimes, rowOf } from "../core/vectors.js";
import { drawArrow, drawDot, drawLine } from "./shapes.js";
import { SIZE } from "./world.js";
import { rayOfPixel } from "../core/steps.js";

/** @typedef {import("./figure.js").Pen} Pen */
/** @typedef {{ from: number[], to: number[], color: string, symbol?: string, text?: string, width?: number, dash?: number[], arrow?: boolean }} Stroke a line in space */
/** @typedef {{ at: number[], color: string, symbol?: string, text?: string, radius?: number }} Spot */
/** @typedef {{ corners: number[][], color: string, line?: string }} Patch a translucent polygon */
/**
 * @typedef {object} Content
 * @property {ArrayLike<number>} corners of triangles, nine numbers each
 * @property {number[][]} colors sRGB of each triangle
 * @property {number} [faded] opacity of the triangles
 * @property {number} [chosen] the outlined triangle
 * @property {number[] | null} [C] the camera's centre; null without a camera
 * @property {CanvasImageSource | null} [picture] on the image plane
 * @property {Stroke[]} [strokes]
 * @property {Spot[]} [spots]
 * @property {Patch[]} [patches]
 */

/** Distance of the drawn image plane from the centre, in units of the world. */
export const IMAGE_DISTANCE = 1.6;
const SEGMENTS = 20, ORBIT_PER_PX = 0.5;
const LIGHT = [0.35, -0.5, 0.79];

export class OutsideView {
  /** @param {{ azimuth?: number, elevation?: number, center?: number[], radius?: number }} [view] degrees and units of the world */
  constructor({ azimuth = -32, elevation = 26, center = [0.9, -1.5, 1], radius = 2.9 } = {}) {
    this.azimuth = azimuth;
    this.elevation = elevation;
    this.center = center;
    this.radius = radius;
    this.width = 1;
    this.height = 1;
    /** @type {number[][]} right, up and toward the reader */
    this.axes = [[1, 0, 0], [0, 0, 1], [0, -1, 0]];
    this.place(1, 1);
  }

  /** @param {number} width @param {number} height */
  place(width, height) {
    this.width = width;
    this.height = height;
    const [a, e] = [this.azimuth, this.elevation].map((degrees) => (degrees * Math.PI) / 180);
    const toward = [Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e)];
    const right = [-Math.sin(a), Math.cos(a), 0];
    this.axes = [right, cross(toward, right), toward];
    this.scale = Math.min(width / 1.3, height) / (2 * this.radius);
  }

  /** x, y and nearness of a point. @param {number[]} point */
  see(point) {
    const off = minus(point, this.center);
    const scale = this.scale || 1;
    return [this.width / 2 + scale * dot(off, this.axes[0]), this.height / 2 - scale * dot(off, this.axes[1]), dot(off, this.axes[2])];
  }

  /** @param {number[]} to @param {number[]} from */
  orbit(to, from) {
    this.azimuth -= ORBIT_PER_PX * (to[0] - from[0]);
    this.elevation = Math.max(6, Math.min(88, this.elevation + ORBIT_PER_PX * (to[1] - from[1])));
  }

  /** The point moved with the pointer, in the plane that faces the reader. @param {number[]} point @param {number[]} to @param {number[]} from */
  shift(point, to, from) {
    const scale = this.scale || 1;
    const moved = plusTimes(plusTimes(point, (to[0] - from[0]) / scale, this.axes[0]), (from[1] - to[1]) / scale, this.axes[1]);
    return moved.map((value) => Math.round(value * 1000) / 1000);
  }

  /** @param {Pen} pen @param {Content} content @param {any} shared */
  draw(pen, content, shared) {
    this.place(pen.width, pen.height);
    /** @type {{ near: number, paint: () => void }[]} */
    const parts = [];
    this.addTriangles(pen, content, parts);
    for (const { corners, color, line = "" } of content.patches || []) {
      const seen = corners.map((corner) => this.see(corner));
      parts.push({ near: mean(seen.map((each) => each[2])), paint: () => drawLine(pen, seen, { color: line || color, width: line ? 1.5 : 0, fill: color, close: true }) });
    }
    const strokes = [...(content.strokes || [])];
    if (content.C) strokes.push(...this.addCamera(pen, content, parts, shared));
    for (const stroke of strokes) this.addStroke(pen, stroke, parts);
    parts.sort((a, b) => a.near - b.near);
    for (const part of parts) part.paint();
    for (const { at, color, radius, text, symbol } of content.spots || []) {
      const [x, y] = this.see(at);
      drawDot(pen, [x, y], color, symbol && pen.lit(symbol) ? (radius || 5) + 3 : radius);
      if (text) pen.label({ at: [x, y], text, symbol, color: symbol ? undefined : pen.color(color) });
    }
  }

  /** @param {Pen} pen @param {Content} content @param {{ near: number, paint: () => void }[]} parts */
  addTriangles(pen, { corners, colors, faded = 1, chosen = -1 }, parts) {
    const { ctx } = pen;
    for (let i = 0; i < corners.length / 9; i++) {
      const points = [0, 3, 6].map((k) => [corners[9 * i + k], corners[9 * i + k + 1], corners[9 * i + k + 2]]);
      const seen = points.map((point) => this.see(point));
      const n = cross(minus(points[1], points[0]), minus(points[2], points[0]));
      const shade = 0.62 + 0.38 * Math.abs(dot(n, LIGHT) / (lengthOf(n) || 1));
      const isFloor = points.every((point) => point[2] === 0);
      const fill = `rgb(${(colors[i % colors.length] || [150, 150, 150]).map((value) => Math.round(shade * value)).join(" ")} / ${isFloor ? 0.55 * faded : faded})`;
      const paint = () => {
        drawLine(pen, seen, { color: fill, width: isFloor ? 0 : 0.8, fill, close: true });
        if (i === chosen) drawLine(pen, seen, { color: "ink", width: 2.5, close: true });
      };
      parts.push({ near: isFloor ? -1e9 : mean(seen.map((each) => each[2])), paint });
    }
    ctx.globalAlpha = 1;
  }

  /** @param {Pen} pen @param {Stroke} stroke @param {{ near: number, paint: () => void }[]} parts */
  addStroke(pen, { from, to, color, symbol, text, width = 2, dash, arrow = false }, parts) {
    const lit = symbol !== undefined && pen.lit(symbol);
    const thick = lit ? width + 2.5 : width;
    const count = dash ? 1 : SEGMENTS;
    for (let k = 0; k < count; k++) {
      const ends = [k / count, (k + 1) / count].map((part) => this.see(from.map((value, i) => value + part * (to[i] - value))));
      const paint = () => (arrow && k === count - 1 ? drawArrow(pen, this.see(from), this.see(to), color, thick) : drawLine(pen, ends, { color, width: thick, dash }));
      parts.push({ near: (ends[0][2] + ends[1][2]) / 2 + 0.02, paint });
    }
    if (text) {
      const [a, b] = [this.see(from), this.see(to)];
      pen.label({ at: arrow ? [0.35 * a[0] + 0.65 * b[0], 0.35 * a[1] + 0.65 * b[1]] : b.slice(0, 2), text, symbol, color: symbol ? undefined : pen.color(color) });
    }
  }

  /** The corners of the drawn image plane: top left, top right, bottom right, bottom left. @param {any} shared */
  imageCorners({ camera, numbers }) {
    const [right, bottom] = SIZE.map((side) => side - 0.5);
    return [[-0.5, -0.5], [right, -0.5], [right, bottom], [-0.5, bottom]].map(([u, v]) => this.imagePoint({ camera, numbers }, u, v));
  }

  /** The point of the drawn image plane at pixel coordinates. @param {any} shared @param {number} u @param {number} v */
  imagePoint({ camera, numbers }, u, v) {
    const { r, forward } = rayOfPixel(camera.P, u, v);
    return plusTimes(numbers.C, IMAGE_DISTANCE / dot(r, forward), r);
  }

  /** The pixel of the image plane at a point of the figure; null outside. @param {any} shared @param {number[]} at */
  pixelAt(shared, at) {
    const [a, b, , d] = this.imageCorners(shared).map((corner) => this.see(corner));
    const [p, q, w] = [[b[0] - a[0], b[1] - a[1]], [d[0] - a[0], d[1] - a[1]], [at[0] - a[0], at[1] - a[1]]];
    const area = p[0] * q[1] - p[1] * q[0];
    const [s, t] = [(w[0] * q[1] - w[1] * q[0]) / area, (p[0] * w[1] - p[1] * w[0]) / area];
    return s >= 0 && s <= 1 && t >= 0 && t <= 1 ? [Math.round(s * SIZE[0] - 0.5), Math.round(t * SIZE[1] - 0.5)] : null;
  }

  /** @param {Pen} pen @param {Content} content @param {{ near: number, paint: () => void }[]} parts @param {any} shared @returns {Stroke[]} */
  addCamera(pen, { picture }, parts, shared) {
    const C = shared.numbers.C;
    const corners = this.imageCorners(shared);
    const seen = corners.map((corner) => this.see(corner));
    const { ctx } = pen;
    parts.push({
      near: mean(seen.map((each) => each[2])),
      paint: () => {
        const [a, b, , d] = seen;
        if (picture) {
          ctx.save();
          ctx.transform((b[0] - a[0]) / SIZE[0], (b[1] - a[1]) / SIZE[0], (d[0] - a[0]) / SIZE[1], (d[1] - a[1]) / SIZE[1], a[0], a[1]);
          ctx.globalAlpha = 0.92;
          ctx.drawImage(picture, 0, 0, SIZE[0], SIZE[1]);
          ctx.restore();
        }
        drawLine(pen, seen, { color: "K", width: pen.lit("K") ? 4 : 1.5, close: true });
      },
    });
    const v = rowOf(shared.camera.R, 2);
    return [
      ...corners.map((corner) => ({ from: C, to: corner, color: "K", width: 1.2 })),
      { from: C, to: plusTimes(C, 0.9, v), color: "R", symbol: "R", text: "v", arrow: true },
    ];
  }
}

/** @param {number[]} values */
function mean(values) {
  return values.reduce((sum, value) => sum + value, 0) / values.length;
}
