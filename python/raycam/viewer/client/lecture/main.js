// The lecture alive: one world, its picture, and everything recomputed when a number changes. In a worker of the page the
// same text renders.

import { figureOf } from "../core/figure.js";
import { plusTimes, dot, minus, lengthOf } from "../core/vectors.js";
import { pixelOf, rayOfPixel, stepsOf } from "../core/steps.js";
import { byId, fillSelect, svgElement } from "../dom.js";
import { toneMap } from "../image/tone.js";
import { showFigure } from "../panel/figure.js";
import { compiledCore, textOf } from "../transport/worker.js";
import { Controls } from "./controls.js";
import { Exercises, showMatrix, showSteps } from "./panels.js";
import { serveLecture } from "./worker.js";
import { firstNumbers, SIZE, worldText } from "./world.js";

const TABS = ["camera", "pixel", "triangles", "light", "exercises"];
const SAMPLES_OF = /** @type {Record<string, number>} */ ({ flat: 1, direct: 64, path: 64 });
const NUDGES = /** @type {Record<string, number[]>} */ ({ ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] });

class Lecture {
  constructor() {
    this.numbers = firstNumbers();
    this.id = 0;
    /** @type {any} P, K, R, C and the triangles, as the core has them */
    this.world = null;
    this.chosen = -1; // the triangle that is explained, -1 for the closest
    this.canvas = byId("picture", HTMLCanvasElement);
    [this.canvas.width, this.canvas.height] = SIZE;
    this.marks = /** @type {SVGElement} */ (/** @type {unknown} */ (document.getElementById("marks")));
    this.marks.setAttribute("viewBox", `-0.5 -0.5 ${SIZE[0]} ${SIZE[1]}`);
    this.controls = new Controls(this.numbers, () => this.changed());
    this.exercises = new Exercises();
    this.bind();
    this.controls.show();
    this.openTab(location.hash.slice(1));
  }

  async open() {
    try {
      this.module = await compiledCore();
      this.start();
    } catch (error) {
      this.say(`This browser does not run raycam: ${error}`);
    }
  }

  start() {
    const script = [textOf("core-glue"), "\nglobalThis.wasm_bindgen = wasm_bindgen;\n", textOf("client")];
    const url = URL.createObjectURL(new Blob(script, { type: "text/javascript" }));
    this.worker = new Worker(url);
    this.worker.onmessage = ({ data }) => this.receive(data);
    this.worker.onerror = (event) => this.say(event.message || "The worker did not start.");
    this.worker.postMessage({ type: "start", module: this.module });
    this.changed();
  }

  bind() {
    fillSelect(byId("integrator", HTMLSelectElement), [["flat", "flat: the lecture's colours"], ["direct", "lit, with shadows"], ["path", "path: all light"]]);
    byId("integrator", HTMLSelectElement).addEventListener("change", (event) => {
      this.numbers.integrator = /** @type {HTMLSelectElement} */ (event.target).value;
      this.changed();
    });
    byId("reset", HTMLButtonElement).addEventListener("click", () => {
      const { triangles, ...rest } = firstNumbers();
      Object.assign(this.numbers, rest);
      this.numbers.triangles.forEach((triangle, i) => (triangle.corners = triangles[i].corners));
      this.controls.show();
      this.changed();
    });
    byId("copy-world", HTMLButtonElement).addEventListener("click", async () => {
      const text = worldText(this.numbers);
      await navigator.clipboard.writeText(text).then(() => this.say("The world file is in the clipboard.", "notice"), () => this.say(text, "notice"));
    });
    byId("another", HTMLButtonElement).addEventListener("click", () => this.choosePixel());
    byId("candidate", HTMLSelectElement).addEventListener("change", (event) => {
      this.chosen = Number(/** @type {HTMLSelectElement} */ (event.target).value);
      this.explain();
    });
    for (const [i, name] of ["u", "v"].entries()) {
      const field = byId(`pixel-${name}`, HTMLInputElement);
      field.max = String(SIZE[i] - 1);
      field.addEventListener("input", () => {
        const value = field.valueAsNumber;
        if (Number.isInteger(value) && value >= 0 && value < SIZE[i]) this.pick(i ? [this.numbers.pixel[0], value] : [value, this.numbers.pixel[1]]);
      });
    }
    this.canvas.addEventListener("click", (event) => this.pick(this.pixelAt(event)));
    this.canvas.addEventListener("keydown", (event) => {
      const nudge = NUDGES[event.key];
      if (!nudge) return;
      event.preventDefault();
      this.pick(this.numbers.pixel.map((at, i) => at + nudge[i] * (event.shiftKey ? 10 : 1)));
    });
    const tabs = TABS.map((name) => byId(`tab-${name}`, HTMLButtonElement));
    tabs.forEach((tab, i) => {
      tab.addEventListener("click", () => this.openTab(TABS[i]));
      tab.addEventListener("keydown", ({ key }) => {
        const step = key === "ArrowRight" ? 1 : key === "ArrowLeft" ? -1 : 0;
        if (!step) return;
        const next = (i + step + TABS.length) % TABS.length;
        this.openTab(TABS[next]);
        tabs[next].focus();
      });
    });
    addEventListener("hashchange", () => this.openTab(location.hash.slice(1)));
  }

