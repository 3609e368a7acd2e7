// Mouse, pen and touch on the picture, as calls of a listener.

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
 * @property {(at: Point) => boolean} grabs true if something that is drawn over the picture is dragged from here
 * @property {(at: Point) => void} dragGrabbed
 */

const CLICK_DISTANCE = 4; // CSS pixels that a click may move
const LONG_PRESS = 550; // ms
const WHEEL_STEP = 100; // CSS pixels of a notch

/**
 * Listens to pointers on a canvas.
 * @param {HTMLCanvasElement} canvas
 * @param {PointerListener} listener
 */
export function listenToPointers(canvas, listener) {
  /** @type {Map<number, Point>} */
  const down = new Map();
  let moved = 0;
  let grabbed = false;
  let pressTimer = 0;
  const place = (/** @type {MouseEvent} */ event) => {
    const box = canvas.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  };

  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
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
      listener.click(place(event), event.altKey);
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
      event.preventDefault();
      const pixels = event.deltaY * [1, 16, 400][event.deltaMode];
      listener.wheel(place(event), -Math.max(-3, Math.min(3, pixels / WHEEL_STEP)), event.ctrlKey || event.metaKey);
    },
    { passive: false },
  );
}
