// The points of a lidar's scan over the image: their colours, and the fields of the point under the pointer.

import { byId, fillSelect } from "../dom.js";
import { grouped, sixDigits } from "../image/numbers.js";

/** @typedef {import("../client.js").Client} Client */
/** @typedef {"ring" | "time" | "intensity" | "instance"} ScanField */

const REACH = 8; // distance in CSS pixels within which the pointer finds a point
const AGAIN = 300; // milliseconds after a change of the world until a new scan is requested
const GOLDEN = 137.508; // golden angle in degrees: difference between the hues of consecutive numbers
const HUES = [240, 0]; // hues of the smallest and the largest value, in degrees

export class ScanControls {
  /** @param {Client} client */
  constructor(client) {
    this.client = client;
    this.group = byId("scan-group", HTMLElement);
    this.lidar = byId("scan-lidar", HTMLSelectElement);
    this.field = byId("scan-field", HTMLSelectElement);
    this.values = byId("scan-values", HTMLElement);
    /** The fields of the points, by name. @type {Record<string, number[]>} */
    this.fields = {};
    /** @type {string[]} */
    this.colors = [];
    this.timer = 0;
    fillSelect(this.field, [["ring", "ring"], ["time", "time"], ["intensity", "intensity"], ["instance", "object"]]);
    this.lidar.addEventListener("change", () => this.request());
    this.field.addEventListener("change", () => this.paint());
    client.picture.pointColor = (number) => this.colors[number] || "#ffffff";
    client.picture.canvas.addEventListener("pointermove", (event) => this.hover(event.offsetX, event.offsetY));
  }

  /** @param {import("../client.js").Message} message */
  receive(message) {
    if (message.type === "welcome") this.begin(message.lidars || []);
    if (message.type === "scan") this.show(message);
  }

  /** @param {string[]} names of the world's lidars */
  begin(names) {
    const chosen = this.lidar.value;
    this.group.hidden = !names.length;
    fillSelect(this.lidar, [["", "none"], ...names.map((name) => /** @type {[string, string]} */ ([name, name]))]);
    this.lidar.value = names.includes(chosen) ? chosen : "";
    if (this.lidar.value) this.request();
  }

  request() {
    this.client.transport.send({ type: "scan", lidar: this.lidar.value });
    if (this.lidar.value) this.values.textContent = "scanning";
  }

  /** Shows the next lidar's points, or none after the last lidar. */
  next() {
    if (this.group.hidden) return this.client.say("This world has no lidars.", "notice");
    this.lidar.selectedIndex = (this.lidar.selectedIndex + 1) % this.lidar.options.length;
    this.request();
  }

  /** @param {import("../client.js").Message} message */
  show({ lidar, fields, total }) {
    clearTimeout(this.timer);
    this.fields = fields;
    const count = fields.ring?.length || 0;
    this.values.textContent = lidar ? `${grouped(total)} points${count < total ? `, ${grouped(count)} are shown` : ""}` : "";
    this.paint();
    // A message without a lidar reports a change of the world, so a new scan is requested.
    if (!lidar && this.lidar.value) this.timer = setTimeout(() => this.request(), AGAIN);
  }

  /** Colours the points by the chosen field. */
  paint() {
    const values = this.fields[this.field.value] || [];
    if (this.field.value === "instance") this.colors = values.map((value) => `hsl(${(value * GOLDEN) % 360} 85% 60%)`);
    else {
      const low = values.reduce((a, b) => Math.min(a, b), Infinity), high = values.reduce((a, b) => Math.max(a, b), -Infinity);
      const hue = (/** @type {number} */ value) => HUES[0] + ((HUES[1] - HUES[0]) * (value - low)) / (high - low || 1);
      this.colors = values.map((value) => `hsl(${hue(value).toFixed(1)} 95% 60%)`);
    }
    this.client.picture.draw();
  }

  /**
   * Shows the fields of the point that is nearest to a point on the canvas.
   * @param {number} x
   * @param {number} y
   */
  hover(x, y) {
    const { picture } = this.client;
    const points = picture.layers.overlay.find((each) => each.points)?.points;
    if (!points) return;
    let best = REACH, found = -1;
    for (let i = 0; i < points.length; i += 3) {
      const distance = Math.hypot(picture.left + points[i + 1] * picture.zoom - x, picture.top + points[i + 2] * picture.zoom - y);
      if (distance < best) [best, found] = [distance, points[i]];
    }
    if (found < 0) return;
    const number = (/** @type {string} */ name) => sixDigits(this.fields[name][found], "float64");
    const instance = this.fields.instance[found];
    const object = this.client.names.instance?.[instance] || instance;
    this.values.textContent = `${number("distance")} m, ring ${number("ring")}, ${number("time")} ms, intensity ${number("intensity")}, return ${number("return")}, object ${object}`;
  }
}