  /** @param {string} name */
  openTab(name) {
    const chosen = TABS.includes(name) ? name : TABS[0];
    for (const each of TABS) {
      const tab = byId(`tab-${each}`, HTMLButtonElement);
      tab.setAttribute("aria-selected", String(each === chosen));
      tab.tabIndex = each === chosen ? 0 : -1;
      byId(`panel-${each}`, HTMLElement).hidden = each !== chosen;
    }
    document.body.dataset.tab = chosen;
    if (chosen === "light" && this.numbers.integrator === "flat") {
      this.numbers.integrator = "direct";
      this.changed();
    }
  }

  /** Asks for the picture of the numbers as they are. */
  changed() {
    this.id += 1;
    this.canvas.setAttribute("aria-busy", "true");
    byId("integrator", HTMLSelectElement).value = this.numbers.integrator;
    const { integrator } = this.numbers;
    this.worker?.postMessage({ type: "draw", id: this.id, text: worldText(this.numbers), width: SIZE[0], height: SIZE[1], integrator, samples: SAMPLES_OF[integrator] });
  }

  /** @param {any} message */
  receive(message) {
    if (message.type === "world") {
      this.world = message;
      showMatrix("matrix-P", message.P, 4);
      showMatrix("matrix-K", message.K, 3);
      showMatrix("matrix-R", message.R, 3);
      this.explain();
    } else if (message.type === "picture") {
      const image = new ImageData(SIZE[0], SIZE[1]);
      toneMap(message.color, 0, "standard", image.data);
      this.canvas.getContext("2d")?.putImageData(image, 0, 0);
      this.canvas.dataset.samples = String(message.samples);
      byId("samples", HTMLElement).textContent = this.numbers.integrator === "flat" ? "unlit" : `${message.samples} ${message.samples === 1 ? "sample" : "samples"} per pixel`;
      if (message.id === this.id) byId("message", HTMLElement).hidden = true;
    } else if (message.type === "failed") this.say(message.text);
    if (message.id === this.id && message.type !== "world") this.canvas.setAttribute("aria-busy", "false");
  }

  /** @param {string} text @param {string} [kind] */
  say(text, kind = "error") {
    const said = byId("message", HTMLElement);
    said.textContent = text;
    said.className = kind;
    said.hidden = false;
  }

  /** @param {{ clientX: number, clientY: number }} event @returns {number[]} */
  pixelAt({ clientX, clientY }) {
    const { left, top, width, height } = this.canvas.getBoundingClientRect();
    return [((clientX - left) / width) * SIZE[0], ((clientY - top) / height) * SIZE[1]].map(Math.floor);
  }

  /** @param {number[]} pixel */
  pick(pixel) {
    this.numbers.pixel = pixel.map((at, i) => Math.max(0, Math.min(SIZE[i] - 1, at)));
    this.chosen = -1;
    this.explain();
  }

  /** Picks a pixel whose ray meets a triangle, one after the other through the picture. */
  choosePixel() {
    if (!this.world) return;
    const [u, v] = this.numbers.pixel;
    for (let i = 1; i <= 60; i++) {
      const pixel = [(u + 73 * i) % SIZE[0], (v + 41 * i) % SIZE[1]];
      const ray = rayOfPixel(this.world.P, pixel[0] + this.world.offset, pixel[1] + this.world.offset);
      const { winner } = stepsOf(ray, this.world.corners);
      if (winner && ray.XPrime) return this.pick(pixel);
    }
    this.say("No triangle is in sight: turn the camera, or reset.", "notice");
  }

