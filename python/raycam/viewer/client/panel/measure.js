// The tool that measures the distance between two pixels: two clicks, a line between them, and the distance.

import { byId } from "../dom.js";
import { lengthOf, minus } from "../core/vectors.js";
import { sixDigits } from "../image/numbers.js";

/** @typedef {import("../client.js").Client} Client */

export class Measure {
  /** @param {Client} client */
  constructor(client) {
    this.client = client;
    this.button = byId("measure", HTMLButtonElement);
    this.isActive = false;
    /** The point and the pixel of the first click. @type {{ point: number[], column: number, row: number } | null} */
    this.first = null;
    this.button.addEventListener("click", () => this.toggle());
  }

  /** Starts a measurement, which requires two clicks, or cancels the current measurement. */
  toggle() {
    this.first = null;
    this.setActive(!this.isActive);
    if (this.isActive) this.client.say("Measure: click the first point.", "notice");
  }

  /** @param {boolean} isActive */
  setActive(isActive) {
    this.isActive = isActive;
    this.button.setAttribute("aria-pressed", String(isActive));
    if (isActive) this.forget();
  }

  /** Removes the measured line, which belongs to the camera's previous pose. */
  forget() {
    if (this.client.picture.layers.measured) this.client.picture.show({ measured: null });
  }

  /** @param {import("../client.js").Message} values of the held pixel */
  receive({ u, v, values }) {
    if (!this.isActive || (this.first && u === this.first.column && v === this.first.row)) return;
    const point = values.position?.numbers;
    if (!point?.every(Number.isFinite)) return this.client.say("Measure: this pixel shows no object; click another one.", "notice");
    if (!this.first) {
      this.first = { point, column: u, row: v };
      return this.client.say("Measure: click the second point.", "notice");
    }
    const { column, row } = this.first;
    const metres = `${sixDigits(lengthOf(minus(point, this.first.point)), "float64")} m`;
    this.setActive(false);
    this.first = null;
    const box = byId("distance", HTMLElement);
    box.hidden = false;
    box.textContent = `Distance from ${column}, ${row} to ${u}, ${v}: ${metres}`;
    this.client.picture.show({ measured: { from: [column + 0.5, row + 0.5], to: [u + 0.5, v + 0.5], text: metres } });
    this.client.unsay();
  }
}
