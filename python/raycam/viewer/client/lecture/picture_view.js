// The view of the camera's image with the selected pixel. The reader selects pixels in the image, drags points and the
// sun, and turns and moves the camera.

import { element } from "../dom.js";
import { dot, minus, plusTimes, rowOf } from "../core/vectors.js";
import { pixelOf, rayOfPixel } from "../core/steps.js";
import { drawBulb, drawDot, drawLine, drawRing, drawSun } from "../figure/shapes.js";
import { dragSun, drawMode, isAtForwardEdge, isOutsideRing, MODES, movedCenter, rollCamera, setAngles, sunInPicture, turnCamera } from "./steer.js";
import { GRAB_PX, handleKeys, KEY_MOVE, pick, sharedPicture, withinWorld } from "./views.js";
import { SIZE } from "./world.js";

/** @typedef {import("./figure.js").Figure} Figure */
/** @typedef {import("../figure/board.js").Pen} Pen */
/** @typedef {import("./views.js").Handle} Handle */

const METRES_PER_PX = 0.015, DEPTH_WITHOUT_HIT = 4;

/** Dragging and keys that turn or move the camera. @param {Figure} fig */
function steering({ shared }) {
  const { numbers } = shared;
  /** @type {"turn" | "roll" | "move" | "forward"} */
  let act = "turn";
  let depth = DEPTH_WITHOUT_HIT;
  const moveTo = (/** @type {number[]} */ C) => { numbers.C = withinWorld(C, 0.2); };
  const go = (/** @type {number} */ metres) => moveTo(plusTimes(numbers.C, metres, shared.ray.forward));
  return {
    begin: (/** @type {import("./steer.js").Mode} */ mode, /** @type {number[]} */ pixel) => {
      act = mode === "turn" ? (isOutsideRing(pixel) ? "roll" : "turn") : isAtForwardEdge(pixel) ? "forward" : "move";
      const { winner } = shared.steps;
      depth = winner ? winner.t * dot(shared.ray.r, shared.ray.forward) : DEPTH_WITHOUT_HIT;
    },
    drag: (/** @type {number[]} */ to, /** @type {number[]} */ from) => {
      if (act === "turn") turnCamera(numbers, from, to);
      else if (act === "roll") rollCamera(numbers, from, to);
      else if (act === "move") moveTo(movedCenter(numbers, from, to, depth));
      else go(METRES_PER_PX * (from[1] - to[1]));
    },
    nudge: (/** @type {import("./steer.js").Mode} */ mode, /** @type {number[]} */ [x, y, z]) => {
      if (mode === "turn") return setAngles(numbers, { yaw: numbers.yaw - x, pitch: numbers.pitch + y, roll: numbers.roll + z });
      const { R } = shared.camera;
      moveTo(plusTimes(plusTimes(numbers.C, KEY_MOVE * x, rowOf(R, 0)), KEY_MOVE * y, rowOf(R, 1)));
      go(KEY_MOVE * z);
    },
  };
}

/** Adds the buttons that choose the effect of dragging. @param {Figure} fig @param {HTMLElement} frame @param {() => import("./steer.js").Mode} get @param {(mode: import("./steer.js").Mode) => void} set */
function addModes(fig, frame, get, set) {
  const bar = element("div", "", { class: "modes", role: "toolbar", "aria-label": "Dragging the picture" });
  const buttons = MODES.map(({ mode, text, symbol, title }) => {
    const button = element("button", text, { type: "button", title, "data-symbol": symbol });
    button.addEventListener("click", () => set(mode));
    return button;
  });
  bar.append(...buttons);
  frame.append(bar);
  fig.updates.push(() => buttons.forEach((button, i) => button.setAttribute("aria-pressed", String(get() === MODES[i].mode))));
}

/** Points of the world as handles in the image. @param {Figure} fig @param {() => Handle[]} handles @param {() => number} scaleOf */
function pictureHandles({ shared }, handles, scaleOf) {
  const place = (/** @type {number} */ u, /** @type {number} */ v) => [(u + 0.5) * scaleOf(), (v + 0.5) * scaleOf()];
  const pixelAt = (/** @type {number[]} */ at) => at.map((value) => value / scaleOf() - 0.5);
  const placeOf = (/** @type {Handle} */ handle) => {
    if (handle.glows === "sun") {
      const [u, v] = sunInPicture(shared.numbers).pixel;
      return place(u, v);
    }
    const { u, v, inFront } = pixelOf(shared.camera.P, handle.get());
    return inFront ? place(u, v) : [-99, -99];
  };
  const moveTo = (/** @type {Handle} */ handle, /** @type {number[]} */ to, /** @type {number[]} */ from) => {
    if (handle.glows === "sun") dragSun(shared.numbers, from, to);
    else {
      const { r, C, forward } = rayOfPixel(shared.camera.P, to[0], to[1]);
      handle.set(plusTimes(C, dot(minus(handle.get(), C), forward) / dot(r, forward), r));
    }
    shared.changed();
  };
  const nearest = (/** @type {number[]} */ at) => handles().find((handle) => {
    const [x, y] = placeOf(handle);
    return Math.hypot(x - at[0], y - at[1]) < GRAB_PX;
  }) || null;
  return { place, pixelAt, placeOf, moveTo, nearest };
}

