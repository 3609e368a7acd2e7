// The display controls: exposure and view transform of colours, colour map and range of scalars.

import { styleOf } from "../image/channels.js";
import { MAPS } from "../image/colormap.js";
import { byId, fillSelect } from "../dom.js";
import { extremes, percentiles, rangeOf } from "../image/paint.js";
import { VIEW_TRANSFORMS } from "../image/tone.js";

/** @typedef {import("../image/paint.js").Display} Display */
/** @typedef {import("../image/planes.js").Plane} Plane */

const MOST_STOPS = 100; // the largest exposure in stops that the server accepts, positive or negative

export class DisplayControls {
  /** @param {() => void} changed called when a control was moved */
  constructor(changed) {
    /** @type {Display} */
    this.display = { exposure: 0, view: "standard", map: "viridis", range: null };
    this.changed = changed;
    /** The exposure that Reset restores. */
    this.firstExposure = 0;
    /** Called with an error message about a typed number. @type {(text: string) => void} */
    this.onWrong = () => {};
    /** Called when exposure or view transform change. @type {(display: Display) => void} */
    this.onDisplay = () => {};
    /** @type {Map<string, import("../image/paint.js").Range>} chosen ranges by channel */
    this.ranges = new Map();
    this.exposure = byId("exposure", HTMLInputElement);
    this.view = byId("view-transform", HTMLSelectElement);
    this.map = byId("map", HTMLSelectElement);
    this.low = byId("range-low", HTMLInputElement);
    this.high = byId("range-high", HTMLInputElement);
    this.log = byId("range-log", HTMLInputElement);
    /** @type {Plane | null} */
    this.plane = null;
    this.isExact = true;
    /** The function that computes the range when exact numbers arrive. @type {((plane: Plane) => import("../image/paint.js").Range) | null} */
    this.pending = null;
    /** Called when exact numbers are needed. */
    this.onExact = () => {};
    fillSelect(this.view, VIEW_TRANSFORMS.map((name) => [name, name]));
    fillSelect(this.map, MAPS.map((name) => [name, name]));
    this.exposure.addEventListener("input", () => this.setExposure(Number(this.exposure.value)));
    byId("exposure-reset", HTMLButtonElement).addEventListener("click", () => this.setExposure(this.firstExposure));
    this.view.addEventListener("change", () => this.setView(this.view.value));
    this.map.addEventListener("change", () => {
      this.display.map = this.map.value;
      this.changed();
    });
    for (const input of [this.low, this.high, this.log]) input.addEventListener("change", () => this.readRange());
    byId("range-percentiles", HTMLButtonElement).addEventListener("click", () => this.measureRange((plane) => percentiles(plane, 0)));
    byId("range-extremes", HTMLButtonElement).addEventListener("click", () => this.measureRange(extremes));
  }

  /** @param {number} stops */
  setExposure(stops) {
    const exposure = Math.min(Math.max(stops, -MOST_STOPS), MOST_STOPS);
    this.display.exposure = exposure;
    this.exposure.min = String(Math.min(Number(this.exposure.min), exposure));
    this.exposure.max = String(Math.max(Number(this.exposure.max), exposure));
    this.exposure.value = String(exposure);
    byId("exposure-text", HTMLOutputElement).textContent = `${exposure > 0 ? "+" : ""}${Number(exposure.toFixed(2))} stops`;
    this.onDisplay(this.display);
    this.changed();
  }

  /** @param {string} view */
  setView(view) {
    this.display.view = view;
    this.view.value = view;
    this.onDisplay(this.display);
    this.changed();
  }

  nextView() {
    this.setView(VIEW_TRANSFORMS[(VIEW_TRANSFORMS.indexOf(this.display.view) + 1) % VIEW_TRANSFORMS.length]);
  }

  /** Sets the range that a function computes from exact numbers; requests these first if they are missing. @param {(plane: Plane) => import("../image/paint.js").Range} measure */
  measureRange(measure) {
    this.pending = this.isExact ? null : measure;
    if (this.pending) this.onExact();
    else if (this.plane) this.setRange(measure(this.plane));
  }

  readRange() {
    const [low, high, log] = [Number(this.low.value), Number(this.high.value), this.log.checked];
    if (this.low.value && this.high.value && low < high && (high > 0 || !log)) return this.setRange({ low, high, log });
    this.onWrong(log && !(high > 0) ? "A logarithmic range must end above 0." : "The second number of a range must be larger than the first one.");
    this.showRange();
  }

  /** @param {import("../image/paint.js").Range} range */
  setRange(range) {
    if (!this.plane) return;
    this.ranges.set(this.plane.name, { ...range, log: this.log.checked });
    this.show(this.plane);
    this.changed();
  }

  /**
   * Shows the controls that apply to a plane.
   * @param {Plane} plane
   * @param {boolean} [isExact] false for numbers that are rounded for display
   */
  show(plane, isExact = this.isExact) {
    this.plane = plane;
    this.isExact = isExact;
    const { pending } = this;
    this.pending = isExact ? null : pending;
    if (pending && isExact) this.ranges.set(plane.name, { ...pending(plane), log: this.log.checked });
    this.display.range = this.ranges.get(plane.name) || null;
    const { kind } = styleOf(plane);
    byId("light-controls", HTMLElement).hidden = kind !== "light";
    byId("scalar-controls", HTMLElement).hidden = kind !== "scalar";
    if (kind === "scalar") this.showRange();
  }

  /** Shows the controls of an image without numbers. */
  showLight() {
    this.plane = null;
    byId("light-controls", HTMLElement).hidden = false;
    byId("scalar-controls", HTMLElement).hidden = true;
    byId("legend", HTMLElement).replaceChildren();
  }

  showRange() {
    if (!this.plane) return;
    const { low, high, log } = rangeOf(this.plane, this.display);
    this.low.value = String(Number(low.toPrecision(6)));
    this.high.value = String(Number(high.toPrecision(6)));
    this.log.checked = log;
  }
}
