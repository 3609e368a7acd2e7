// Navigation: functions that compute the next camera from a camera and a gesture, in the live view and in saved pages.

import { apply, cross, dot, lengthOf, minus, plusTimes, product, rowOf, transposed } from "./core/vectors.js";

/**
 * The camera of the image, as the message `camera` describes it.
 * @typedef {object} CameraState
 * @property {number[]} R camera_from_world, row by row
 * @property {number[]} C the centre, metres
 * @property {number[]} K in pixels of the image
 * @property {number[]} size of the image
 * @property {number[]} up the world's vertical axis
 * @property {boolean} [up_assumed] true if neither the file nor the user has chosen the vertical axis
 * @property {boolean} parallel true if all rays are parallel
 * @property {number[][]} edges unit rays through the middles of the image's edges, in the camera's frame
 * @property {number[][]} bounds of the world
 * @property {number[]} pivot the point that the camera orbits around
 */

const STEEPEST = (89 * Math.PI) / 180; // the largest pitch in radians: beyond the vertical, left and right would be exchanged
const MAX_HALF_ANGLE = Math.PI / 4; // the largest half field of view in radians with which a wide lens frames a world
const MIN_HALF_ANGLE = 0.01;

/**
 * The rotation by a right-handed angle about a unit axis (Rodrigues).
 * @param {number[]} axis
 * @param {number} angle
 */
function rotation([x, y, z], angle) {
  const matrix = [0, -z, y, z, 0, -x, -y, x, 0];
  const square = product(matrix, matrix);
  return matrix.map((value, i) => (i % 4 ? 0 : 1) + Math.sin(angle) * value + (1 - Math.cos(angle)) * square[i]);
}

/**
 * The rotation of the world's axes by `yaw` about up and `pitch` about the camera's right.
 * @param {CameraState} camera
 * @param {number} yaw
 * @param {number} pitch
 */
function turnOf({ R, up }, yaw, pitch) {
  const elevation = Math.asin(Math.max(-1, Math.min(1, dot(rowOf(R, 2), up))));
  const allowed = Math.abs(elevation) <= STEEPEST ? Math.max(-STEEPEST - elevation, Math.min(STEEPEST - elevation, pitch)) : pitch;
  return product(rotation(up, yaw), rotation(rowOf(R, 0), allowed));
}

/**
 * Turns the camera around its pivot, which stays at its pixel.
 * @param {CameraState} camera @param {number} yaw @param {number} pitch @returns {CameraState}
 */
export function orbit(camera, yaw, pitch) {
  const turn = turnOf(camera, yaw, pitch);
  const C = plusTimes(camera.pivot, 1, apply(turn, minus(camera.C, camera.pivot)));
  return { ...camera, R: orthonormal(product(camera.R, transposed(turn))), C };
}

/**
 * Turns the camera around its centre.
 * @param {CameraState} camera @param {number} yaw @param {number} pitch @returns {CameraState}
 */
export function lookAround(camera, yaw, pitch) {
  return { ...camera, R: orthonormal(product(camera.R, transposed(turnOf(camera, yaw, pitch)))) };
}

/**
 * Turns the camera around its principal axis.
 * @param {CameraState} camera @param {number} angle @returns {CameraState}
 */
export function roll(camera, angle) {
  return { ...camera, R: orthonormal(product(rotation([0, 0, 1], angle), camera.R)) };
}

/**
 * Moves the camera sideways; the pivot moves by (dx, dy) pixels of an image without distortion.
 * @param {CameraState} camera @param {number} dx @param {number} dy @returns {CameraState}
 */
export function pan(camera, dx, dy) {
  const { R, C, K, pivot } = camera;
  const depth = camera.parallel ? 1 : Math.max(dot(rowOf(R, 2), minus(pivot, C)), 1e-9);
  return { ...camera, C: plusTimes(plusTimes(C, (-depth * dx) / K[0], rowOf(R, 0)), (-depth * dy) / K[4], rowOf(R, 1)) };
}

/**
 * Moves the camera to 1 / factor of its distance to a point, which stays at its pixel. Parallel rays show objects
 * `factor` times as large instead.
 * @param {CameraState} camera @param {number[]} point @param {number} factor @returns {CameraState}
 */
export function dolly(camera, point, factor) {
  const C = plusTimes(point, 1 / factor, minus(camera.C, point));
  return { ...(camera.parallel ? magnified(camera, factor) : camera), C };
}

/** @param {CameraState} camera @param {number} factor @returns {CameraState} */
function magnified(camera, factor) {
  return { ...camera, K: camera.K.map((value, i) => ([0, 1, 4].includes(i) ? value * factor : value)) };
}

/**
 * Moves the camera along its right, the world's up, and its principal axis, in metres.
 * @param {CameraState} camera @param {number} right @param {number} upwards @param {number} forward @returns {CameraState}
 */
export function move(camera, right, upwards, forward) {
  const { R, C, up } = camera;
  return { ...camera, C: plusTimes(plusTimes(plusTimes(C, right, rowOf(R, 0)), upwards, up), forward, rowOf(R, 2)) };
}

/**
 * Moves the camera horizontally, relative to its viewing direction, in metres.
 * @param {CameraState} camera @param {number} right @param {number} forward @returns {CameraState}
 */
export function walk(camera, right, forward) {
  const { R, C, up } = camera;
  const ahead = rowOf(R, 2);
  const flat = plusTimes(ahead, -dot(ahead, up), up);
  // If the camera looks straight up or down, it moves towards the top of the image.
  const way = lengthOf(flat) < 1e-3 ? cross(up, rowOf(R, 0)) : flat;
  const level = way.map((value) => value / lengthOf(way));
  return { ...camera, C: plusTimes(plusTimes(C, right, cross(level, up)), forward, level) };
}

/**
 * Moves the camera along its view, so that a box fills the image, and puts the pivot into the middle of the box.
 * @param {CameraState} camera @param {number[][]} bounds @returns {CameraState}
 */
export function fit(camera, bounds) {
  const { R, K, size, edges } = camera;
  const pivot = bounds[0].map((low, i) => (low + bounds[1][i]) / 2);
  const radius = Math.max(lengthOf(minus(bounds[1], bounds[0])) / 2, 1e-9);
  if (camera.parallel) {
    const factor = Math.min(size[0] / K[0], size[1] / K[4]) / (2 * radius);
    return { ...magnified(camera, factor), C: plusTimes(pivot, -2 * radius, rowOf(R, 2)), pivot };
  }
  const angles = edges.map((ray) => Math.acos(Math.max(-1, Math.min(1, ray[2]))));
  const half = Math.max(Math.min(...angles, MAX_HALF_ANGLE), MIN_HALF_ANGLE);
  return { ...camera, C: plusTimes(pivot, -radius / Math.sin(half), rowOf(R, 2)), pivot };
}

/**
 * The rotation close to a matrix that is not exactly a rotation because of rounding (Gram-Schmidt).
 * @param {number[]} R
 */
function orthonormal(R) {
  const unit = (/** @type {number[]} */ v) => v.map((value) => value / lengthOf(v));
  const forward = unit(rowOf(R, 2));
  const right = unit(plusTimes(rowOf(R, 0), -dot(rowOf(R, 0), forward), forward));
  return [...right, ...cross(forward, right), ...forward];
}
