// The world from outside, in a parallel projection that the reader can rotate: triangles, camera, image plane, ray, lights.

import { cross, dot, lengthOf, minus, plusTimes } from "../core/vectors.js";
import { drawArrow, drawBulb, drawDot, drawLine, drawRing, drawSun } from "./shapes.js";

/** @typedef {import("./board.js").Pen} Pen */
/** @typedef {{ from: number[], to: number[], color: string, symbol?: string, text?: string, width?: number, dash?: number[], arrow?: boolean }} Stroke a line in space */
/** @typedef {{ at: number[], color: string, symbol?: string, text?: string, radius?: number, isHandle?: boolean, glows?: "sun" | "bulb" }} Spot a point; a handle has a ring around it */
/** @typedef {{ corners: number[][], color: string, line?: string, symbol?: string }} Patch a translucent polygon */
/**
 * @typedef {object} Rig the camera, as a figure draws it
 * @property {number[]} C where it is drawn
 * @property {number[]} v the principal axis, a unit vector
 * @property {number[]} size columns and rows
 * @property {number} distance of the drawn image plane
 * @property {number[][]} corners of the drawn image plane: top left, top right, bottom right, bottom left
 * @property {CanvasImageSource | null} [picture] on the image plane
 * @property {number[]} [region] column, row, columns and rows of the part that the image shows
 */
/**
 * @typedef {object} Content
 * @property {ArrayLike<number>} corners of triangles, nine numbers each
 * @property {number[][]} colors sRGB of each triangle
 * @property {number} [faded] opacity of the triangles
 * @property {number} [chosen] the outlined triangle
 * @property {number[]} [sun] the direction to the sun: it shades the triangles, and they cast shadows on the ground
 * @property {number} [grid] half the side of a grid on the ground, in units
 * @property {Rig | null} [rig]
 * @property {Rig} [second] another camera
 * @property {Stroke[]} [strokes]
 * @property {Spot[]} [spots]
 * @property {Patch[]} [patches]
 */
/** @typedef {{ near: number, paint: () => void }} Part */

/** Length of the drawn axis v, by the distance of the drawn image plane. */
export const AXIS_LENGTH = 0.55;
const SEGMENTS = 20, ORBIT_PER_PX = 0.5, GROUND = -1e9;
const LIGHT = [0.35, -0.5, 0.79];

export class OutsideView {
  /** @param {{ azimuth?: number, elevation?: number, center?: number[], radius?: number, up?: number[] }} [view] degrees and units of the world; `up` is one of its axes */
  constructor({ azimuth = 2, elevation = 24, center = [0.42, -0.6, 0.8], radius = 2.75, up = [0, 0, 1] } = {}) {
    this.azimuth = azimuth;
    this.elevation = elevation;
    this.center = center;
    this.radius = radius;
    this.up = up;
    this.width = 1;
    this.height = 1;
    this.scale = 1;
    /** @type {number[][]} right, up and toward the reader */
    this.axes = [[1, 0, 0], [0, 0, 1], [0, -1, 0]];
    this.place(1, 1);
  }

  /** @param {number} width @param {number} height */
  place(width, height) {
    this.width = width;
    this.height = height;
    const [a, e] = [this.azimuth, this.elevation].map((degrees) => (degrees * Math.PI) / 180);
    const p = this.up[0] ? [0, 1, 0] : [1, 0, 0];
    const q = cross(this.up, p);
    const level = p.map((value, i) => Math.cos(a) * value + Math.sin(a) * q[i]);
    const toward = level.map((value, i) => Math.cos(e) * value + Math.sin(e) * this.up[i]);
    const right = cross(this.up, level);
    this.axes = [right, cross(toward, right), toward];
    this.scale = Math.min(width / 1.3, height) / (2 * this.radius);
  }

  /** The position x, y of a point in the figure, and its nearness to the reader. @param {number[]} point */
  see(point) {
    const off = minus(point, this.center);
    return [this.width / 2 + this.scale * dot(off, this.axes[0]), this.height / 2 - this.scale * dot(off, this.axes[1]), dot(off, this.axes[2])];
  }

  /** @param {number[]} to @param {number[]} from */
  orbit(to, from) {
    this.azimuth -= ORBIT_PER_PX * (to[0] - from[0]);
    this.elevation = Math.max(6, Math.min(88, this.elevation + ORBIT_PER_PX * (to[1] - from[1])));
  }

  /** The point moved with the pointer, in the plane that faces the reader. @param {number[]} point @param {number[]} to @param {number[]} from */
  shift(point, to, from) {
    const moved = plusTimes(plusTimes(point, (to[0] - from[0]) / this.scale, this.axes[0]), (from[1] - to[1]) / this.scale, this.axes[1]);
    return moved.map((value) => Math.round(value * 1000) / 1000);
  }

