// FLIP: the perceptual difference of two images that alternate on a screen, for images of sRGB bytes.
// P. Andersson, J. Nilsson, T. Akenine-Möller, M. Oskarsson, K. Åström, M. D. Fairchild, "FLIP: A Difference Evaluator for
// Alternating Images", 2020. The constants have the names of the paper.

import { linearOfSrgb } from "./tone.js";

const PIXELS_PER_DEGREE = (0.7 * 3840 * Math.PI) / (0.7 * 180); // for a screen 0.7 m wide with 3840 columns, viewed from 0.7 m
const QC = 0.7, PC = 0.4, PT = 0.95, QF = 0.5, FEATURE_WIDTH = 0.082; // the paper's constants; the width is in degrees
/** The contrast sensitivity of Y, Cx and Cz: the sums of two Gaussians a sqrt(pi / b) exp(-pi² x² / b). */
const SENSITIVITY = [[1, 0.0047, 0, 1e-5], [1, 0.0053, 0, 1e-5], [34.1, 0.04, 13.5, 0.025]];
const XYZ_OF_RGB = [
  [10135552 / 24577794, 8788810 / 24577794, 4435075 / 24577794],
  [2613072 / 12288897, 8788810 / 12288897, 887015 / 12288897],
  [1425312 / 73733382, 8788810 / 73733382, 70074185 / 73733382],
];
const WHITE = XYZ_OF_RGB.map((row) => row[0] + row[1] + row[2]);
const RGB_OF_XYZ = inverse(XYZ_OF_RGB);

/** @typedef {Float64Array[]} Channels three planes of an image */

/**
 * The FLIP error of each pixel, from 0 (equal) to 1.
 * @param {Uint8ClampedArray} a RGBA bytes of the reference
 * @param {Uint8ClampedArray} b RGBA bytes
 * @param {number} width
 * @returns {Float64Array}
 */
export function flipOf(a, b, width) {
  const images = [a, b].map(opponentOf);
  const [p, q] = images.map((image) => huntLab(filtered(image, width)));
  const [f, g] = images.map(([y]) => featuresOf(y, width));
  const most = hyab(huntOfRgb([0, 1, 0]), huntOfRgb([0, 0, 1])) ** QC;
  return p[0].map((_, i) => {
    const distance = hyab([p[0][i], p[1][i], p[2][i]], [q[0][i], q[1][i], q[2][i]]) ** QC;
    const color = distance < PC * most ? (PT / (PC * most)) * distance : PT + ((distance - PC * most) / (most - PC * most)) * (1 - PT);
    const feature = (Math.max(Math.abs(f[0][i] - g[0][i]), Math.abs(f[1][i] - g[1][i])) / Math.SQRT2) ** QF;
    return color ** (1 - feature);
  });
}

/** @param {number[][]} m @returns {number[][]} */
function inverse([[a, b, c], [d, e, f], [g, h, i]]) {
  const det = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g);
  return [
    [e * i - f * h, c * h - b * i, b * f - c * e], [f * g - d * i, a * i - c * g, c * d - a * f], [d * h - e * g, b * g - a * h, a * e - b * d],
  ].map((row) => row.map((value) => value / det));
}

/** @param {number[][]} matrix @param {number} x @param {number} y @param {number} z @returns {number[]} */
const times = (matrix, x, y, z) => matrix.map((row) => row[0] * x + row[1] * y + row[2] * z);

/** YCxCz of sRGB bytes. @param {Uint8ClampedArray} rgba @returns {Channels} */
function opponentOf(rgba) {
  const linear = Float64Array.from({ length: 256 }, (_, byte) => linearOfSrgb(byte / 255));
  const out = [0, 1, 2].map(() => new Float64Array(rgba.length / 4));
  for (let i = 0; i < out[0].length; i++) {
    const [x, y, z] = times(XYZ_OF_RGB, linear[rgba[4 * i]], linear[rgba[4 * i + 1]], linear[rgba[4 * i + 2]]).map((value, c) => value / WHITE[c]);
    out[0][i] = 116 * y - 16;
    out[1][i] = 500 * (x - y);
    out[2][i] = 200 * (y - z);
  }
  return out;
}

