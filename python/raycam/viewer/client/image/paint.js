// Painting: converts a plane to the RGBA bytes of an image, with the display settings.

import { isMiss, styleOf } from "./channels.js";
import { flowColor, idColor, mapIndex, mapTable, shareOfRange } from "./colormap.js";
import { toneMap } from "./tone.js";

/** @typedef {import("./planes.js").Plane} Plane */
/** @typedef {{ low: number, high: number, log: boolean }} Range */
/**
 * @typedef {object} Display
 * @property {number} exposure stops
 * @property {string} view a view transform
 * @property {string} map a colour map
 * @property {Range | null} range of scalars; null selects the percentiles
 */

const HATCH = [[0x8c, 0x92, 0x9c], [0x74, 0x7a, 0x84]];
const SAMPLES_OF_PERCENTILES = 1 << 15;
const [LOW_SHARE, HIGH_SHARE] = [0.02, 0.98];

/**
 * Paints a plane.
 * @param {Plane} plane
 * @param {Display} display
 * @returns {ImageData}
 */
export function paint(plane, display) {
  const image = new ImageData(plane.width, plane.height);
  const style = styleOf(plane);
  if (style.kind === "light") toneMap(plane.values, display.exposure, display.view, image.data);
  else paintPixels(plane, style, painterOf(plane, style, display), image.data);
  return image;
}

/**
 * @param {Plane} plane
 * @param {import("./channels.js").ChannelStyle} style
 * @param {(at: number) => ArrayLike<number>} painter
 * @param {Uint8ClampedArray} rgba
 */
function paintPixels(plane, style, painter, rgba) {
  for (let pixel = 0, at = 0; at < rgba.length; pixel++, at += 4) {
    const column = pixel % plane.width;
    const row = (pixel - column) / plane.width;
    const rgb = isMiss(plane, style, pixel) ? HATCH[((column + row) >> 2) & 1] : painter(pixel * plane.components);
    rgba[at] = rgb[0];
    rgba[at + 1] = rgb[1];
    rgba[at + 2] = rgb[2];
    rgba[at + 3] = 255;
  }
}

/**
 * The function from the index of a pixel's first value to its colour.
 * @param {Plane} plane
 * @param {import("./channels.js").ChannelStyle} style
 * @param {Display} display
 * @returns {(at: number) => ArrayLike<number>}
 */
function painterOf(plane, style, display) {
  const { values, components } = plane;
  if (style.kind === "ids") return (at) => idColor(values[at]);
  if (style.kind === "direction") return (at) => [0, 1, 2].map((c) => 127.5 * (values[at + c] + 1));
  if (style.kind === "weights") {
    const share = components === 2 ? (/** @type {number} */ v) => v - Math.floor(v) : (/** @type {number} */ v) => v;
    return (at) => [0, 1, 2].map((c) => (c < components ? 255 * share(values[at + c]) : 64));
  }
  if (style.kind === "flow") {
    const most = longest(plane);
    return (at) => flowColor(values[at], values[at + 1], most);
  }
  if (style.kind === "place") {
    const ranges = [0, 1, 2].map((c) => percentiles(plane, c));
    return (at) => ranges.map((range, c) => 255 * shareOfRange(values[at + c], range));
  }
  const range = rangeOf(plane, display);
  const table = mapTable(style.kind === "share" ? "gray" : display.map);
  return (at) => {
    const index = 3 * mapIndex(values[at], range);
    return [table[index], table[index + 1], table[index + 2]];
  };
}

/**
 * The range of values that the colours of a scalar plane show.
 * @param {Plane} plane
 * @param {Display} display
 * @returns {Range}
 */
export function rangeOf(plane, display) {
  if (styleOf(plane).kind === "share") return { low: 0, high: 1, log: false };
  const range = display.range || percentiles(plane, 0);
  return range.log && !(range.low > 0) ? { ...range, low: Math.max(range.high, 1e-30) * 1e-4 } : range;
}

/**
 * The 2nd and 98th percentile of the finite values of a component, from at most 32768 pixels; the smallest and the
 * largest value if both percentiles are the same.
 * @param {Plane} plane
 * @param {number} component
 * @returns {Range}
 */
export function percentiles(plane, component) {
  const { values, components } = plane;
  const step = Math.max(1, Math.floor(values.length / components / SAMPLES_OF_PERCENTILES));
  const taken = [];
  for (let at = component; at < values.length; at += step * components) {
    if (Number.isFinite(values[at])) taken.push(values[at]);
  }
  const sorted = Float64Array.from(taken).sort();
  const [low, high] = [sorted[Math.floor(LOW_SHARE * (sorted.length - 1))], sorted[Math.ceil(HIGH_SHARE * (sorted.length - 1))]];
  // If nearly all values are the same, the range must contain the few other values.
  return low < high ? widened(low, high) : widened(sorted[0], sorted[sorted.length - 1]);
}

/**
 * The smallest and the largest finite value of a scalar plane.
 * @param {Plane} plane
 * @returns {Range}
 */
export function extremes(plane) {
  let low = Infinity;
  let high = -Infinity;
  for (const value of plane.values) {
    if (Number.isFinite(value)) {
      low = Math.min(low, value);
      high = Math.max(high, value);
    }
  }
  return widened(low, high);
}

/**
 * A range that is not empty.
 * @param {number} low
 * @param {number} high
 * @returns {Range}
 */
function widened(low, high) {
  if (!Number.isFinite(low) || !Number.isFinite(high)) return { low: 0, high: 1, log: false };
  return { low, high: high > low ? high : low + Math.max(Math.abs(low), 1e-9) * 1e-3, log: false };
}

/**
 * The 98th percentile of the length of a flow.
 * @param {Plane} plane
 * @returns {number}
 */
export function longest(plane) {
  const { values, width, height } = plane;
  const lengths = new Float64Array(width * height);
  for (let i = 0; i < lengths.length; i++) lengths[i] = Math.hypot(values[2 * i], values[2 * i + 1]);
  return percentiles({ ...plane, components: 1, dtype: "float64", values: lengths }, 0).high;
}
