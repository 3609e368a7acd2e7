// The comparison of two planes of one channel: their difference as a plane, and its statistics.

import { styleOf } from "./channels.js";
import { flipOf } from "./flip.js";

/** @typedef {import("./planes.js").Plane} Plane */
/** @typedef {"absolute" | "signed" | "relative" | "perceptual"} DifferenceKind */
/** @typedef {{ plane: Plane, kind: DifferenceKind, pixels: number, most: number, mean: number, rms: number, ids: boolean }} Difference */

/** The modes with their texts, in the order in which the key selects them. */
export const COMPARE_MODES = /** @type {[string, string][]} */ ([
  ["off", "off"], ["slider", "wipe"], ["flip", "flip"], ["blink", "blink"],
  ["difference", "absolute difference"], ["signed", "signed difference A - B"], ["relative", "relative difference"],
  ["perceptual", "perceptual difference (FLIP)"],
]);
const KINDS = /** @type {Record<string, DifferenceKind>} */ ({ difference: "absolute", signed: "signed", relative: "relative", perceptual: "perceptual" });

/**
 * The difference that a mode shows, or null for modes that show the images.
 * @param {string} mode
 * @returns {DifferenceKind | null}
 */
export function differenceKind(mode) {
  return KINDS[mode] || null;
}

/**
 * Returns whether two planes can be subtracted.
 * @param {Plane} a
 * @param {Plane} b
 * @returns {boolean}
 */
export function areComparable(a, b) {
  return a.name === b.name && a.width === b.width && a.height === b.height && a.components === b.components;
}

/**
 * The difference of two planes: for each pixel the largest difference of its components, or 1 if ids differ. Equal values,
 * infinities and NaN included, differ by 0; a value and a missing value differ by infinity. "signed" keeps the sign
 * of A - B, "relative" divides by |B|. The statistics are those of the absolute difference.
 * @param {Plane} a
 * @param {Plane} b
 * @param {DifferenceKind} [kind]
 * @returns {Difference}
 */
export function differenceOf(a, b, kind = "absolute") {
  const { components, width, height } = a;
  const ids = styleOf(a).kind === "ids";
  const values = new Float64Array(width * height);
  let [pixels, most, sum, squares, finite] = [0, 0, 0, 0, 0];
  for (let pixel = 0; pixel < values.length; pixel++) {
    let largest = 0;
    for (let at = pixel * components; at < (pixel + 1) * components; at++) {
      const distance = apart(a.values[at], b.values[at]);
      largest = Math.max(largest, distance);
      const shown = kind === "relative" && distance > 0 ? distance / Math.abs(b.values[at]) : distance;
      if (shown > Math.abs(values[pixel])) values[pixel] = kind === "signed" && a.values[at] < b.values[at] ? -shown : shown;
    }
    if (ids) values[pixel] = largest = largest > 0 ? 1 : 0;
    if (largest > 0) pixels++;
    most = Math.max(most, largest);
    if (Number.isFinite(largest)) {
      finite++;
      sum += largest;
      squares += largest * largest;
    }
  }
  const name = kind === "absolute" ? "difference" : `${kind} difference`;
  const plane = { ...a, name: `${name} of ${a.name}`, dtype: /** @type {const} */ ("float64"), components: 1, values };
  const count = Math.max(finite, 1);
  return { plane, kind, pixels, most, mean: sum / count, rms: Math.sqrt(squares / count), ids };
}

/**
 * The FLIP error of two images as displayed, or null for images of different sizes.
 * @param {HTMLCanvasElement | null} a
 * @param {HTMLCanvasElement | null} b
 * @returns {Difference | null}
 */
export function perceptualOf(a, b) {
  if (!a || !b || a.width !== b.width || a.height !== b.height) return null;
  const { width, height } = a;
  const [x, y] = [a, b].map((each) => /** @type {CanvasRenderingContext2D} */ (each.getContext("2d")).getImageData(0, 0, width, height).data);
  const values = flipOf(x, y, width);
  let [pixels, most, sum, squares] = [0, 0, 0, 0];
  for (const value of values) {
    if (value > 0) pixels++;
    most = Math.max(most, value);
    sum += value;
    squares += value * value;
  }
  const plane = { name: "FLIP error", dtype: /** @type {const} */ ("float64"), width, height, components: 1, values };
  return { plane, kind: "perceptual", pixels, most, mean: sum / values.length, rms: Math.sqrt(squares / values.length), ids: false };
}

/**
 * @param {number} x
 * @param {number} y
 * @returns {number}
 */
function apart(x, y) {
  if (Object.is(x, y) || x === y) return 0;
  const distance = Math.abs(x - y);
  return Number.isNaN(distance) ? Infinity : distance;
}