  /** Recomputes the steps of the pixel, and shows them everywhere. */
  explain() {
    if (!this.world) return;
    const { P, R, corners, ids, names, offset } = this.world;
    const [column, row] = this.numbers.pixel;
    const pixel = [column + offset, row + offset];
    const ray = rayOfPixel(P, pixel[0], pixel[1]);
    const steps = { ray, ...stepsOf(ray, corners) };
    const found = steps.candidates.find(({ index }) => index === this.chosen) || steps.winner || steps.candidates[0] || null;
    byId("pixel-u", HTMLInputElement).value = String(column);
    byId("pixel-v", HTMLInputElement).value = String(row);
    const list = steps.candidates.map((each) => {
      const said = each === steps.winner ? "the closest" : each.inside ? "hit, farther" : "missed";
      return /** @type {[string, string]} */ ([String(each.index), `${names[ids[2 * each.index]]} ${ids[2 * each.index + 1]}: ${said}`]);
    });
    const choice = byId("candidate", HTMLSelectElement);
    fillSelect(choice, list.length ? list : [["", "no triangle"]]);
    if (found) choice.value = String(found.index);
    showSteps({ column, row, names, ids }, steps, found);
    const figure = /** @type {SVGElement} */ (/** @type {unknown} */ (document.getElementById("figure")));
    showFigure(figure, figureOf({ rayAt: (u, v) => rayOfPixel(P, u, v), size: SIZE, offset, up: [0, 0, 1], ray: steps.ray, found }));
    this.exercises.show(found && steps.ray.XPrime ? { P, R, pixel, ray: steps.ray, found } : null);
    this.mark(found);
  }

  /** Marks the pixel, the triangle that is explained, and the corners to drag. @param {import("../core/steps.js").Candidate | null} found */
  mark(found) {
    const { P, offset } = this.world;
    const [column, row] = this.numbers.pixel;
    const seen = (/** @type {number[]} */ point) => {
      const { u, v, inFront } = pixelOf(P, point);
      return inFront && Math.abs(u) < 1e6 && Math.abs(v) < 1e6 ? [u - offset, v - offset] : null;
    };
    const parts = [];
    const outline = found?.corners.map(seen) || [null];
    if (outline.every(Boolean)) parts.push(svgElement("polygon", { points: outline.map((each) => /** @type {number[]} */ (each).join(",")).join(" "), class: "found" }));
    parts.push(svgElement("rect", { x: column - 3.5, y: row - 3.5, width: 7, height: 7, class: "pixel" }));
    this.numbers.triangles.forEach((triangle, i) =>
      triangle.corners.forEach((corner, k) => {
        const at = seen(corner);
        if (!at) return;
        const handle = svgElement("circle", { cx: at[0], cy: at[1], r: 4, class: "handle" });
        handle.dataset.corner = `${i}${k}`;
        handle.addEventListener("pointerdown", (event) => this.drag(/** @type {PointerEvent} */ (event), i, k));
        parts.push(handle);
      }),
    );
    if (!this.dragging) this.marks.replaceChildren(...parts);
    else {
      const kept = /** @type {SVGElement} */ (this.dragging);
      const fresh = parts.map((part) => (part.dataset.corner === kept.dataset.corner ? kept : part));
      const moved = parts.find((part) => part.dataset.corner === kept.dataset.corner);
      if (moved) for (const name of ["cx", "cy"]) kept.setAttribute(name, moved.getAttribute(name) || "0");
      for (const old of [...this.marks.children]) if (old !== kept) old.remove();
      for (const part of fresh) if (part !== kept) this.marks.insertBefore(part, kept);
    }
  }

  /** Moves a corner in the plane that faces the camera. @param {PointerEvent} event @param {number} i @param {number} k */
  drag(event, i, k) {
    event.preventDefault();
    const handle = /** @type {SVGElement} */ (event.currentTarget);
    this.dragging = handle;
    handle.setPointerCapture(event.pointerId);
    const corner = this.numbers.triangles[i].corners[k];
    const move = (/** @type {PointerEvent} */ { clientX, clientY }) => {
      const { P, offset } = this.world;
      const { left, top, width, height } = this.canvas.getBoundingClientRect();
      const place = [((clientX - left) / width) * SIZE[0] - 0.5, ((clientY - top) / height) * SIZE[1] - 0.5];
      const { r, C, forward } = rayOfPixel(P, place[0] + offset, place[1] + offset);
      const depth = dot(minus(corner, C), forward);
      const moved = plusTimes(C, depth / dot(r, forward), r);
      if (lengthOf(moved) < 100) this.numbers.triangles[i].corners[k] = moved.map((value) => Math.round(value * 1000) / 1000);
      this.controls.show();
      this.changed();
    };
    const end = () => {
      handle.removeEventListener("pointermove", move);
      this.dragging = null;
      this.explain();
    };
    handle.addEventListener("pointermove", move);
    handle.addEventListener("pointerup", end, { once: true });
    handle.addEventListener("pointercancel", end, { once: true });
  }
}

if (typeof document === "undefined") serveLecture(globalThis);
else new Lecture().open();
