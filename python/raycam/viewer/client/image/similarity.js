// Measures of how similar two images look: PSNR and SSIM of their sRGB bytes, as displayed.

const RADIUS = 5, SIGMA = 1.5; // radius and standard deviation of the window in pixels: 11 x 11 as in the paper
const C1 = (0.01 * 255) ** 2, C2 = (0.03 * 255) ** 2;

/**
 * The peak signal-to-noise ratio of two images of the same size, in dB; infinity for equal images.
 * @param {Uint8ClampedArray} a RGBA bytes
 * @param {Uint8ClampedArray} b
 * @returns {number}
 */
export function psnrOf(a, b) {
  let squares = 0;
  for (let at = 0; at < a.length; at++) if (at % 4 !== 3) squares += (a[at] - b[at]) ** 2;
  return 10 * Math.log10(255 ** 2 / (squares / ((a.length / 4) * 3)));
}

/**
 * The mean structural similarity of the luma of two images (Wang, Bovik, Sheikh, Simoncelli 2004): Gaussian windows,
 * without the margin of half a window. NaN for images that are smaller than a window.
 * @param {Uint8ClampedArray} a RGBA bytes
 * @param {Uint8ClampedArray} b
 * @param {number} width
 * @returns {number}
 */
export function ssimOf(a, b, width) {
  const [x, y] = [a, b].map(lumaOf);
  const height = x.length / width;
  if (Math.min(width, height) <= 2 * RADIUS) return NaN;
  const product = (/** @type {Float64Array} */ p, /** @type {Float64Array} */ q) => p.map((value, i) => value * q[i]);
  const [mx, my, xx, yy, xy] = [x, y, product(x, x), product(y, y), product(x, y)].map((each) => blurred(each, width));
  let sum = 0;
  for (let i = 0; i < mx.length; i++) {
    const [vx, vy, cov] = [xx[i] - mx[i] ** 2, yy[i] - my[i] ** 2, xy[i] - mx[i] * my[i]];
    sum += ((2 * mx[i] * my[i] + C1) * (2 * cov + C2)) / ((mx[i] ** 2 + my[i] ** 2 + C1) * (vx + vy + C2));
  }
  return sum / mx.length;
}

/** @param {Uint8ClampedArray} rgba @returns {Float64Array} luma of Rec. 601 */
function lumaOf(rgba) {
  return Float64Array.from({ length: rgba.length / 4 }, (_, i) => 0.299 * rgba[4 * i] + 0.587 * rgba[4 * i + 1] + 0.114 * rgba[4 * i + 2]);
}

/** @param {Float64Array} values @param {number} width @returns {Float64Array} the means in windows that lie inside */
function blurred(values, width) {
  const weights = Array.from({ length: 2 * RADIUS + 1 }, (_, i) => Math.exp(-((i - RADIUS) ** 2) / (2 * SIGMA ** 2)));
  const total = weights.reduce((sum, each) => sum + each);
  const [height, narrow] = [values.length / width, width - 2 * RADIUS];
  const across = new Float64Array(narrow * height);
  for (let row = 0; row < height; row++) {
    for (let column = 0; column < narrow; column++) {
      let sum = 0;
      for (let i = 0; i < weights.length; i++) sum += weights[i] * values[row * width + column + i];
      across[row * narrow + column] = sum / total;
    }
  }
  const out = new Float64Array(narrow * (height - 2 * RADIUS));
  for (let at = 0; at < out.length; at++) {
    let sum = 0;
    for (let i = 0; i < weights.length; i++) sum += weights[i] * across[at + i * narrow];
    out[at] = sum / total;
  }
  return out;
}
