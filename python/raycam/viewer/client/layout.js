// The initial layout of the live view: panels next to the image, or folded panels on narrow screens.

const NARROW_SCREEN = "(max-width: 760px)";

/** Folds the panels on narrow screens, where they would cover the image. @param {boolean} isLive */
export function foldPanels(isLive) {
  if (!matchMedia(NARROW_SCREEN).matches) return;
  for (const side of isLive ? ["panel", "tree"] : ["panel"]) {
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
