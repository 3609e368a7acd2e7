// A figure of the page: canvases that are drawn when something changed and they are visible, and controls below them.

import { element } from "../dom.js";
import { placeLabels } from "./labels.js";
import { fixed } from "./numbers.js";

/** @typedef {import("./state.js").Shared} Shared */
/** @typedef {import("./pictures.js").Pictures} Pictures */
/** @typedef {{ at: number[], text: string, symbol?: string, color?: string }} Label */
/** @typedef {{ ctx: CanvasRenderingContext2D, width: number, height: number, color: (name: string) => string, lit: (symbol: string) => boolean, label: (label: Label) => void }} Pen */
/**
 * @typedef {object} Drawing
 * @property {number} ratio height of the canvas by its width
 * @property {string} label what the canvas shows, for screen readers
 * @property {(pen: Pen) => void} draw
 * @property {(at: number[]) => boolean} [grab] begins to drag at a point; false if nothing is there
 * @property {(at: number[], from: number[]) => void} [drag]
 * @property {(step: number[]) => void} [nudge] arrow keys
 */

/** Returns true if the reader prefers no motion. */
export const isStill = () => matchMedia("(prefers-reduced-motion: reduce)").matches;
const NUDGES = /** @type {Record<string, number[]>} */ ({ ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] });
const STEP_MS = 900;

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
    host.prepend(this.stage, this.tools);
    shared.listeners.push(() => this.isVisible && this.update());
    new IntersectionObserver(([entry]) => {
      this.isVisible = entry.isIntersecting;
      if (this.isVisible) this.update();
      else host.dataset.live = "false";
    }, { rootMargin: "200px" }).observe(host);
    new ResizeObserver(() => this.isVisible && this.update()).observe(this.stage);
  }

  update() {
    for (const update of this.updates) update();
    this.host.dataset.live = "true";
  }

  /** Adds a canvas. @param {Drawing} drawing @returns {HTMLCanvasElement} */
  canvas(drawing) {
    const canvas = document.createElement("canvas");
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", drawing.label);
    this.stage.append(canvas);
    canvas.style.aspectRatio = String(1 / drawing.ratio);
    this.updates.push(() => this.paint(canvas, drawing));
    if (drawing.drag || drawing.nudge) this.makeInteractive(canvas, drawing);
    return canvas;
  }

  /** @param {HTMLCanvasElement} canvas @param {Drawing} drawing */
  paint(canvas, drawing) {
    const { clientWidth: width, clientHeight: height } = canvas;
    if (!width || !height) return;
    const density = Math.min(devicePixelRatio || 1, 2);
    if (canvas.width !== Math.round(width * density) || canvas.height !== Math.round(height * density)) [canvas.width, canvas.height] = [Math.round(width * density), Math.round(height * density)];
    const ctx = canvas.getContext("2d");
    if (!ctx) return;
    ctx.setTransform(density, 0, 0, density, 0, 0);
    ctx.clearRect(0, 0, width, height);
    [ctx.lineJoin, ctx.lineCap] = ["round", "round"];
    const style = getComputedStyle(canvas);
    /** @type {Label[]} */
    const labels = [];
    const color = (/** @type {string} */ name) => style.getPropertyValue(`--${name === "f(t)" ? "t" : name}`) || name;
    const lit = (/** @type {string} */ symbol) => this.shared.highlight === symbol;
    drawing.draw({ ctx, width, height, color, lit, label: (label) => labels.push(label) });
    ctx.font = `600 14px ${style.fontFamily}`;
    const sizes = labels.map(({ at, text }) => ({ at, width: ctx.measureText(text).width + 6, height: 18 }));
    const boxes = placeLabels(sizes, width, height);
    canvas.dataset.labels = JSON.stringify(boxes.filter(Boolean));
    labels.forEach(({ text, color: own, symbol }, i) => {
      const box = boxes[i];
      if (!box) return;
      [ctx.lineWidth, ctx.strokeStyle, ctx.fillStyle] = [4, color("ground"), own || color(symbol || "ink")];
      ctx.strokeText(text, box.x + 3, box.y + 14);
      ctx.fillText(text, box.x + 3, box.y + 14);
      if (symbol && lit(symbol)) ctx.fillRect(box.x + 3, box.y + 17, box.width - 6, 2);
    });
  }

  /** @param {HTMLCanvasElement} canvas @param {Drawing} drawing */
  makeInteractive(canvas, drawing) {
    canvas.tabIndex = 0;
    canvas.setAttribute("role", "application");
    canvas.setAttribute("aria-roledescription", "figure, arrow keys");
    canvas.classList.add("draggable");
    /** @type {number[] | null} */
    let from = null;
    const pointOf = (/** @type {PointerEvent} */ event) => {
      const { left, top } = canvas.getBoundingClientRect();
      return [event.clientX - left, event.clientY - top];
    };
    canvas.addEventListener("pointerdown", (event) => {
      const at = pointOf(event);
      if (drawing.grab && !drawing.grab(at)) return;
      from = at;
      canvas.setPointerCapture(event.pointerId);
      canvas.classList.add("held");
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!from) return;
      const at = pointOf(event);
      drawing.drag?.(at, from);
      from = at;
      this.shared.redraw();
    });
    for (const kind of /** @type {const} */ (["pointerup", "pointercancel"]))
      canvas.addEventListener(kind, () => {
        from = null;
        canvas.classList.remove("held");
      });
    canvas.addEventListener("keydown", (event) => {
      const step = NUDGES[event.key];
      if (!step || !drawing.nudge) return;
      event.preventDefault();
      drawing.nudge(step.map((value) => value * (event.shiftKey ? 10 : 1)));
      this.shared.redraw();
    });
  }

  /**
   * Adds a slider.
   * @param {{ name: string, symbol?: string, min: number, max: number, step: number, digits?: number, unit?: string, get: () => number, set: (value: number) => void }} options
   */
  slider({ name, symbol, min, max, step, digits = 2, unit = "", get, set }) {
    const label = element("label", "", { class: "slider" });
    const title = element("span", name, symbol ? { "data-symbol": symbol } : {});
    const input = /** @type {HTMLInputElement} */ (element("input", "", { type: "range", min: String(min), max: String(max), step: String(step) }));
    const shown = element("output", "");
    label.append(title, input, shown);
    this.tools.append(label);
    input.addEventListener("input", () => {
      set(input.valueAsNumber);
      this.shared.changed();
    });
    const show = () => {
      input.value = String(get());
      input.style.setProperty("--part", `${(100 * (get() - min)) / (max - min)}%`);
      shown.textContent = `${fixed(get(), digits)}${unit}`;
    };
    this.updates.push(show);
    return input;
  }

  /** Adds buttons of which one is chosen. @param {{ name: string, options: string[], get: () => number, set: (i: number) => void }} options */
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
   * Adds back, play and step. `last` is the number of the last step.
   * @param {{ last: () => number, get: () => number, set: (i: number) => void, ms?: number }} options
   */
  stepper({ last, get, set, ms = STEP_MS }) {
    const group = element("div", "", { class: "choice", role: "group", "aria-label": "Steps" });
    let timer = 0;
    const go = (/** @type {number} */ i) => {
      set(Math.max(0, Math.min(last(), i)));
      this.shared.redraw();
    };
    const stop = () => {
      clearInterval(timer);
      timer = 0;
      play.textContent = "Play";
    };
    const add = (/** @type {string} */ text, /** @type {() => void} */ act) => {
      const button = element("button", text, { type: "button" });
      button.addEventListener("click", act);
      group.append(button);
      return button;
    };
    add("Back", () => (stop(), go(get() - 1)));
    const play = add("Play", () => {
      if (timer) return stop();
      if (isStill()) return go(last());
      if (get() >= last()) go(0);
      play.textContent = "Pause";
      timer = window.setInterval(() => (get() >= last() || !this.isVisible ? stop() : go(get() + 1)), ms);
    });
    add("Step", () => (stop(), go(get() + 1)));
    this.tools.append(group);
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
        p.append(...line.map((part) => (typeof part === "string" ? part : element("span", part[1], { "data-symbol": part[0] }))));
        return p;
      }));
    });
  }
}