/**
 * Adds the image. A click selects the pixel, corners are dragged at their depth, arrow keys move the pixel. Buttons on the
 * image make dragging and the arrow keys turn or move the camera.
 * @param {Figure} fig
 * @param {{ label?: string, handles?: () => Handle[], overlay?: (pen: Pen, place: (u: number, v: number) => number[]) => void, image?: () => HTMLCanvasElement | null }} [options]
 */
export function addPicture(fig, { label = "The picture", handles: given, overlay, image = () => sharedPicture(fig) } = {}) {
  const { shared } = fig;
  const handles = given || (() => []);
  let scale = 1;
  /** @type {import("./steer.js").Mode} */
  let mode = "pixel";
  const keys = handleKeys(handles);
  const { place, pixelAt, placeOf, moveTo, nearest } = pictureHandles(fig, handles, () => scale);
  const steer = steering(fig);
  /** @type {Handle | null} */
  let held = null;
  const setMode = (/** @type {import("./steer.js").Mode} */ chosen) => {
    mode = chosen;
    shared.redraw();
  };
  const canvas = fig.canvas({
    ratio: SIZE[1] / SIZE[0],
    label: `${label}. Click to select a pixel; the arrow keys move it${given ? ", and Enter selects a point that they move" : ""}. After T they turn the camera, after M they move it, and Page Up and Page Down roll it or move it forward and back; P returns to the pixel.`,
    draw: (pen) => {
      scale = pen.width / SIZE[0];
      drawImage(pen, image());
      overlay?.(pen, place);
      drawMode(pen, mode);
      handles().forEach((handle, i) => drawPictureHandle(pen, handle, placeOf(handle), keys.isSelected(i), shared.numbers));
      const pixel = place(shared.numbers.pixel[0], shared.numbers.pixel[1]);
      drawPixel(pen, pixel);
      pen.avoid(pixel);
      pen.touch("x", [pixel]);
    },
    isHandle: (at) => nearest(at) !== null,
    grab: (at) => {
      held = nearest(at);
      if (held) return true;
      if (mode === "pixel") pick(fig, pixelAt(at));
      else steer.begin(mode, pixelAt(at));
      return true;
    },
    drag: (at, from) => {
      if (held) return moveTo(held, pixelAt(at), pixelAt(from));
      if (mode === "pixel") return pick(fig, pixelAt(at));
      steer.drag(pixelAt(at), pixelAt(from));
      shared.changed();
    },
    next: given && keys.next,
    key: (key) => {
      const chosen = MODES.find((each) => each.key === key.toLowerCase());
      if (chosen) setMode(chosen.mode);
      return Boolean(chosen);
    },
    nudge: ([x, y, z]) => {
      const handle = keys.get();
      if (handle) {
        const [u, v] = pixelAt(placeOf(handle));
        return moveTo(handle, [u + x, v + y], [u, v]);
      }
      if (mode === "pixel") return pick(fig, [shared.numbers.pixel[0] + x, shared.numbers.pixel[1] + y]);
      steer.nudge(mode, [x, y, z]);
      shared.changed();
    },
  });
  addModes(fig, /** @type {HTMLElement} */ (canvas.parentElement), () => mode, setMode);
}

/** @param {Pen} pen @param {HTMLCanvasElement | null} canvas */
function drawImage(pen, canvas) {
  pen.ctx.imageSmoothingEnabled = false;
  if (canvas) pen.ctx.drawImage(canvas, 0, 0, pen.width, pen.height);
  else drawLine(pen, [[0, 0], [pen.width, 0], [pen.width, pen.height], [0, pen.height]], { color: "soft", fill: "soft", close: true });
}

/** @param {Pen} pen @param {Handle} handle @param {number[]} at @param {boolean} isSelected @param {import("./world.js").Numbers} numbers */
function drawPictureHandle(pen, handle, at, isSelected, numbers) {
  const isLarge = isSelected || pen.lit(handle.symbol);
  if (handle.glows === "sun") {
    const { isInside } = sunInPicture(numbers);
    const away = Math.atan2(at[1] - pen.height / 2, at[0] - pen.width / 2);
    drawSun(pen, at, isLarge ? 10 : 8, isInside ? undefined : away);
  } else if (handle.glows) drawBulb(pen, at, isLarge ? 9 : 6);
  else {
    drawRing(pen, at, handle.color, isLarge ? 13 : 11);
    drawDot(pen, at, handle.color, isLarge ? 8 : 6);
  }
  pen.touch(handle.symbol, [at]);
  pen.label({ at, text: handle.text || "", symbol: handle.symbol });
}

/** The mark of the selected pixel. @param {Pen} pen @param {number[]} at */
export function drawPixel(pen, [x, y]) {
  const half = pen.lit("x") ? 8 : 5;
  const square = [[x - half, y - half], [x + half, y - half], [x + half, y + half], [x - half, y + half]];
  drawLine(pen, square, { color: "white", width: 4, close: true });
  drawLine(pen, square, { color: "#d32f2f", width: 2, close: true });
}
