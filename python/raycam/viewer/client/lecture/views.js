// The two views that most figures show: the picture with the selected pixel, and the world from outside.

import { dot, minus, plusTimes } from "../core/vectors.js";
import { pixelOf, rayOfPixel } from "../core/steps.js";
import { OutsideView } from "./outside.js";
import { drawDot, drawLine } from "./shapes.js";
import { SIZE, worldText } from "./world.js";

/** @typedef {import("./figure.js").Figure} Figure */
/** @typedef {import("./figure.js").Pen} Pen */

const REACH_PX = 16;
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

/** Handles of the corners of the free triangle that the pixel shows, or of the green one. @param {Figure} fig @returns {Handle[]} */
export function cornerHandles({ shared }) {
  const { numbers, found } = shared;
  const first = shared.corners.length / 9 - numbers.triangles.length;
  const triangle = numbers.triangles[Math.max(0, (found?.index ?? 0) - first)];
  return triangle.corners.map((_, k) => ({
    get: () => triangle.corners[k],
    set: (point) => {
      triangle.corners[k] = [point[0], point[1], Math.max(0, point[2])].map((value) => Math.max(-6, Math.min(6, Math.round(value * 1000) / 1000)));
    },
    color: "edge", symbol: "abc"[k], text: "abc"[k],
  }));
}

/**
 * Adds the view from outside, which turns when it is dragged.
 * @param {Figure} fig
 * @param {{ label: string, ratio?: number, view?: OutsideView, content: () => import("./outside.js").Content, handles?: () => Handle[], picksPixel?: boolean }} options
 */
export function addOutside(fig, { label, ratio = 0.62, view = new OutsideView(), content, handles = () => [], picksPixel = false }) {
  const { shared } = fig;
  /** @type {Handle | null} */
  let held = null;
  let paints = false;
  fig.canvas({
    ratio, label: `${label}. Drag to turn the view; the arrow keys turn it too.`,
    draw: (pen) => {
      const shown = content();
      const spots = handles().map(({ get, color, symbol, text }) => ({ at: get(), color, symbol, text, radius: 6 }));
      view.draw(pen, { ...shown, spots: [...(shown.spots || []), ...spots] }, shared);
    },
    grab: (at) => {
      held = handles().find((handle) => {
        const [x, y] = view.see(handle.get());
        return Math.hypot(x - at[0], y - at[1]) < REACH_PX;
      }) || null;
      const pixel = picksPixel && !held ? view.pixelAt(shared, at) : null;
      paints = pixel !== null;
      if (pixel) pick(fig, pixel);
      return true;
    },
    drag: (at, from) => {
      if (held) {
        held.set(view.shift(held.get(), at, from));
        shared.changed();
      } else if (paints) {
        const pixel = view.pixelAt(shared, at);
        if (pixel) pick(fig, pixel);
      } else view.orbit(at, from);
    },
    nudge: ([x, y]) => view.orbit([8 * x, 8 * y], [0, 0]),
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
export function addPicture(fig, { label = "The picture", handles = () => [], overlay, image = () => sharedPicture(fig) } = {}) {
  const { shared } = fig;
  let scale = 1;
  /** @type {Handle | null} */
  let held = null;
  const place = (/** @type {number} */ u, /** @type {number} */ v) => [(u + 0.5) * scale, (v + 0.5) * scale];
  const pixelAt = (/** @type {number[]} */ at) => at.map((value) => value / scale - 0.5);
  const seen = (/** @type {number[]} */ point) => {
    const { u, v, inFront } = pixelOf(shared.camera.P, point);
    return inFront ? place(u, v) : [-99, -99];
  };
  fig.canvas({
    ratio: SIZE[1] / SIZE[0], label: `${label}. Click to select a pixel; the arrow keys move it.`,
    draw: (pen) => {
      scale = pen.width / SIZE[0];
      const canvas = image();
      pen.ctx.imageSmoothingEnabled = false;
      if (canvas) pen.ctx.drawImage(canvas, 0, 0, pen.width, pen.height);
      else drawLine(pen, [[0, 0], [pen.width, 0], [pen.width, pen.height], [0, pen.height]], { color: "soft", fill: "soft", close: true });
      overlay?.(pen, place);
      for (const handle of handles()) {
        drawDot(pen, seen(handle.get()), handle.color, 6);
        pen.label({ at: seen(handle.get()), text: handle.text || "", symbol: handle.symbol });
      }
      drawPixel(pen, place(shared.numbers.pixel[0], shared.numbers.pixel[1]));
    },
    grab: (at) => {
      held = handles().find((handle) => {
        const [x, y] = seen(handle.get());
        return Math.hypot(x - at[0], y - at[1]) < REACH_PX;
      }) || null;
      if (!held) pick(fig, pixelAt(at));
      return true;
    },
    drag: (at) => {
      if (!held) return pick(fig, pixelAt(at));
      const [u, v] = pixelAt(at);
      const { r, C, forward } = rayOfPixel(shared.camera.P, u, v);
      held.set(plusTimes(C, dot(minus(held.get(), C), forward) / dot(r, forward), r));
      shared.changed();
    },
    nudge: ([x, y]) => pick(fig, [shared.numbers.pixel[0] + x, shared.numbers.pixel[1] + y]),
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
  const { corners, colors, numbers } = fig.shared;
  return { corners, colors, C: withCamera ? numbers.C : null, picture: withCamera ? sharedPicture(fig) : null };
}

/** The three axes at the origin. @returns {import("./outside.js").Stroke[]} */
export function axisStrokes(length = 1.2) {
  return ["x", "y", "z"].map((text, i) => ({ from: [0, 0, 0], to: [0, 1, 2].map((k) => (k === i ? length : 0)), color: "axis", text, arrow: true }));
}
