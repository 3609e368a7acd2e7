// Colour maps: viridis, turbo and gray for scalars, distinct colours for ids, a wheel for flow.

import { linearOfSrgb, srgb8 } from "./tone.js";

/** The anchors of each map, evenly spaced; colours between two are interpolated linearly in sRGB. */
const ANCHORS = {
  diverging: "2166ac 67a9cf d1e5f0 f7f7f7 fddbc7 ef8a62 b2182b",
  // Source: S. van der Walt and N. Smith, 2015.
  viridis: "440154 482878 3e4989 31688e 26828e 1f9e89 35b779 6ece58 b5de2b fde725",
  // Source: A. Mikhailov, 2019.
  turbo: "30123b 4145ab 4675ed 39a2fc 1bcfd4 24eca6 61fc6c a4fc3b d1e834 f3c63a fe9b2d f36315 d93806 b11901 7a0402",
  gray: "000000 ffffff",
};

/** The names of the maps. */
export const MAPS = Object.keys(ANCHORS);

const MAP_SIZE = 1024;
/** @type {Map<string, Uint8Array>} */
const tables = new Map();

/**
 * The 1024 colours of a map, three bytes each.
 * @param {string} name
 * @returns {Uint8Array}
 */
export function mapTable(name) {
  const known = tables.get(name);
  if (known) return known;
  const anchors = ANCHORS[/** @type {keyof typeof ANCHORS} */ (name)].split(" ").map(bytesOfHex);
  const table = new Uint8Array(3 * MAP_SIZE);
  for (let i = 0; i < MAP_SIZE; i++) {
    const at = (i / (MAP_SIZE - 1)) * (anchors.length - 1);
    const left = Math.min(Math.floor(at), anchors.length - 2);
    for (let c = 0; c < 3; c++) {
      table[3 * i + c] = Math.round(anchors[left][c] + (at - left) * (anchors[left + 1][c] - anchors[left][c]));
    }
  }
  tables.set(name, table);
  return table;
}

/**
 * @param {string} hex
 * @returns {number[]}
 */
function bytesOfHex(hex) {
  return [0, 2, 4].map((at) => parseInt(hex.slice(at, at + 2), 16));
}

/**
 * The share of a range that lies below a value. It is computed from halved numbers, because the width of a range may overflow to infinity.
 * @param {number} value
 * @param {{ low: number, high: number }} range
 * @returns {number}
 */
export function shareOfRange(value, { low, high }) {
  return high - low < Infinity ? (value - low) / (high - low) : (value / 2 - low / 2) / (high / 2 - low / 2);
}

/**
 * The index of a value in a colour map for a range. Values outside the range get the first or the last index.
 * @param {number} value
 * @param {{ low: number, high: number, log: boolean }} range
 * @returns {number}
 */
export function mapIndex(value, range) {
  const [low, high] = [Math.log(range.low), Math.log(range.high)];
  const share = range.log ? (Math.log(value) - low) / (high - low) : shareOfRange(value, range);
  return Math.round(Math.min(Math.max(share || 0, 0), 1) * (MAP_SIZE - 1));
}

/** @type {Map<number, number[]>} */
const idColors = new Map();

/**
 * The colour of an id >= 0: hues by the golden ratio, at four levels of lightness, so that neighbours differ in both.
 * @param {number} id
 * @returns {number[]} sRGB bytes
 */
export function idColor(id) {
  let color = idColors.get(id);
  if (!color) {
    color = oklch(0.5 + 0.12 * ((id * 3) % 4), 0.13, 2 * Math.PI * ((0.08 + id * 0.61803398875) % 1));
    idColors.set(id, color);
  }
  return color;
}

/**
 * The colour of a motion: its direction is the hue, its length the chroma and darkness.
 * @param {number} dx
 * @param {number} dy
 * @param {number} most the length that has the full colour
 * @returns {number[]} sRGB bytes
 */
export function flowColor(dx, dy, most) {
  const share = Math.min(Math.hypot(dx, dy) / most, 1) || 0;
  return oklch(0.97 - 0.3 * share, 0.15 * share, Math.atan2(dy, dx));
}

/**
 * A colour of OKLCH (B. Ottosson, 2020), clipped to sRGB.
 * @param {number} lightness
 * @param {number} chroma
 * @param {number} hue radians
 * @returns {number[]} sRGB bytes
 */
function oklch(lightness, chroma, hue) {
  const a = chroma * Math.cos(hue);
  const b = chroma * Math.sin(hue);
  const l = (lightness + 0.3963377774 * a + 0.2158037573 * b) ** 3;
  const m = (lightness - 0.1055613458 * a - 0.0638541728 * b) ** 3;
  const s = (lightness - 0.0894841775 * a - 1.291485548 * b) ** 3;
  return [
    srgb8(4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s),
    srgb8(-1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s),
    srgb8(-0.0041960863 * l - 0.7034186147 * m + 1.707614701 * s),
  ];
}

/**
 * Black or white, whichever is easier to read on a colour.
 * @param {ArrayLike<number>} rgb sRGB bytes
 * @returns {string}
 */
export function inkOn(rgb) {
  const [r, g, b] = [rgb[0], rgb[1], rgb[2]].map((v) => linearOfSrgb(v / 255));
  return 0.2126 * r + 0.7152 * g + 0.0722 * b > 0.18 ? "#000" : "#fff";
}