  /** @param {Pen} pen @param {Content} content */
  draw(pen, content) {
    this.place(pen.width, pen.height);
    /** @type {Part[]} */
    const parts = [];
    this.addTriangles(pen, content, parts);
    for (const patch of content.patches || []) this.addPatch(pen, patch, parts);
    const strokes = [...(content.strokes || [])];
    if (content.rig) strokes.push(...this.addCamera(pen, content.rig, parts));
    if (content.second) strokes.push(...this.addCamera(pen, content.second, parts).map((stroke) => ({ ...stroke, text: "" })));
    for (const stroke of strokes) this.addStroke(pen, stroke, parts);
    parts.sort((a, b) => a.near - b.near);
    for (const part of parts) part.paint();
    for (const { at, color, radius = 5, text, symbol, isHandle, glows } of content.spots || []) {
      const [x, y] = this.see(at);
      const size = pen.lit(symbol) ? radius + 2.5 : radius;
      if (isHandle) drawRing(pen, [x, y], color, size + 5);
      if (glows === "sun") drawSun(pen, [x, y], size + 2);
      else if (glows === "bulb") drawBulb(pen, [x, y], size);
      else drawDot(pen, [x, y], color, size);
      pen.touch(symbol, [[x, y]]);
      pen.avoid([x, y]);
      if (text) pen.label({ at: [x, y], text, symbol, color: pen.color(color) });
    }
  }

  /** @param {Pen} pen @param {Content} content @param {Part[]} parts */
  addTriangles(pen, { corners, colors, faded = 1, chosen = -1, grid = 0, sun }, parts) {
    const heights = Array.from({ length: corners.length / 3 }, (_, i) => dot([corners[3 * i], corners[3 * i + 1], corners[3 * i + 2]], this.up));
    const ground = Math.min(...heights);
    const light = sun || LIGHT;
    /** @type {number[][][]} */
    const floor = [];
    /** @type {number[][][]} */
    const shadows = [];
    for (let i = 0; i < corners.length / 9; i++) {
      const points = [0, 3, 6].map((k) => [corners[9 * i + k], corners[9 * i + k + 1], corners[9 * i + k + 2]]);
      const seen = points.map((point) => this.see(point));
      const n = cross(minus(points[1], points[0]), minus(points[2], points[0]));
      const shade = 0.62 + 0.38 * Math.abs(dot(n, light) / (lengthOf(n) || 1));
      const isGround = [0, 1, 2].every((k) => heights[3 * i + k] - ground < 1e-9);
      if (isGround) floor.push(seen);
      else if (sun) shadows.push(points.map((point, k) => this.see(plusTimes(point, -(heights[3 * i + k] - ground) / Math.max(0.05, dot(sun, this.up)), sun))));
      const fill = `rgb(${(colors[i % colors.length] || [150, 150, 150]).map((value) => Math.round(shade * value)).join(" ")} / ${isGround ? 0.5 * faded : faded})`;
      const paint = () => {
        drawLine(pen, seen, { color: fill, width: isGround ? 0 : 0.8, fill, close: true });
        if (i === chosen) drawLine(pen, seen, { color: "ink", width: 2.2, close: true });
      };
      parts.push({ near: isGround ? GROUND : mean(seen.map((each) => each[2])), paint });
    }
    if (shadows.length) parts.push({ near: GROUND / 3, paint: () => fillShadows(pen, floor, shadows) });
    for (let k = -Math.floor(grid); k <= grid; k++) {
      for (const ends of [[[k, -grid, 0], [k, grid, 0]], [[-grid, k, 0], [grid, k, 0]]])
        parts.push({ near: GROUND / 2, paint: () => drawLine(pen, ends.map((end) => this.see(end)), { color: "grid", width: 1 }) });
    }
  }

  /** @param {Pen} pen @param {Patch} patch @param {Part[]} parts */
  addPatch(pen, { corners, color, line = "", symbol }, parts) {
    const seen = corners.map((corner) => this.see(corner));
    const width = line ? (pen.lit(symbol) ? 3.5 : 1.5) : 0;
    parts.push({ near: mean(seen.map((each) => each[2])), paint: () => drawLine(pen, seen, { color: line || color, width, fill: color, close: true }) });
    pen.touch(symbol, [...seen, seen[0]]);
  }

