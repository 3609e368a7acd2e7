// The state that all figures share: the world's numbers, one selected pixel, and all values computed from both.

import { rayOfPixel, stepsOf } from "../core/steps.js";
import { cameraOf } from "./camera.js";
import { colorsOf, cornersOf, firstNumbers, namesOf, SIZE } from "./world.js";

const STORE = "raycam-lecture";

/** The shared state. `changed` recomputes the state, and calls every listener once in the next animation frame. */
export class Shared {
  constructor() {
    this.numbers = firstNumbers();
    /** @type {(() => void)[]} */
    this.listeners = [];
    this.highlight = "";
    this.pending = false;
    /** @type {Record<string, any>} progress: solved exercises and code, by their ids */
    this.progress = loadProgress();
    this.camera = cameraOf(this.numbers);
    this.corners = cornersOf(this.numbers);
    this.names = namesOf(this.numbers);
    this.colors = colorsOf(this.numbers);
    this.ray = rayOfPixel(this.camera.P, 0, 0);
    this.steps = stepsOf(this.ray, this.corners);
    /** The triangle that the figures explain: the closest hit, or the narrowest miss. */
    this.found = this.steps.winner || this.steps.candidates[0] || null;
    this.compute();
  }

  /** Recomputes everything that depends on the numbers. */
  compute() {
    const { numbers } = this;
    numbers.pixel = numbers.pixel.map((at, i) => Math.max(0, Math.min(SIZE[i] - 1, Math.round(at))));
    this.camera = cameraOf(numbers);
    this.corners = cornersOf(numbers);
    this.names = namesOf(numbers);
    this.colors = colorsOf(numbers);
    this.ray = rayOfPixel(this.camera.P, numbers.pixel[0], numbers.pixel[1]);
    this.steps = stepsOf(this.ray, this.corners);
    this.found = this.steps.winner || this.steps.candidates[0] || null;
  }

  /** Recomputes and redraws after a change of the numbers. */
  changed() {
    this.compute();
    this.redraw();
  }

  /** Draws the figures again with the same numbers. */
  redraw() {
    if (this.pending) return;
    this.pending = true;
    requestAnimationFrame(() => {
      this.pending = false;
      for (const listener of this.listeners) listener();
    });
  }

  reset() {
    Object.assign(this.numbers, firstNumbers());
    this.changed();
  }

  /** Highlights a symbol in all formulas and figures; "" removes the highlight. @param {string} symbol */
  point(symbol) {
    if (symbol === this.highlight) return;
    this.highlight = symbol;
    for (const each of document.querySelectorAll("[data-symbol]")) each.classList.toggle("lit", symbol !== "" && each.getAttribute("data-symbol") === symbol);
    this.redraw();
  }

  /** Remembers a value. @param {string} id @param {any} value */
  remember(id, value) {
    this.progress[id] = value;
    try {
      localStorage.setItem(STORE, JSON.stringify(this.progress));
    } catch {
      // Without storage, the progress is lost when the page is closed.
    }
  }
}

/** @returns {Record<string, any>} */
function loadProgress() {
  try {
    return JSON.parse(localStorage.getItem(STORE) || "{}");
  } catch {
    return {};
  }
}
