// The layout of the live view: panels next to the image, or folded panels if the image would be too small.

const NARROW_SCREEN = "(max-width: 760px)", TWO_COLUMNS = "(max-width: 1000px)";

/**
 * Folds the panel on narrow screens, where it would cover the image, and the tree on screens of at most two columns.
 * Unfolds them again when the window is widened.
 * @param {boolean} isLive
 */
export function foldPanels(isLive) {
  foldSide("panel", matchMedia(NARROW_SCREEN));
  if (isLive) foldSide("tree", matchMedia(TWO_COLUMNS));
}

/** @param {string} side "panel" or "tree" @param {MediaQueryList} narrow the screens on which it is folded */
function foldSide(side, narrow) {
  const { classList } = document.body;
  let isOpenOnWide = !classList.contains(`no-${side}`);
  const adapt = () => {
    if (narrow.matches) isOpenOnWide = !classList.contains(`no-${side}`);
    else if (!isOpenOnWide) return;
    classList.toggle(`no-${side}`, narrow.matches);
    document.getElementById(`${side}-button`)?.setAttribute("aria-expanded", String(!narrow.matches));
  };
  narrow.addEventListener("change", adapt);
  if (narrow.matches) adapt();
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
