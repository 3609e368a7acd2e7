// The two views that most figures show: the picture with the selected pixel, and the world from outside.

import { dot, minus, plusTimes, rowOf } from "../core/vectors.js";
import { pixelOf, rayOfPixel } from "../core/steps.js";
import { OutsideView } from "../figure/outside.js";
import { drawDot, drawLine } from "../figure/shapes.js";
import { cameraOf } from "./camera.js";
import { FLOOR, SIZE, toSun, worldText } from "./world.js";

/** @typedef {import("./figure.js").Figure} Figure */
/** @typedef {import("../figure/board.js").Pen} Pen */

const GRAB_PX = 16, IMAGE_DISTANCE = 1.5, KEY_MOVE = 0.05, SUN_FOOT = [-1.6, 0.9, 0], SUN_AWAY = 4.2;
/** The newest flat picture of the shared world. @type {{ canvas: HTMLCanvasElement | null }} */
const SHARED_PICTURE = { canvas: null };

/** Requests the flat picture of the shared world. @param {Figure} fig @returns {HTMLCanvasElement | null} the newest one */
export function sharedPicture({ shared, pictures }) {
  const wanted = { text: worldText(shared.numbers), width: SIZE[0], height: SIZE[1], integrator: "flat", samples: 1 };
  pictures.request("shared", wanted, {
    onPicture: ({ canvas }) => {
      SHARED_PICTURE.canvas = canvas;
      document.documentElement.dataset.picture = "true";
      shared.redraw();
    },
  });
  return SHARED_PICTURE.canvas;
}

/** A handle that is dragged in both views. @typedef {{ get: () => number[], set: (point: number[]) => void, color: string, symbol?: string, text?: string }} Handle */

/** A point that a reader drags: above a height, within 6 units of the origin, in steps of 0.001. @param {number[]} point @param {number} lowest */
export const withinWorld = ([x, y, z], lowest) => [x, y, Math.max(lowest, z)].map((value) => Math.max(-6, Math.min(6, Math.round(value * 1000) / 1000)));

/** The handle of the camera's centre. @param {Figure} fig @returns {Handle} */
export function centerHandle({ shared }) {
  return { get: () => shared.numbers.C, color: "C", symbol: "C", text: "C", set: (point) => { shared.numbers.C = withinWorld(point, 0.2); } };
}

/** The handle of the bulb. @param {Figure} fig @returns {Handle} */
export function bulbHandle({ shared }) {
  return { get: () => shared.numbers.bulb, color: "L", symbol: "L", text: "bulb", set: (point) => { shared.numbers.bulb = withinWorld(point, 0.2); } };
}

/** The handle of one vertex of the green triangle. @param {Figure} fig @param {number} k @param {Partial<Handle>} [look] @returns {Handle} */
export function vertexHandle({ shared }, k, look = {}) {
  const { corners } = shared.numbers.triangles[0];
  return { get: () => corners[k], color: "a", symbol: "abc"[k], text: "abc"[k], set: (point) => { corners[k] = withinWorld(point, 0); }, ...look };
}

/** Parallel rays of the sun above the floor. @param {Figure} fig @returns {import("../figure/outside.js").Stroke[]} */
export function sunStrokes({ shared }) {
  const sun = toSun(shared.numbers);
  return [-1, 0, 1].map((i) => {
    const at = [SUN_FOOT[0] - 0.3 * i, SUN_FOOT[1] + 0.9 * i, SUN_FOOT[2]];
    return { from: plusTimes(at, SUN_AWAY, sun), to: plusTimes(at, SUN_AWAY - 0.9, sun), color: "L", symbol: "L", arrow: true };
  });
}

/** The handle of the sun's direction, at the middle one of its rays. @param {Figure} fig @returns {Handle} */
export function sunHandle({ shared: { numbers } }) {
  const degrees = (/** @type {number} */ angle) => Math.round((angle * 1800) / Math.PI) / 10;
  return {
    get: () => plusTimes(SUN_FOOT, SUN_AWAY, toSun(numbers)), color: "L", symbol: "L", text: "sun",
    set: (point) => {
      const [x, y, z] = minus(point, SUN_FOOT);
      numbers.sun = degrees(Math.atan2(y, x));
      numbers.height = Math.max(5, Math.min(90, degrees(Math.atan2(z, Math.hypot(x, y)))));
    },
  };
}

