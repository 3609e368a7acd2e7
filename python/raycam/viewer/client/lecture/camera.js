// The camera's matrices from the eleven numbers that a reader sets, as `raycam.Camera.from_pose` computes them.

import { apply, product, rowOf } from "../core/vectors.js";

const inRadians = (/** @type {number} */ degrees) => (degrees * Math.PI) / 180;

/**
 * The rotation R of the world's axes into the camera's, row by row: right, down, forward. Angles are in degrees.
 * @param {number} roll
 * @param {number} pitch
 * @param {number} yaw
 */
export function rotationOf(roll, pitch, yaw) {
  const [sr, sp, sy] = [roll, pitch, yaw].map((angle) => Math.sin(inRadians(angle)));
  const [cr, cp, cy] = [roll, pitch, yaw].map((angle) => Math.cos(inRadians(angle)));
  const forward = [cy * cp, sy * cp, -sp];
  const left = [cy * sp * sr - sy * cr, sy * sp * sr + cy * cr, cp * sr];
  const up = [cy * sp * cr + sy * sr, sy * sp * cr - cy * sr, cp * cr];
  return [...left.map((value) => -value), ...up.map((value) => -value), ...forward];
}

/**
 * K, R, C and P = K R [I | -C], row by row.
 * @param {{ fx: number, fy: number, skew: number, cx: number, cy: number, roll: number, pitch: number, yaw: number, C: number[] }} numbers
 */
export function cameraOf({ fx, fy, skew, cx, cy, roll, pitch, yaw, C }) {
  const K = [fx, skew, cx, 0, fy, cy, 0, 0, 1];
  const R = rotationOf(roll, pitch, yaw);
  const M = product(K, R);
  const p4 = apply(M, C).map((value) => -value);
  const P = [0, 1, 2].flatMap((i) => [...rowOf(M, i), p4[i]]);
  return { K, R, C, P };
}
