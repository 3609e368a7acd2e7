// The parts of a typed exercise, and the tolerance of its answers.

import { general } from "../core/explanation.js";

/**
 * @typedef {object} Facts the camera, pixel and triangle of the exercises
 * @property {number[]} P
 * @property {number[]} R
 * @property {number[]} pixel column, row
 * @property {number[][]} corners of the triangle
 * @property {import("../core/steps.js").PixelRay} ray
 * @property {number[]} behind the point of the ray's line behind the camera: C - r
 * @property {import("../core/steps.js").Candidate} found the triangle's steps
 */
/** @typedef {{ right: boolean, text: string }} Verdict */
/**
 * @typedef {object} Exercise
 * @property {string} id
 * @property {string} title
 * @property {string[]} asked the names of the numbers
 * @property {(facts: Facts, isSolved: (id: string) => boolean) => string[]} given lines
 * @property {(facts: Facts) => number[]} answer
 * @property {(values: number[], facts: Facts) => string} hint to a wrong answer
 * @property {((values: number[], facts: Facts) => string)} [other] why another answer is also correct; empty if the answer is wrong
 */

/** The tolerance of an answer, as a share of the largest number. */
export const TOLERANCE = 1e-3;

/** True if numbers are the same within the tolerance. @param {number[]} values @param {number[]} right */
export const areClose = (values, right) => {
  const off = TOLERANCE * Math.max(...right.map(Math.abs), 1e-9);
  return values.length === right.length && values.every((value, i) => Math.abs(value - right[i]) <= off);
};
export const negated = (/** @type {number[]} */ values) => values.map((value) => -value);
/** A line with another exercise's answer, which appears when that exercise is solved. @param {boolean} isSolved @param {string} name @param {string} value @param {string} chapter */
export const earlier = (isSolved, name, value, chapter) => (isSolved ? `${name} = ${value}` : `${name}: your answer from the chapter “${chapter}”`);
export const triple = (/** @type {string} */ name) => ["x", "y", "z"].map((axis) => `${name} ${axis}`);
export const rowsOf = (/** @type {number[]} */ m, /** @type {number} */ columns) =>
  Array.from({ length: m.length / columns }, (_, i) => `  [${m.slice(columns * i, columns * (i + 1)).map(general).join(", ")}]`);
