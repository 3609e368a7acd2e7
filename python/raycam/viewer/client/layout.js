// The initial layout of the live view: panels next to the image, or folded panels if the image would be too small.

const NARROW_SCREEN = "(max-width: 760px)", TWO_COLUMNS = "(max-width: 1000px)";

/**
 * Folds the panel on narrow screens, where it would cover the image, and the tree on screens of at most two columns.
 * @param {boolean} isLive
 */
export function foldPanels(isLive) {
  const sides = matchMedia(NARROW_SCREEN).matches ? ["panel"] : [];
  if (isLive && matchMedia(TWO_COLUMNS).matches) sides.push("tree");
  for (const side of sides) {
    document.body.classList.add(`no-${side}`);
    document.getElementById(`${side}-button`)?.setAttribute("aria-expanded", "false");
  }
}

/**
 * The space for the image.
 * @param {Element} canvas
 * @returns {{ width: number, height: number, ratio: number }} CSS pixels, and device pixels per CSS pixel
 */
export function spaceOf(canvas) {
  const { width, height } = canvas.getBoundingClientRect();
  const whole = (/** @type {number} */ side) => Math.min(Math.max(Math.round(side), 1), 10000);
  return { width: whole(width), height: whole(height), ratio: Math.min(Math.max(devicePixelRatio || 1, 0.1), 10) };
}
