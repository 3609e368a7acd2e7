// The two views that most figures show: the image with the selected pixel, and the world from outside.

import { dot, minus, plusTimes, rowOf } from "../core/vectors.js";
import { rayOfPixel } from "../core/steps.js";
import { AXIS_LENGTH, OutsideView } from "../figure/outside.js";
import { cameraOf } from "./camera.js";
import { isStill } from "./figure.js";
import { aimAt, rollToward, setSun } from "./steer.js";
import { FLOOR, SIZE, toSun, worldText } from "./world.js";

/** @typedef {import("./figure.js").Figure} Figure */

export const GRAB_PX = 16, KEY_MOVE = 0.05;
const SPIN_DECAY = 0.93, MIN_SPEED_PX = 0.15, SPIN_PAUSE_MS = 60;
const IMAGE_DISTANCE = 1.5, SUN_FOOT = [-1.6, 0.9, 0], SUN_AWAY = 4.2, V_LENGTH = AXIS_LENGTH * IMAGE_DISTANCE;
/** The newest flat image of the shared world. @type {{ canvas: HTMLCanvasElement | null }} */
const SHARED_PICTURE = { canvas: null };

/** Requests the flat image of the shared world. @param {Figure} fig @returns {HTMLCanvasElement | null} the newest one */
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

/** A handle that is dragged in both views. The sun is a direction, which the image shows at infinity. @typedef {{ get: () => number[], set: (point: number[]) => void, color: string, symbol?: string, text?: string, glows?: "sun" | "bulb", isQuiet?: boolean }} Handle `isQuiet`: drawn only while it is selected or its symbol is highlighted */

/** A point that a reader drags: above a height, within 6 units of the origin, in steps of 0.001. @param {number[]} point @param {number} lowest */
export const withinWorld = ([x, y, z], lowest) => [x, y, Math.max(lowest, z)].map((value) => Math.max(-6, Math.min(6, Math.round(value * 1000) / 1000)));

/** The handle of the camera's centre. @param {Figure} fig @returns {Handle} */
function centerHandle({ shared }) {
  return { get: () => shared.numbers.C, color: "C", symbol: "C", text: "C", set: (point) => { shared.numbers.C = withinWorld(point, 0.2); } };
}

/** The handle of the bulb. @param {Figure} fig @returns {Handle} */
export function bulbHandle({ shared }) {
  return { get: () => shared.numbers.bulb, color: "L", symbol: "L", text: "bulb", glows: "bulb", set: (point) => { shared.numbers.bulb = withinWorld(point, 0.2); } };
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

/** The handle of the sun's direction, at the middle ray of the sun. @param {Figure} fig @returns {Handle} */
export function sunHandle({ shared: { numbers } }) {
  return {
    get: () => plusTimes(SUN_FOOT, SUN_AWAY, toSun(numbers)), color: "L", symbol: "L", text: "sun", glows: "sun",
    set: (point) => setSun(numbers, minus(point, SUN_FOOT)),
  };
}

/** Handles of the camera: its centre, the tip of v for yaw and pitch, and the upper edge of the image plane for the roll. @param {Figure} fig @returns {Handle[]} */
export function cameraHandles(fig) {
  const { shared } = fig;
  const { numbers } = shared;
  return [
    centerHandle(fig),
    { get: () => plusTimes(numbers.C, V_LENGTH, rowOf(shared.camera.R, 2)), set: (point) => aimAt(numbers, point), color: "R", symbol: "v" },
    { get: () => imagePoint(fig, SIZE[0] / 2 - 0.5, -0.5), set: (point) => rollToward(numbers, point), color: "R", symbol: "R", text: "roll" },
  ];
}

/** Handles of the corners of the free triangle that the pixel shows, or of the green triangle. @param {Figure} fig @returns {Handle[]} */
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

/** Makes the handles usable with the keyboard: Enter selects the next handle, arrow keys move the handle. @param {() => Handle[]} handles */
export function handleKeys(handles) {
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

/** The motion that continues after a view was turned quickly, and slows down. @param {Figure} fig @param {OutsideView} view */
function spinOf(fig, view) {
  let [last, speed, isOn] = [0, [0, 0], false];
  const step = () => {
    if (!isOn || !fig.isVisible || Math.hypot(...speed) < MIN_SPEED_PX) return;
    view.orbit(speed, [0, 0]);
    speed = speed.map((value) => SPIN_DECAY * value);
    fig.shared.redraw();
    requestAnimationFrame(step);
  };
  return {
    note: (/** @type {number[]} */ at, /** @type {number[]} */ from) => {
      last = performance.now();
      speed = at.map((value, i) => 0.6 * (value - from[i]) + 0.4 * speed[i]);
    },
    begin: () => {
      if (isStill() || performance.now() - last > SPIN_PAUSE_MS) return;
      isOn = true;
      requestAnimationFrame(step);
    },
    stop: () => {
      [isOn, speed] = [false, [0, 0]];
    },
  };
}

/**
 * Adds the view from outside, which turns when it is dragged.
 * @param {Figure} fig
 * @param {{ label: string, ratio?: number, view?: OutsideView, content: () => import("../figure/outside.js").Content, handles?: () => Handle[], picksPixel?: boolean, hasPoints?: boolean }} options `hasPoints`: false if nothing in the view is dragged
 */
export function addOutside(fig, { label, ratio = 0.6, view = new OutsideView(), content, handles: given, picksPixel = false, hasPoints = true }) {
  const { shared } = fig;
  let hasCamera = false;
  const handles = () => {
    const named = given?.() || [];
    return !hasCamera || named.some(({ symbol }) => symbol === "C") ? named : [...named, ...cameraHandles(fig).map((handle) => ({ ...handle, isQuiet: true }))];
  };
  const keys = handleKeys(handles);
  const spin = spinOf(fig, view);
  /** @type {Handle | null} */
  let held = null;
  let paints = false;
  const nearest = (/** @type {number[]} */ at) => handles().find((handle) => {
    const [x, y] = view.see(handle.get());
    return Math.hypot(x - at[0], y - at[1]) < GRAB_PX;
  }) || null;
  fig.canvas({
    ratio, label: `${label}. Drag to turn the view; the arrow keys turn it too${hasPoints ? ", and Enter selects a point that they move" : ""}.`,
    draw: (pen) => {
      const shown = content();
      hasCamera = shown.rig?.C === shared.numbers.C;
      const spots = handles().flatMap(({ get, color, symbol, text, glows, isQuiet }, i) => (isQuiet && !keys.isSelected(i) && !pen.lit(symbol) ? [] : [
        { at: get(), color, symbol, text: isQuiet ? "" : text, radius: keys.isSelected(i) ? 9 : 6, isHandle: true, glows },
      ]));
      view.draw(pen, { ...shown, spots: [...(shown.spots || []), ...spots] });
    },
    isHandle: (at) => nearest(at) !== null,
    grab: (at) => {
      spin.stop();
      held = nearest(at);
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
      } else {
        view.orbit(at, from);
        spin.note(at, from);
      }
    },
    release: () => spin.begin(),
    next: hasPoints ? keys.next : undefined,
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

/** The shared world as content of a view from outside. @param {Figure} fig @param {boolean} [withCamera] */
export function worldContent(fig, withCamera = true) {
  const { corners, colors } = fig.shared;
  return { corners, colors, sun: toSun(fig.shared.numbers), grid: FLOOR, rig: withCamera ? rigOf(fig) : null };
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
