// Vectors [3] and matrices [9], row by row.

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
export const transposed = (m) => [m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]];
