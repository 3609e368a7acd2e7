// A figure of the page: canvases with controls below them. A visible canvas is drawn after each change.

import { element } from "../dom.js";
import { Board } from "../figure/board.js";
import { fixed } from "../figure/numbers.js";

/** @typedef {import("./state.js").Shared} Shared */
/** @typedef {import("./pictures.js").Pictures} Pictures */
/** @typedef {import("../figure/board.js").Pen} Pen */

/** Returns true if the reader prefers no motion. */
export const isStill = () => matchMedia("(prefers-reduced-motion: reduce)").matches;
const STEP_MS = 900, GLIDE_MS = 500;

export class Figure {
  /** @param {HTMLElement} host @param {Shared} shared @param {Pictures} pictures */
  constructor(host, shared, pictures) {
    this.host = host;
    this.shared = shared;
    this.pictures = pictures;
    this.id = host.dataset.figure || "";
    this.isVisible = false;
    /** @type {(() => void)[]} */
    this.updates = [];
    this.stage = element("div", "", { class: "stage" });
    this.tools = element("div", "", { class: "tools" });
    /** The element to which controls are added: the tools, or the newest group of tools. */
    this.place = this.tools;
    host.prepend(this.stage, this.tools);
    shared.listeners.push(() => this.isVisible && this.update());
    new IntersectionObserver(([entry]) => {
      this.isVisible = entry.isIntersecting;
      if (this.isVisible) this.update();
      else {
        host.dataset.live = "false";
        pictures.cancel(this.id);
      }
    }, { rootMargin: "200px" }).observe(host);
    new ResizeObserver(() => this.isVisible && this.update()).observe(this.stage);
  }

  update() {
    for (const update of this.updates) update();
    this.host.dataset.live = "true";
  }

  /** Adds a canvas. @param {import("../figure/board.js").Drawing} drawing @returns {HTMLCanvasElement} */
  canvas(drawing) {
    const canvas = document.createElement("canvas");
    const frame = element("div", "", { class: "frame" });
    frame.append(canvas);
    this.stage.append(frame);
    const board = new Board(canvas, drawing, this.shared);
    this.updates.push(() => board.paint());
    return canvas;
  }

  /** Begins a group of sliders below a title. @param {string} symbol @param {string} title */
  group(symbol, title) {
    this.place = element("div", "", { class: "group", role: "group", "aria-label": title });
    this.place.append(element("p", title, { "data-symbol": symbol }));
    this.tools.append(this.place);
  }

  /**
   * Adds a slider.
   * @param {{ name: string, symbol?: string, min: number, max: number, step: number, digits?: number, unit?: string, get: () => number, set: (value: number) => void, text?: () => string }} options
   */
  slider({ name, symbol, min, max, step, digits = 2, unit = "", get, set, text = () => `${fixed(get(), digits)}${unit}` }) {
    const label = element("label", "", { class: "slider" });
    const title = element("span", name, symbol ? { "data-symbol": symbol } : {});
    const input = /** @type {HTMLInputElement} */ (element("input", "", { type: "range", min: String(min), max: String(max), step: String(step) }));
    const shown = element("output", "");
    label.append(title, input, shown);
    this.place.append(label);
    input.addEventListener("input", () => {
      set(input.valueAsNumber);
      this.shared.changed();
    });
    const show = () => {
      input.value = String(get());
      input.style.setProperty("--part", `${(100 * (get() - min)) / (max - min)}%`);
      shown.textContent = text();
      input.setAttribute("aria-valuetext", text());
    };
    this.updates.push(show);
    return input;
  }

  /** Adds a row of buttons; exactly one button is always chosen. @param {{ name: string, options: string[], get: () => number, set: (i: number) => void }} options */
  choice({ name, options, get, set }) {
    const group = element("div", "", { class: "choice", role: "group", "aria-label": name });
    const buttons = options.map((text, i) => {
      const button = element("button", text, { type: "button" });
      button.addEventListener("click", () => {
        set(i);
        this.shared.changed();
      });
      return button;
    });
    group.append(...buttons);
    this.tools.append(group);
    this.updates.push(() => buttons.forEach((button, i) => button.setAttribute("aria-pressed", String(get() === i))));
  }

  /** Adds a button. @param {string} text @param {() => void} act */
  button(text, act) {
    const button = element("button", text, { type: "button" });
    button.addEventListener("click", () => {
      act();
      this.shared.changed();
    });
    this.tools.append(button);
    return button;
  }

  /**
   * Adds back, play and step. `last` is the number of the last step, `ms` the duration of a step, and `stride` the number of steps that the buttons move.
   * @param {{ last: () => number, get: () => number, set: (i: number) => void, ms?: number, stride?: number }} options
   */
  stepper({ last, get, set, ms = STEP_MS, stride = 1 }) {
    const group = element("div", "", { class: "choice", role: "group", "aria-label": "Steps" });
    let isPlaying = false;
    const go = (/** @type {number} */ i) => {
      set(Math.max(0, Math.min(last(), i)));
      this.shared.redraw();
    };
    const stop = () => {
      isPlaying = false;
      play.textContent = "Play";
    };
    const add = (/** @type {string} */ text, /** @type {() => void} */ act) => {
      const button = element("button", text, { type: "button" });
      button.addEventListener("click", act);
      group.append(button);
      return button;
    };
    const advance = (/** @type {number} */ began, /** @type {number} */ from) => {
      if (!isPlaying) return;
      const i = from + Math.floor((performance.now() - began) / ms);
      if (i !== get()) go(i);
      if (i >= last() || !this.isVisible) stop();
      else requestAnimationFrame(() => advance(began, from));
    };
    add("Back", () => (stop(), go(get() - stride)));
    const play = add("Play", () => {
      if (isPlaying) return stop();
      if (isStill()) return go(last());
      if (get() >= last()) go(0);
      isPlaying = true;
      play.textContent = "Pause";
      advance(performance.now(), get());
    });
    add("Step", () => (stop(), go(get() + stride)));
    this.tools.append(group);
  }

  /** Moves something smoothly: calls `act` with shares that grow from 0 to 1, or with 1 alone if the reader prefers no motion. @param {(share: number) => void} act @param {number} [ms] */
  glide(act, ms = GLIDE_MS) {
    const began = performance.now();
    const step = () => {
      const part = isStill() || !this.isVisible ? 1 : Math.min(1, (performance.now() - began) / ms);
      act(part * part * (3 - 2 * part));
      this.shared.redraw();
      if (part < 1) requestAnimationFrame(step);
    };
    step();
  }

  /** Adds lines of text with symbols: [symbol, text] pairs or plain texts. @param {() => (string | [string, string])[][]} lines */
  readout(lines) {
    const box = element("div", "", { class: "readout" });
    this.host.insertBefore(box, this.tools.nextSibling);
    let last = "";
    this.updates.push(() => {
      const now = lines();
      const key = JSON.stringify(now);
      if (key === last) return;
      last = key;
      box.replaceChildren(...now.map((line) => {
        const p = element("p");
        p.append(...line.map((part) => (typeof part === "string" ? part : element("span", part[1], { "data-symbol": part[0], class: part[0] === this.shared.highlight ? "lit" : "" }))));
        return p;
      }));
    });
  }
}
