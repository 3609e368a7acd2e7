// Converts linear radiance to 8-bit sRGB with raycam's view transforms (crates/scene/src/color). Results differ by at most 1 of 255.

/** The names of the view transforms, the same as in `raycam.render`. */
export const VIEW_TRANSFORMS = ["standard", "agx", "pbr_neutral"];

const BUCKETS = 4096;

/** The smallest linear value that is shown with each of the 256 display codes. */
const THRESHOLDS = Float64Array.from({ length: 257 }, (_, code) => (code ? linearOfSrgb((code - 0.5) / 255) : -Infinity));

/** The code at the lower end of each bucket of linear values. */
const CODES = Uint8Array.from({ length: BUCKETS + 1 }, (_, i) => Math.round(255 * srgbOfLinear(i / BUCKETS)));

/**
 * @param {number} v linear, 0 to 1
 * @returns {number} sRGB, 0 to 1
 */
function srgbOfLinear(v) {
  return v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055;
}

/**
 * @param {number} v sRGB, 0 to 1
 * @returns {number} linear, 0 to 1
 */
export function linearOfSrgb(v) {
  return v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
}

/**
 * The 8-bit sRGB code of a linear value. NaN gives 0.
 * @param {number} v
 * @returns {number}
 */
export function srgb8(v) {
  if (!(v > 0)) return 0;
  if (v >= 1) return 255;
  let code = CODES[Math.floor(v * BUCKETS)];
  while (code < 255 && v >= THRESHOLDS[code + 1]) code++;
  return code;
}

/**
 * Writes linear colours as RGBA bytes.
 * @param {ArrayLike<number>} linear three values a pixel
 * @param {number} exposure stops
 * @param {string} view one of `VIEW_TRANSFORMS`
 * @param {Uint8ClampedArray} rgba
 */
export function toneMap(linear, exposure, view, rgba) {
  const scale = 2 ** exposure;
  const shown = [0, 0, 0];
  const transform = view === "agx" ? agx : view === "pbr_neutral" ? pbrNeutral : null;
  for (let i = 0, at = 0; at < rgba.length; i += 3, at += 4) {
    shown[0] = linear[i] * scale;
    shown[1] = linear[i + 1] * scale;
    shown[2] = linear[i + 2] * scale;
    if (transform) transform(shown);
    rgba[at] = srgb8(shown[0]);
    rgba[at + 1] = srgb8(shown[1]);
    rgba[at + 2] = srgb8(shown[2]);
    rgba[at + 3] = 255;
  }
}

/**
 * The value to which a transform is applied: 0 for NaN, and at most the largest float32.
 * @param {number} v
 * @returns {number}
 */
function lightOf(v) {
  return v > 0 ? Math.min(v, 3.4028234663852886e38) : 0;
}

const AGX_LOW = -12.47393;
const AGX_STOPS = 4.026069 - AGX_LOW;

/**
 * @param {number} v
 * @returns {number} the sigmoid over 16.5 stops, 0 to 1
 */
function agxCurve(v) {
  const x = Math.min(Math.max((Math.log2(Math.max(v, 1e-10)) - AGX_LOW) / AGX_STOPS, 0), 1);
  return (((((15.5 * x - 40.14) * x + 31.96) * x - 6.868) * x + 0.4298) * x + 0.1191) * x - 0.00232;
}

/**
 * @param {number} v
 * @returns {number} linear light of a display with exponent 2.2
 */
function agxLinear(v) {
  return Math.min(Math.max(v, 0), 1) ** 2.2;
}

/**
 * AgX (T. Sobotka, 2019) by the fit of B. Wrensch, 2024, in place.
 * @param {number[]} rgb
 */
function agx(rgb) {
  const r = lightOf(rgb[0]);
  const g = lightOf(rgb[1]);
  const b = lightOf(rgb[2]);
  const x = agxCurve(0.84247906 * r + 0.0784336 * g + 0.079223745 * b);
  const y = agxCurve(0.042328242 * r + 0.87846864 * g + 0.07916613 * b);
  const z = agxCurve(0.042375655 * r + 0.0784336 * g + 0.879143 * b);
  rgb[0] = agxLinear(1.196879 * x - 0.09802088 * y - 0.09902974 * z);
  rgb[1] = agxLinear(-0.05289685 * x + 1.1519031 * y - 0.09896118 * z);
  rgb[2] = agxLinear(-0.052971636 * x - 0.09804345 * y + 1.1510737 * z);
}

const NEUTRAL_START = 0.8 - 0.04;
const NEUTRAL_DESATURATION = 0.15;

/**
 * The Khronos PBR Neutral tone mapper, specification 1.0 (2024), in place.
 * @param {number[]} rgb
 */
function pbrNeutral(rgb) {
  for (let i = 0; i < 3; i++) rgb[i] = lightOf(rgb[i]);
  const least = Math.min(rgb[0], rgb[1], rgb[2]);
  const offset = least < 0.08 ? least - 6.25 * least * least : 0.04;
  for (let i = 0; i < 3; i++) rgb[i] -= offset;
  const peak = Math.max(rgb[0], rgb[1], rgb[2]);
  if (peak < NEUTRAL_START) return;
  const d = 1 - NEUTRAL_START;
  const compressed = 1 - (d * d) / (peak + d - NEUTRAL_START);
  const gray = 1 - 1 / (NEUTRAL_DESATURATION * (peak - compressed) + 1);
  for (let i = 0; i < 3; i++) rgb[i] = (rgb[i] * compressed) / peak * (1 - gray) + compressed * gray;
}
