// Turns mouse, pen and touch input on the image into calls of a listener.

/** @typedef {{ x: number, y: number }} Point CSS pixels from the canvas' left top corner */
/**
 * @typedef {object} PointerListener
 * @property {(at: Point) => void} hover
 * @property {() => void} away
 * @property {(at: Point, explain: boolean) => void} click
 * @property {(at: Point) => void} doubleClick
 * @property {(at: Point, dx: number, dy: number, pans: boolean) => void} drag
 * @property {(at: Point, steps: number, magnifies: boolean) => void} wheel steps > 0 come nearer
 * @property {(at: Point, factor: number, dx: number, dy: number) => void} pinch
 * @property {(at: Point) => boolean} grabs true if something that is drawn over the image is dragged from here
 * @property {(at: Point) => void} dragGrabbed
 */

const CLICK_DISTANCE = 4; // CSS pixels that the pointer may move during a click
const LONG_PRESS = 550; // milliseconds after which a touch is a long press
const WHEEL_STEP = 100; // CSS pixels that one notch of the wheel scrolls
const DOUBLE_CLICK = 500; // maximum milliseconds between the two clicks of a double click

/**
 * Listens to pointers on a canvas.
 * @param {HTMLCanvasElement} canvas
 * @param {PointerListener} listener
 * @param {boolean} isEmbedded true in a page within another page: the wheel scrolls that page until the image is clicked
 */
export function listenToPointers(canvas, listener, isEmbedded = false) {
  /** @type {Map<number, Point>} */
  const down = new Map();
  let moved = 0;
  let grabbed = false;
  let pressTimer = 0;
  let usesWheel = !isEmbedded;
  let clicked = { time: -Infinity, x: 0, y: 0 };
  if (isEmbedded) addEventListener("blur", () => (usesWheel = false));
  const place = (/** @type {MouseEvent} */ event) => {
    const box = canvas.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  };

  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    usesWheel = true;
    const at = place(event);
    down.set(event.pointerId, at);
    moved = down.size > 1 ? Infinity : 0;
    grabbed = down.size === 1 && event.button === 0 && listener.grabs(at);
    clearTimeout(pressTimer);
    if (event.pointerType === "touch") {
      pressTimer = setTimeout(() => {
        if (moved < CLICK_DISTANCE) listener.click(at, true);
        moved = Infinity;
      }, LONG_PRESS);
    }
  });
  canvas.addEventListener("pointermove", (event) => {
    const at = place(event);
    const before = down.get(event.pointerId);
    if (!before) return listener.hover(at);
    const [dx, dy] = [at.x - before.x, at.y - before.y];
    if (down.size === 2) {
      const other = /** @type {Point} */ ([...down].find(([id]) => id !== event.pointerId)?.[1]);
      const factor = Math.hypot(at.x - other.x, at.y - other.y) / Math.hypot(before.x - other.x, before.y - other.y);
      listener.pinch({ x: (at.x + other.x) / 2, y: (at.y + other.y) / 2 }, factor || 1, dx / 2, dy / 2);
    } else {
      moved += Math.hypot(dx, dy);
      if (grabbed) listener.dragGrabbed(at);
      else if (moved >= CLICK_DISTANCE) listener.drag(at, dx, dy, event.shiftKey || (event.buttons & 6) !== 0);
      else return;
    }
    down.set(event.pointerId, at);
  });
  const up = (/** @type {PointerEvent} */ event) => {
    clearTimeout(pressTimer);
    if (down.delete(event.pointerId) && moved < CLICK_DISTANCE && event.type === "pointerup" && event.button === 0) {
      const [at, time] = [place(event), performance.now()];
      const isSecond = time - clicked.time < DOUBLE_CLICK && Math.hypot(at.x - clicked.x, at.y - clicked.y) < CLICK_DISTANCE;
      clicked = { time: isSecond ? -Infinity : time, ...at };
      if (!isSecond) listener.click(at, event.altKey);
    }
  };
  canvas.addEventListener("pointerup", up);
  canvas.addEventListener("pointercancel", up);
  canvas.addEventListener("pointerleave", () => listener.away());
  canvas.addEventListener("dblclick", (event) => listener.doubleClick(place(event)));
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener(
    "wheel",
    (event) => {
      if (!usesWheel && !event.ctrlKey && !event.metaKey) return;
      event.preventDefault();
      if (Math.abs(event.deltaY) <= Math.abs(event.deltaX)) return; // a horizontal swipe does not zoom
      const pixels = event.deltaY * [1, 16, 400][event.deltaMode];
      listener.wheel(place(event), -Math.max(-3, Math.min(3, pixels / WHEEL_STEP)), event.ctrlKey || event.metaKey);
    },
    { passive: false },
  );
}
