// Navigation in a page: functions from a pose and an intent to a pose, as viewer/navigation.py has them.

/** @typedef {{ R: number[], C: number[] }} Pose R row by row: the world's axes in the camera's; C the centre */

const STEEPEST = (89 * Math.PI) / 180; // a camera never looks farther up or down, where its sides would swap

/** @param {number[]} a @param {number[]} b */
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
/** @param {number[]} a @param {number[]} b */
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
/** @param {number[]} a @param {number[]} b */
export const minus = (a, b) => a.map((value, i) => value - b[i]);
/** @param {number[]} a @param {number} scale @param {number[]} b */
export const plusTimes = (a, scale, b) => a.map((value, i) => value + scale * b[i]);
/** @param {number[]} a */
export const lengthOf = (a) => Math.sqrt(dot(a, a));
/** @param {number[]} matrix @param {number} i */
export const rowOf = (matrix, i) => matrix.slice(3 * i, 3 * i + 3);
/** @param {number[]} matrix @param {number[]} vector */
export const apply = (matrix, vector) => [0, 1, 2].map((i) => dot(rowOf(matrix, i), vector));

/** @param {number[]} a @param {number[]} b */
export function product(a, b) {
  return [0, 1, 2].flatMap((i) => [0, 1, 2].map((j) => a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j]));
}

/** @param {number[]} m */
const transposed = (m) => [m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]];

/**
 * The rotation by a right-handed angle about a unit axis (Rodrigues).
 * @param {number[]} axis
 * @param {number} angle
 */
function rotation([x, y, z], angle) {
  const cross = [0, -z, y, z, 0, -x, -y, x, 0];
  const square = product(cross, cross);
  return cross.map((value, i) => (i % 4 ? 0 : 1) + Math.sin(angle) * value + (1 - Math.cos(angle)) * square[i]);
}

/**
 * The rotation of the world's axes by `yaw` about up and `pitch` about the camera's right.
 * @param {Pose} pose
 * @param {number[]} up
 * @param {number} yaw
 * @param {number} pitch
 */
function turnOf({ R }, up, yaw, pitch) {
  const elevation = Math.asin(Math.max(-1, Math.min(1, dot(rowOf(R, 2), up))));
  const allowed =
    Math.abs(elevation) <= STEEPEST ? Math.max(-STEEPEST - elevation, Math.min(STEEPEST - elevation, pitch)) : pitch;
  return product(rotation(up, yaw), rotation(rowOf(R, 0), allowed));
}

/** @param {Pose} pose @param {number[]} up @param {number[]} pivot @param {number} yaw @param {number} pitch @returns {Pose} */
export function orbit(pose, up, pivot, yaw, pitch) {
  const turn = turnOf(pose, up, yaw, pitch);
  return { R: product(pose.R, transposed(turn)), C: plusTimes(pivot, 1, apply(turn, minus(pose.C, pivot))) };
}

/** @param {Pose} pose @param {number[]} up @param {number} yaw @param {number} pitch @returns {Pose} */
export function lookAround(pose, up, yaw, pitch) {
  return { R: product(pose.R, transposed(turnOf(pose, up, yaw, pitch))), C: pose.C };
}

/** @param {Pose} pose @param {number} angle @returns {Pose} */
export function roll(pose, angle) {
  return { R: product(rotation([0, 0, 1], angle), pose.R), C: pose.C };
}

/** @param {Pose} pose @param {number[]} K @param {number[]} pivot @param {number} dx @param {number} dy @returns {Pose} */
export function pan({ R, C }, K, pivot, dx, dy) {
  const depth = Math.max(dot(rowOf(R, 2), minus(pivot, C)), 1e-9);
  return { R, C: plusTimes(plusTimes(C, (-depth * dx) / K[0], rowOf(R, 0)), (-depth * dy) / K[4], rowOf(R, 1)) };
}