  /** @param {Pen} pen @param {Stroke} stroke @param {Part[]} parts */
  addStroke(pen, { from, to, color, symbol, text, width = 2, dash, arrow = false }, parts) {
    const thick = pen.lit(symbol) ? width + 2.5 : width;
    const count = dash ? 1 : SEGMENTS;
    const [a, b] = [this.see(from), this.see(to)];
    const at = (/** @type {number} */ part) => a.map((value, i) => value + part * (b[i] - value));
    const head = arrow ? Math.min(1, (6 + 2 * thick) / (Math.hypot(b[0] - a[0], b[1] - a[1]) || 1)) : 0;
    for (let k = 0; k < count; k++) {
      const ends = [at((k / count) * (1 - head)), at(((k + 1) / count) * (1 - head))];
      parts.push({ near: (ends[0][2] + ends[1][2]) / 2 + 0.02, paint: () => drawLine(pen, ends, { color, width: thick, dash }) });
    }
    if (arrow) parts.push({ near: b[2] + 0.02, paint: () => drawArrow(pen, at(1 - head), b, color, thick) });
    pen.touch(symbol, [a, b]);
    if (text) pen.label({ at: arrow ? at(0.65).slice(0, 2) : b.slice(0, 2), text, symbol, color: pen.color(color) });
  }

  /** @param {Pen} pen @param {Rig} rig @param {Part[]} parts @returns {Stroke[]} */
  addCamera(pen, rig, parts) {
    const { corners } = rig;
    const seen = corners.map((corner) => this.see(corner));
    const [[a, b, , d], { ctx }, [columns, rows]] = [seen, pen, rig.size];
    const [left, top, width, height] = rig.region || [0, 0, columns, rows];
    parts.push({
      near: mean(seen.map((each) => each[2])),
      paint: () => {
        if (rig.picture) {
          drawLine(pen, seen.map(([x, y]) => [x + 3, y + 6]), { color: "shadow", width: 3, fill: "shadow", close: true });
          ctx.save();
          ctx.transform((b[0] - a[0]) / columns, (b[1] - a[1]) / columns, (d[0] - a[0]) / rows, (d[1] - a[1]) / rows, a[0], a[1]);
          ctx.globalAlpha = 0.94;
          ctx.drawImage(rig.picture, left, top, width, height);
          ctx.restore();
        }
        drawLine(pen, seen, { color: "K", width: pen.lit("K") ? 4 : 1.5, close: true });
      },
    });
    pen.touch("K", [...seen, seen[0]]);
    const apex = this.see(rig.C);
    [0, 1, 2, 3].forEach((i) => {
      const side = [apex, seen[i], seen[(i + 1) % 4]];
      parts.push({ near: mean(side.map((each) => each[2])) - 0.03, paint: () => drawLine(pen, side, { color: "K", width: 0, fill: "frustum", close: true }) });
    });
    return [
      ...corners.map((corner) => ({ from: rig.C, to: corner, color: "K", width: pen.lit("K") ? 2.5 : 1.1, symbol: "K" })),
      { from: rig.C, to: plusTimes(rig.C, AXIS_LENGTH * rig.distance, rig.v), color: "R", symbol: "v", text: "v", arrow: true },
    ];
  }

  /** The pixel of the image plane at a point of the figure; null outside. @param {Rig} rig @param {number[]} at */
  pixelAt(rig, at) {
    const [a, b, , d] = rig.corners.map((corner) => this.see(corner));
    const [p, q, w] = [[b[0] - a[0], b[1] - a[1]], [d[0] - a[0], d[1] - a[1]], [at[0] - a[0], at[1] - a[1]]];
    const area = p[0] * q[1] - p[1] * q[0];
    const [s, t] = [(w[0] * q[1] - w[1] * q[0]) / area, (p[0] * w[1] - p[1] * w[0]) / area];
    return s >= 0 && s <= 1 && t >= 0 && t <= 1 ? [Math.round(s * rig.size[0] - 0.5), Math.round(t * rig.size[1] - 0.5)] : null;
  }
}

/** Fills the shadows on the floor; where shadows overlap, they are not darker. @param {Pen} pen @param {number[][][]} floor @param {number[][][]} shadows */
function fillShadows({ ctx, color }, floor, shadows) {
  const trace = (/** @type {number[][][]} */ triangles) => {
    ctx.beginPath();
    for (const [a, b, c] of triangles) {
      const isTurned = (b[0] - a[0]) * (c[1] - a[1]) < (b[1] - a[1]) * (c[0] - a[0]);
      ctx.moveTo(a[0], a[1]);
      for (const [x, y] of isTurned ? [c, b] : [b, c]) ctx.lineTo(x, y);
      ctx.closePath();
    }
  };
  ctx.save();
  trace(floor);
  ctx.clip();
  trace(shadows);
  ctx.fillStyle = color("shadow");
  ctx.fill();
  ctx.restore();
}

/** @param {number[]} values */
function mean(values) {
  return values.reduce((sum, value) => sum + value, 0) / values.length;
}
