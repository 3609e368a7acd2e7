// The numbers of the exercises: a camera and a triangle that are simple enough to calculate on paper. The figures show another camera and other triangles.

import { rayOfPixel, triangleSteps } from "../core/steps.js";
import { dot, plusTimes } from "../core/vectors.js";
import { cameraOf } from "./camera.js";

/** @typedef {{ fx: number, fy: number, skew: number, cx: number, cy: number, roll: number, pitch: number, yaw: number, C: number[], corners: number[][], pixel: number[] }} ExerciseNumbers */

/** @type {ExerciseNumbers} */
export const EXERCISE_NUMBERS = {
  fx: 300, fy: 300, skew: 0, cx: 160, cy: 120, roll: 0, pitch: 0, yaw: 90, C: [1.5, -2.5, 1],
  corners: [[1, 2, 0], [4, 3, 0], [2, 3, 2]], pixel: [190, 150],
};
/** Depth of the point C + r. */
const RAY_DEPTH = 10;

/** Removes rounding errors of angles such as cos 90°. @param {number} value */
const tidy = (value) => Math.round(value * 1e12) / 1e12;

/** All results about a camera, a pixel and a triangle that exercises require. @param {ExerciseNumbers} [numbers] @returns {import("./answers.js").Facts} */
export function factsOf(numbers = EXERCISE_NUMBERS) {
  const { P, R } = Object.fromEntries(Object.entries(cameraOf(numbers)).map(([name, values]) => [name, values.map(tidy)]));
  const first = rayOfPixel(P, numbers.pixel[0], numbers.pixel[1]);
  const r = plusTimes([0, 0, 0], RAY_DEPTH / dot(first.r, first.forward), first.r);
  const ray = { ...first, r };
  return { P, R, pixel: numbers.pixel, corners: numbers.corners, ray, behind: plusTimes(ray.C, -1, r), found: triangleSteps(numbers.corners.flat(), 0, ray) };
}