/** @param {Pose} pose @param {number[]} point @param {number} factor @returns {Pose} */
export function dolly({ R, C }, point, factor) {
  return { R, C: plusTimes(point, 1 / factor, minus(C, point)) };
}

/** @param {Pose} pose @param {number[]} up @param {number} right @param {number} upwards @param {number} forward @returns {Pose} */
export function move({ R, C }, up, right, upwards, forward) {
  return { R, C: plusTimes(plusTimes(plusTimes(C, right, rowOf(R, 0)), upwards, up), forward, rowOf(R, 2)) };
}

/**
 * Along the ground, in the direction that the camera looks, at the same height above it.
 * @param {Pose} pose
 * @param {number[]} up
 * @param {number} right
 * @param {number} upwards
 * @param {number} forward
 * @param {(place: number[]) => number | null} below how far below a place the ground is; null where there is none
 * @returns {Pose}
 */
export function walk({ R, C }, up, right, upwards, forward, below) {
  const ahead = rowOf(R, 2);
  const flat = plusTimes(ahead, -dot(ahead, up), up);
  // Straight up or down: the way that the picture's top points, or its foot.
  const way = lengthOf(flat) < 1e-3 ? cross(up, rowOf(R, 0)) : flat;
  const level = way.map((value) => value / lengthOf(way));
  const place = plusTimes(plusTimes(C, right, cross(level, up)), forward, level);
  const [before, after] = [below(C), below(place)];
  const change = before === null || after === null ? 0 : before - after;
  return { R, C: plusTimes(place, upwards + change, up) };
}

/**
 * How far below a place the highest ground within `foot` metres is; null above nothing.
 * @param {ArrayLike<number>} corners nine numbers for each triangle
 * @param {number[]} up one of the world's axes
 * @param {number[]} place
 * @param {number} foot
 */
export function groundBelow(corners, up, place, foot) {
  const k = up.indexOf(1);
  const [i, j] = [0, 1, 2].filter((axis) => axis !== k);
  const points = [[0, 0], [foot, 0], [-foot, 0], [0, foot], [0, -foot]].map(([x, y]) => [place[i] + x, place[j] + y]);
  let highest = -Infinity;
  for (let at = 0; at < corners.length; at += 9) {
    const [ax, ay, bx, by, cx, cy] = [corners[at + i], corners[at + j], corners[at + 3 + i], corners[at + 3 + j], corners[at + 6 + i], corners[at + 6 + j]];
    if (Math.max(ax, bx, cx) < place[i] - foot || Math.min(ax, bx, cx) > place[i] + foot) continue;
    if (Math.max(ay, by, cy) < place[j] - foot || Math.min(ay, by, cy) > place[j] + foot) continue;
    const area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax);
    if (!area) continue;
    for (const [x, y] of points) {
      const [p, q] = [((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / area, ((x - ax) * (cy - ay) - (y - ay) * (cx - ax)) / area];
      if (p < 0 || q < 0 || p + q > 1) continue;
      const height = corners[at + k] + q * (corners[at + 3 + k] - corners[at + k]) + p * (corners[at + 6 + k] - corners[at + k]);
      if (height <= place[k]) highest = Math.max(highest, height);
    }
  }
  return Number.isFinite(highest) ? place[k] - highest : null;
}

/** @param {Pose} pose @param {number[]} K @param {number[]} size @param {number[][]} bounds @returns {Pose} */
export function fit({ R }, K, size, bounds) {
  const middle = bounds[0].map((low, i) => (low + bounds[1][i]) / 2);
  const radius = Math.max(lengthOf(minus(bounds[1], bounds[0])) / 2, 1e-9);
  const half = Math.min(Math.atan(size[0] / 2 / K[0]), Math.atan(size[1] / 2 / K[4]), Math.PI / 4);
  return { R, C: plusTimes(middle, -radius / Math.sin(Math.max(half, 0.01)), rowOf(R, 2)) };
}
