// Moves the camera and the sun when the reader drags in the camera's image. Pixels are [column, row].

import { pixelOf, rayOfPixel } from "../core/steps.js";
import { dot, minus, plusTimes, rowOf } from "../core/vectors.js";
import { cameraOf, rotationOf } from "./camera.js";
import { SIZE, toSun } from "./world.js";

/** @typedef {import("./world.js").Numbers} Numbers */
/** @typedef {"pixel" | "turn" | "move"} Mode what dragging the image does */

export const MODES = /** @type {{ mode: Mode, key: string, text: string, symbol: string, title: string }[]} */ ([
  { mode: "pixel", key: "p", text: "Pixel", symbol: "x", title: "Drag selects the pixel (key P)" },
  { mode: "turn", key: "t", text: "Turn R", symbol: "R", title: "Drag turns the camera; outside the ring, drag rolls it (key T)" },
  { mode: "move", key: "m", text: "Move C", symbol: "C", title: "Drag moves the camera; at the right edge, drag moves it forward or back (key M)" },
]);
const ROUNDS = 6, DELTA = 1e-3, MAX_PITCH = 89, MARGIN_PX = 20, ROLL_FROM = 0.86, FORWARD_FROM = 0.88;

const inDegrees = (/** @type {number} */ radians) => (radians * 180) / Math.PI;
const hundredths = (/** @type {number} */ value) => Math.round(value * 100) / 100;
const within = (/** @type {number} */ value, /** @type {number} */ low, /** @type {number} */ high) => Math.max(low, Math.min(high, value));

/** Sets yaw, pitch and roll, within their ranges. @param {Numbers} numbers @param {{ yaw?: number, pitch?: number, roll?: number }} angles */
export function setAngles(numbers, { yaw = numbers.yaw, pitch = numbers.pitch, roll = numbers.roll }) {
  numbers.yaw = hundredths(((yaw % 360) + 360) % 360);
  numbers.pitch = hundredths(within(pitch, -MAX_PITCH, MAX_PITCH));
  numbers.roll = hundredths(((((roll + 180) % 360) + 360) % 360) - 180);
}

/** Turns the camera, by Newton's method, so that the direction that one pixel shows appears at another pixel. @param {Numbers} numbers @param {number[]} from @param {number[]} to */
export function turnCamera(numbers, from, to) {
  const { r, C } = rayOfPixel(cameraOf(numbers).P, from[0], from[1]);
  const point = plusTimes(C, 1, r);
  let { yaw, pitch } = numbers;
  const offAt = (/** @type {number} */ y, /** @type {number} */ p) => {
    const { u, v, inFront } = pixelOf(cameraOf({ ...numbers, yaw: y, pitch: p }).P, point);
    return inFront ? [u - to[0], v - to[1]] : [NaN, NaN];
  };
  for (let round = 0; round < ROUNDS; round++) {
    const off = offAt(yaw, pitch);
    const [byYaw, byPitch] = [offAt(yaw + DELTA, pitch), offAt(yaw, pitch + DELTA)].map((other) => other.map((value, i) => (value - off[i]) / DELTA));
    const area = byYaw[0] * byPitch[1] - byYaw[1] * byPitch[0];
    yaw -= (off[0] * byPitch[1] - off[1] * byPitch[0]) / area;
    pitch -= (byYaw[0] * off[1] - byYaw[1] * off[0]) / area;
  }
  if (Number.isFinite(yaw) && Math.abs(pitch) <= MAX_PITCH) setAngles(numbers, { yaw, pitch });
}

/** Rolls the camera so that the image follows a pointer around the principal point. @param {Numbers} numbers @param {number[]} from @param {number[]} to */
export function rollCamera(numbers, from, to) {
  const { fx, fy, skew, cx, cy } = numbers;
  const [before, after] = [from, to].map(([u, v]) => Math.atan2((v - cy) / fy, (u - cx - (skew * (v - cy)) / fy) / fx));
  setAngles(numbers, { roll: numbers.roll - inDegrees(after - before) });
}

/** The camera's centre, moved parallel to the image plane so that a point at a depth follows the pointer. @param {Numbers} numbers @param {number[]} from @param {number[]} to @param {number} depth */
export function movedCenter(numbers, from, to, depth) {
  const { P } = cameraOf(numbers);
  const [start, end] = [from, to].map(([u, v]) => {
    const { r, C, forward } = rayOfPixel(P, u, v);
    return plusTimes(C, depth / dot(r, forward), r);
  });
  return minus(numbers.C, minus(end, start));
}

