// A link to the current view: camera, lens, channel, display, time and held pixel, as text in the fragment of the
// address.

/**
 * @typedef {object} Seen
 * @property {string} camera the name of the camera; for a free camera, the name of the camera that it started from, or ""
 * @property {boolean} free true if the camera was moved
 * @property {number[]} R camera_from_world, row by row
 * @property {number[]} C metres
 * @property {number} focal the focal length of parallel rays, image pixels
 * @property {number[]} pivot metres
 * @property {number[]} lens fx, fy, cx, cy in pixels of the camera's own size, then the distortion
 * @property {number[]} size the camera's own size
 * @property {string} channel
 * @property {number} exposure stops
 * @property {string} view the view transform
 * @property {number} time seconds
 * @property {string} animation
 * @property {string} variant
 * @property {string} integrator
 * @property {number[] | null} pixel the held pixel's centre relative to the image, in x and y from 0 to 1
 */

const LONGEST_SEEN = 8192; // maximum characters of a view in a link
/** The minimum and the maximum number of values in each list. */
const LIST_LENGTHS = /** @type {const} */ ({ R: [9, 9], C: [3, 3], pivot: [3, 3], lens: [4, 36], size: [2, 2] });
const LINK_TEXTS = /** @type {const} */ (["camera", "channel", "view", "animation", "variant", "integrator"]);
const LINK_NUMBERS = /** @type {const} */ (["focal", "exposure", "time"]);

/** @param {Seen} seen @returns {string} text of letters, digits, "-" and "_" */
export function linkText(seen) {
  const bytes = new TextEncoder().encode(JSON.stringify(seen));
  return btoa(String.fromCharCode(...bytes)).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
}

/** @param {string} text of a link @returns {Seen | null} null if it is damaged */
export function seenOf(text) {
  if (text.length > LONGEST_SEEN) return null;
  try {
    const bytes = Uint8Array.from(atob(text.replaceAll("-", "+").replaceAll("_", "/")), (each) => each.charCodeAt(0));
    const seen = JSON.parse(new TextDecoder().decode(bytes));
    const lists = Object.entries(LIST_LENGTHS).every(([name, [least, most]]) => areNumbers(seen[name], least, most));
    const texts = LINK_TEXTS.every((name) => typeof seen[name] === "string");
    const numbers = LINK_NUMBERS.every((name) => Number.isFinite(seen[name]));
    const pixel = seen.pixel === null || areNumbers(seen.pixel, 2, 2);
    return lists && texts && numbers && pixel && typeof seen.free === "boolean" ? seen : null;
  } catch {
    return null;
  }
}

/** @param {unknown} list @param {number} least @param {number} most how many numbers */
function areNumbers(list, least, most) {
  return Array.isArray(list) && list.length >= least && list.length <= most && list.every(Number.isFinite);
}

/**
 * The intrinsics of a link for a camera of another size, such as the camera of a window with another shape. The vertical field of view stays the same.
 * @param {Seen} seen
 * @param {number[]} size the camera's own size now
 * @param {number} corner the image's left and top edge in pixel coordinates: -0.5 if integers are the centres of pixels
 * @returns {number[]} fx, fy, cx, cy, then the distortion
 */
export function lensFor({ lens: [fx, fy, cx, cy, ...distortion], size: before }, size, corner) {
  const scale = size[1] / before[1];
  const moved = (/** @type {number} */ center, /** @type {number} */ i) => scale * (center - corner - before[i] / 2) + size[i] / 2 + corner;
  return [fx * scale, fy * scale, moved(cx, 0), moved(cy, 1), ...distortion];
}