/** Handles of the corners of the free triangle that the pixel shows, or of the green one. @param {Figure} fig @returns {Handle[]} */
export function cornerHandles({ shared }) {
  const { numbers, found } = shared;
  const first = shared.corners.length / 9 - numbers.triangles.length;
  const triangle = numbers.triangles[Math.max(0, (found?.index ?? 0) - first)];
  return triangle.corners.map((_, k) => ({
    get: () => triangle.corners[k],
    set: (point) => {
      triangle.corners[k] = withinWorld(point, 0);
    },
    color: "a", symbol: "abc"[k], text: "abc"[k],
  }));
}

/** The keyboard's way to handles: Enter selects the next one, arrow keys move it. @param {() => Handle[]} handles */
function handleKeys(handles) {
  let selected = -1;
  const name = (/** @type {Handle | undefined} */ handle) => (handle ? `Arrow keys move ${handle.text || handle.symbol}.` : "No point is selected.");
  return {
    get: () => handles()[selected],
    isSelected: (/** @type {number} */ i) => i === selected,
    next: () => {
      selected = selected + 1 < handles().length ? selected + 1 : -1;
      return name(handles()[selected]);
    },
  };
}

/**
 * Adds the view from outside, which turns when it is dragged.
 * @param {Figure} fig
 * @param {{ label: string, ratio?: number, view?: OutsideView, content: () => import("../figure/outside.js").Content, handles?: () => Handle[], picksPixel?: boolean }} options
 */
export function addOutside(fig, { label, ratio = 0.62, view = new OutsideView(), content, handles: given, picksPixel = false }) {
  const { shared } = fig;
  const handles = given || (() => []);
  const keys = handleKeys(handles);
  /** @type {Handle | null} */
  let held = null;
  let paints = false;
  fig.canvas({
    ratio, label: `${label}. Drag to turn the view; the arrow keys turn it too${given ? ", and Enter selects a point that they move" : ""}.`,
    draw: (pen) => {
      const shown = content();
      const spots = handles().map(({ get, color, symbol, text }, i) => ({ at: get(), color, symbol, text, radius: keys.isSelected(i) ? 9 : 6 }));
      view.draw(pen, { ...shown, spots: [...(shown.spots || []), ...spots] });
    },
    grab: (at) => {
      held = handles().find((handle) => {
        const [x, y] = view.see(handle.get());
        return Math.hypot(x - at[0], y - at[1]) < GRAB_PX;
      }) || null;
      const pixel = picksPixel && !held ? view.pixelAt(rigOf(fig), at) : null;
      paints = pixel !== null;
      if (pixel) pick(fig, pixel);
      return true;
    },
    drag: (at, from) => {
      if (held) {
        held.set(view.shift(held.get(), at, from));
        shared.changed();
      } else if (paints) {
        const pixel = view.pixelAt(rigOf(fig), at);
        if (pixel) pick(fig, pixel);
      } else view.orbit(at, from);
    },
    next: given && keys.next,
    nudge: ([x, y]) => {
      const handle = keys.get();
      if (!handle) return view.orbit([8 * x, 8 * y], [0, 0]);
      const step = KEY_MOVE * view.scale;
      handle.set(view.shift(handle.get(), [step * x, step * y], [0, 0]));
      shared.changed();
    },
  });
  return view;
}

/** Selects a pixel. @param {Figure} fig @param {number[]} pixel */
export function pick({ shared }, pixel) {
  shared.numbers.pixel = pixel;
  shared.changed();
}

/**
 * Adds the picture. A click selects the pixel, corners are dragged at their depth, arrow keys move the pixel.
 * @param {Figure} fig
 * @param {{ label?: string, handles?: () => Handle[], overlay?: (pen: Pen, place: (u: number, v: number) => number[]) => void, image?: () => HTMLCanvasElement | null }} [options]
 */