/** The azimuth and height in degrees of a direction, within the sun's ranges. @param {Numbers} numbers @param {number[]} direction */
export function setSun(numbers, [x, y, z]) {
  numbers.sun = Math.round(10 * inDegrees(Math.atan2(y, x))) / 10;
  numbers.height = within(Math.round(10 * inDegrees(Math.atan2(z, Math.hypot(x, y)))) / 10, 5, 90);
}

/** The pixel at which the image shows the sun, or a place at the image's edge in the sun's direction. @param {Numbers} numbers */
export function sunInPicture(numbers) {
  const { P, R } = cameraOf(numbers);
  const sun = toSun(numbers);
  const [x, y, w] = [0, 1, 2].map((i) => dot(P.slice(4 * i, 4 * i + 3), sun));
  const margin = MARGIN_PX / 4;
  const isInside = w > 0 && x / w > margin && x / w < SIZE[0] - margin && y / w > margin && y / w < SIZE[1] - margin;
  if (isInside) return { pixel: [x / w, y / w], isInside };
  const way = [dot(rowOf(R, 0), sun), dot(rowOf(R, 1), sun)];
  const half = SIZE.map((side) => side / 2 - MARGIN_PX);
  const scale = Math.min(...way.map((value, i) => half[i] / Math.abs(value || 1e-9)));
  return { pixel: way.map((value, i) => SIZE[i] / 2 - 0.5 + scale * value), isInside };
}

/** Drags the sun in the image: a visible sun follows the pointer; a sun at the image's edge turns around the camera. @param {Numbers} numbers @param {number[]} from @param {number[]} to */
export function dragSun(numbers, from, to) {
  if (sunInPicture(numbers).isInside) return setSun(numbers, rayOfPixel(cameraOf(numbers).P, to[0], to[1]).r);
  const [x, y] = to.map((value, i) => inDegrees((value - from[i]) / [numbers.fx, numbers.fy][i]));
  const azimuth = ((((numbers.sun - x + 180) % 360) + 360) % 360) - 180;
  numbers.sun = Math.round(10 * azimuth) / 10;
  numbers.height = within(Math.round(10 * (numbers.height - y)) / 10, 5, 90);
}

/** Yaw and pitch toward a point. @param {Numbers} numbers @param {number[]} point */
export function aimAt(numbers, point) {
  const [x, y, z] = minus(point, numbers.C);
  setAngles(numbers, { yaw: inDegrees(Math.atan2(y, x)), pitch: -inDegrees(Math.atan2(z, Math.hypot(x, y))) });
}

/** The roll that points the image's upper side toward a point. @param {Numbers} numbers @param {number[]} point */
export function rollToward(numbers, point) {
  const level = rotationOf(0, numbers.pitch, numbers.yaw);
  const off = minus(point, numbers.C);
  setAngles(numbers, { roll: inDegrees(Math.atan2(dot(off, rowOf(level, 0)), -dot(off, rowOf(level, 1)))) });
}

/** True for a pixel outside the ring, where dragging in the turn mode rolls the camera. @param {number[]} pixel */
export const isOutsideRing = (pixel) => Math.hypot(...pixel.map((value, i) => value + 0.5 - SIZE[i] / 2)) > (ROLL_FROM * SIZE[1]) / 2;
/** True for a pixel at the right edge, where dragging in the move mode moves the camera forward or back. @param {number[]} pixel */
export const isAtForwardEdge = ([u]) => u > FORWARD_FROM * SIZE[0];

/** Draws the ring of the turn mode, or the strip of the move mode. @param {import("../figure/board.js").Pen} pen @param {Mode} mode */
export function drawMode({ ctx, width, height, color }, mode) {
  ctx.save();
  [ctx.lineWidth, ctx.globalAlpha] = [2, 0.85];
  ctx.setLineDash([7, 7]);
  if (mode === "turn") {
    ctx.beginPath();
    ctx.arc(width / 2, height / 2, (ROLL_FROM * height) / 2, 0, 2 * Math.PI);
    ctx.strokeStyle = color("R");
    ctx.stroke();
  } else if (mode === "move") {
    const left = FORWARD_FROM * width;
    ctx.fillStyle = color("C");
    ctx.globalAlpha = 0.16;
    ctx.fillRect(left, 0, width - left, height);
    ctx.globalAlpha = 0.9;
    for (const [y, sign] of [[0.12 * height, 1], [0.88 * height, -1]]) {
      const middle = (left + width) / 2;
      ctx.beginPath();
      ctx.moveTo(middle, y - 8 * sign);
      ctx.lineTo(middle - 9, y + 6 * sign);
      ctx.lineTo(middle + 9, y + 6 * sign);
      ctx.fill();
    }
  }
  ctx.restore();
}