/** The image filtered by the eye's contrast sensitivity, in YCxCz. @param {Channels} image @param {number} width @returns {Channels} */
function filtered(image, width) {
  const widest = Math.max(...SENSITIVITY.flatMap(([, b1, , b2]) => [b1, b2]));
  const radius = Math.ceil(3 * Math.sqrt(widest / (2 * Math.PI ** 2)) * PIXELS_PER_DEGREE);
  return image.map((plane, channel) => {
    const [a1, b1, a2, b2] = SENSITIVITY[channel];
    const parts = [[a1, b1], [a2, b2]].filter(([a]) => a > 0).map(([a, b]) => {
      const kernel = Float64Array.from({ length: 2 * radius + 1 }, (_, i) => Math.exp((-(Math.PI ** 2) * ((i - radius) / PIXELS_PER_DEGREE) ** 2) / b));
      const sum = kernel.reduce((total, each) => total + each, 0);
      return { kernel, weight: a * Math.sqrt(Math.PI / b), sum };
    });
    const total = parts.reduce((sum, each) => sum + each.weight * each.sum ** 2, 0);
    const out = new Float64Array(plane.length);
    for (const { kernel, weight } of parts) {
      convolved(plane, width, kernel, kernel).forEach((value, i) => (out[i] += (weight / total) * value));
    }
    return out;
  });
}

/** CIELAB with the Hunt effect, of an image in YCxCz. @param {Channels} image @returns {Channels} */
function huntLab(image) {
  const out = image.map((plane) => new Float64Array(plane.length));
  for (let i = 0; i < out[0].length; i++) {
    const y = (image[0][i] + 16) / 116;
    const rgb = times(RGB_OF_XYZ, (image[1][i] / 500 + y) * WHITE[0], y * WHITE[1], (y - image[2][i] / 200) * WHITE[2]);
    huntOfRgb(rgb).forEach((value, c) => (out[c][i] = value));
  }
  return out;
}

/** @param {number[]} rgb linear, clamped to 0 to 1 @returns {number[]} */
function huntOfRgb(rgb) {
  const [r, g, b] = rgb.map((value) => Math.min(Math.max(value, 0), 1));
  const [x, y, z] = times(XYZ_OF_RGB, r, g, b).map((value, c) => labOf(value / WHITE[c]));
  const lightness = 116 * y - 16;
  return [lightness, 0.01 * lightness * 500 * (x - y), 0.01 * lightness * 200 * (y - z)];
}

/** @param {number} t @returns {number} */
function labOf(t) {
  const delta = 6 / 29;
  return t > delta ** 3 ? Math.cbrt(t) : t / (3 * delta ** 2) + 4 / 29;
}

/** @param {number[]} p @param {number[]} q @returns {number} */
function hyab(p, q) {
  return Math.abs(p[0] - q[0]) + Math.hypot(p[1] - q[1], p[2] - q[2]);
}

/** The strengths of edges and of points in a plane of Y. @param {Float64Array} y @param {number} width @returns {Float64Array[]} */
function featuresOf(y, width) {
  const sd = 0.5 * FEATURE_WIDTH * PIXELS_PER_DEGREE;
  const radius = Math.ceil(3 * sd);
  const places = Float64Array.from({ length: 2 * radius + 1 }, (_, i) => i - radius);
  const gauss = places.map((x) => Math.exp(-(x ** 2) / (2 * sd ** 2)));
  const total = gauss.reduce((sum, each) => sum + each, 0);
  const blur = gauss.map((each) => each / total);
  const plane = y.map((value) => (value + 16) / 116);
  return [(/** @type {number} */ x) => -x, (/** @type {number} */ x) => x ** 2 / sd ** 2 - 1].map((shape) => {
    const kernel = balanced(places.map((x, i) => shape(x) * gauss[i]));
    const across = convolved(plane, width, kernel, blur);
    const down = convolved(plane, width, blur, kernel);
    return across.map((value, i) => Math.hypot(value, down[i]));
  });
}

/** A kernel, scaled so that its positive weights sum to 1 and its negative weights to -1. @param {Float64Array} kernel */
function balanced(kernel) {
  const [up, down] = [1, -1].map((sign) => kernel.reduce((sum, each) => sum + Math.max(sign * each, 0), 0));
  return kernel.map((each) => each / (each > 0 ? up : down));
}

/**
 * A plane filtered along rows, then along columns; pixels outside have the value of the edge.
 * @param {Float64Array} plane @param {number} width @param {Float64Array} across @param {Float64Array} down
 * @returns {Float64Array}
 */
function convolved(plane, width, across, down) {
  const height = plane.length / width;
  const radius = (across.length - 1) / 2;
  const middle = new Float64Array(plane.length);
  const out = new Float64Array(plane.length);
  for (let row = 0, at = 0; row < height; row++) {
    for (let column = 0; column < width; column++, at++) {
      let sum = 0;
      for (let i = 0; i < across.length; i++) {
        sum += across[i] * plane[row * width + Math.min(Math.max(column + i - radius, 0), width - 1)];
      }
      middle[at] = sum;
    }
  }
  for (let row = 0, at = 0; row < height; row++) {
    for (let column = 0; column < width; column++, at++) {
      let sum = 0;
      for (let i = 0; i < down.length; i++) {
        sum += down[i] * middle[Math.min(Math.max(row + i - radius, 0), height - 1) * width + column];
      }
      out[at] = sum;
    }
  }
  return out;
}