export function addPicture(fig, { label = "The picture", handles: given, overlay, image = () => sharedPicture(fig) } = {}) {
  const { shared } = fig;
  const handles = given || (() => []);
  let scale = 1;
  const keys = handleKeys(handles);
  /** @type {Handle | null} */
  let held = null;
  const place = (/** @type {number} */ u, /** @type {number} */ v) => [(u + 0.5) * scale, (v + 0.5) * scale];
  const pixelAt = (/** @type {number[]} */ at) => at.map((value) => value / scale - 0.5);
  const moveTo = (/** @type {Handle} */ handle, /** @type {number[]} */ [u, v]) => {
    const { r, C, forward } = rayOfPixel(shared.camera.P, u, v);
    handle.set(plusTimes(C, dot(minus(handle.get(), C), forward) / dot(r, forward), r));
    shared.changed();
  };
  const seen = (/** @type {number[]} */ point) => {
    const { u, v, inFront } = pixelOf(shared.camera.P, point);
    return inFront ? place(u, v) : [-99, -99];
  };
  fig.canvas({
    ratio: SIZE[1] / SIZE[0], label: `${label}. Click to select a pixel; the arrow keys move it${given ? ", and Enter selects a point that they move" : ""}.`,
    draw: (pen) => {
      scale = pen.width / SIZE[0];
      const canvas = image();
      pen.ctx.imageSmoothingEnabled = false;
      if (canvas) pen.ctx.drawImage(canvas, 0, 0, pen.width, pen.height);
      else drawLine(pen, [[0, 0], [pen.width, 0], [pen.width, pen.height], [0, pen.height]], { color: "soft", fill: "soft", close: true });
      overlay?.(pen, place);
      handles().forEach((handle, i) => {
        drawDot(pen, seen(handle.get()), handle.color, keys.isSelected(i) || pen.lit(handle.symbol) ? 9 : 6);
        pen.touch(handle.symbol, [seen(handle.get())]);
        pen.label({ at: seen(handle.get()), text: handle.text || "", symbol: handle.symbol });
      });
      const pixel = place(shared.numbers.pixel[0], shared.numbers.pixel[1]);
      drawPixel(pen, pixel);
      pen.touch("x", [pixel]);
    },
    grab: (at) => {
      held = handles().find((handle) => {
        const [x, y] = seen(handle.get());
        return Math.hypot(x - at[0], y - at[1]) < GRAB_PX;
      }) || null;
      if (!held) pick(fig, pixelAt(at));
      return true;
    },
    drag: (at) => {
      if (held) moveTo(held, pixelAt(at));
      else pick(fig, pixelAt(at));
    },
    next: given && keys.next,
    nudge: ([x, y]) => {
      const handle = keys.get();
      if (!handle) return pick(fig, [shared.numbers.pixel[0] + x, shared.numbers.pixel[1] + y]);
      const { u, v } = pixelOf(shared.camera.P, handle.get());
      moveTo(handle, [u + x, v + y]);
    },
  });
}

/** The mark of the selected pixel. @param {Pen} pen @param {number[]} at */
export function drawPixel(pen, [x, y]) {
  const half = pen.lit("x") ? 8 : 5;
  const square = [[x - half, y - half], [x + half, y - half], [x + half, y + half], [x - half, y + half]];
  drawLine(pen, square, { color: "white", width: 4, close: true });
  drawLine(pen, square, { color: "#d32f2f", width: 2, close: true });
}

/** The shared world as content of a view from outside. @param {Figure} fig @param {boolean} [withCamera] */
export function worldContent(fig, withCamera = true) {
  const { corners, colors } = fig.shared;
  return { corners, colors, grid: FLOOR, rig: withCamera ? rigOf(fig) : null };
}

/** The shared camera, as views from outside draw it. @param {Figure} fig @returns {import("../figure/outside.js").Rig} */
export function rigOf(fig) {
  return rigFor(fig.shared.numbers, sharedPicture(fig));
}

/** A camera, as views from outside draw it. @param {import("./world.js").Numbers} numbers @param {CanvasImageSource | null} picture @returns {import("../figure/outside.js").Rig} */
export function rigFor(numbers, picture) {
  const { P, R } = cameraOf(numbers);
  const [right, bottom] = SIZE.map((side) => side - 0.5);
  const corners = [[-0.5, -0.5], [right, -0.5], [right, bottom], [-0.5, bottom]].map(([u, v]) => onImagePlane(P, u, v));
  return { C: numbers.C, v: rowOf(R, 2), size: SIZE, distance: IMAGE_DISTANCE, corners, picture };
}

/** The point of a camera's drawn image plane at pixel coordinates. @param {number[]} P @param {number} u @param {number} v */
function onImagePlane(P, u, v) {
  const { r, C, forward } = rayOfPixel(P, u, v);
  return plusTimes(C, IMAGE_DISTANCE / dot(r, forward), r);
}

/** The point of the shared camera's drawn image plane at pixel coordinates. @param {Figure} fig @param {number} u @param {number} v */
export const imagePoint = ({ shared }, u, v) => onImagePlane(shared.camera.P, u, v);

/** The three axes at the origin. @returns {import("../figure/outside.js").Stroke[]} */
export function axisStrokes(length = 1.2) {
  return ["x", "y", "z"].map((text, i) => ({ from: [0, 0, 0], to: [0, 1, 2].map((k) => (k === i ? length : 0)), color: "axis", text, arrow: true }));
}
