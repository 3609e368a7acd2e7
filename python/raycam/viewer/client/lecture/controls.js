// The numbers that a student turns: sliders of the camera and the lights, and the corners of the triangles.

import { byId, element } from "../dom.js";
import { LIGHTS } from "./world.js";

/** @typedef {import("./world.js").Numbers} Numbers */
/** @typedef {{ key: string, index?: number, label: string, low: number, high: number, step: number }} Slider */

/** @type {Slider[]} */
const CAMERA = [
  { key: "f", label: "f, focal length in pixels", low: 80, high: 900, step: 1 },
  { key: "skew", label: "skew", low: -150, high: 150, step: 1 },
  { key: "cx", label: "cx, principal point", low: 0, high: 319, step: 0.5 },
  { key: "cy", label: "cy", low: 0, high: 239, step: 0.5 },
  { key: "roll", label: "roll in degrees", low: -180, high: 180, step: 1 },
  { key: "pitch", label: "pitch, down", low: -89, high: 89, step: 1 },
  { key: "yaw", label: "yaw, left", low: -180, high: 180, step: 1 },
  { key: "C", index: 0, label: "C x", low: -8, high: 8, step: 0.1 },
  { key: "C", index: 1, label: "C y", low: -8, high: 8, step: 0.1 },
  { key: "C", index: 2, label: "C z", low: 0.1, high: 8, step: 0.1 },
];
/** @type {Slider[]} */
const LIGHT = [{ key: "strength", label: "strength of all", low: 0, high: 3, step: 0.05 }];

/** A group of labelled inputs that follow numbers and change them. */
export class Controls {
  /**
   * @param {any} numbers `Numbers`, changed in place
   * @param {() => void} onChange
   */
  constructor(numbers, onChange) {
    this.numbers = numbers;
    this.onChange = onChange;
    /** @type {((except: HTMLElement | undefined) => void)[]} what shows the numbers */
    this.shows = [];
    for (const slider of CAMERA) this.addSlider(byId("camera-sliders", HTMLElement), slider);
    for (const slider of LIGHT) this.addSlider(byId("light-sliders", HTMLElement), slider);
    for (const [i, triangle] of numbers.triangles.entries()) this.addCorners(i, triangle.name);
    LIGHTS.forEach(([name], i) => this.addLight(name, i + 1));
  }

  /** @param {HTMLElement} parent @param {Slider} slider */
  addSlider(parent, { key, index, label, low, high, step }) {
    const id = `${key}${index ?? ""}`;
    const range = /** @type {HTMLInputElement} */ (element("input", "", { type: "range", min: String(low), max: String(high), step: String(step), id: `${id}-range`, "aria-label": label }));
    const field = /** @type {HTMLInputElement} */ (element("input", "", { type: "number", step: String(step), id, "aria-label": `${label}, as a number` }));
    const row = element("div", "", { class: "slider" });
    row.append(element("span", label), field, range);
    parent.append(row);
    const take = (/** @type {HTMLInputElement} */ from) => {
      if (!from.value || !Number.isFinite(from.valueAsNumber)) return;
      if (index === undefined) this.numbers[key] = from.valueAsNumber;
      else this.numbers[key][index] = from.valueAsNumber;
      this.show(from);
      this.onChange();
    };
    range.addEventListener("input", () => take(range));
    field.addEventListener("input", () => take(field));
    this.shows.push((/** @type {HTMLElement | undefined} */ except) => {
      const value = String(index === undefined ? this.numbers[key] : this.numbers[key][index]);
      if (except !== range) range.value = String(Math.max(low, Math.min(high, Number(value))));
      if (except !== field) field.value = value;
    });
  }

  /** @param {number} i of a triangle @param {string} name */
  addCorners(i, name) {
    const group = element("fieldset");
    group.append(element("legend", `The ${name} triangle`));
    "abc".split("").forEach((letter, k) => {
      const row = element("div", "", { class: "corner" });
      row.append(element("span", letter));
      ["x", "y", "z"].forEach((axis, j) => {
        const field = /** @type {HTMLInputElement} */ (element("input", "", { type: "number", step: "0.1", "aria-label": `${name} ${letter} ${axis}` }));
        field.addEventListener("input", () => {
          if (!field.value || !Number.isFinite(field.valueAsNumber)) return;
          this.numbers.triangles[i].corners[k][j] = field.valueAsNumber;
          this.onChange();
        });
        this.shows.push((/** @type {HTMLElement | undefined} */ _) => {
          if (document.activeElement !== field) field.value = String(this.numbers.triangles[i].corners[k][j]);
        });
        row.append(field);
      });
      group.append(row);
    });
    byId("corner-fields", HTMLElement).append(group);
  }

  /** @param {string} name @param {number} count */
  addLight(name, count) {
    const label = element("label");
    const choice = /** @type {HTMLInputElement} */ (element("input", "", { type: "radio", name: "lights", value: String(count) }));
    choice.addEventListener("change", () => {
      this.numbers.lights = count;
      this.onChange();
    });
    this.shows.push(() => (choice.checked = this.numbers.lights === count));
    label.append(choice, `${count}: ${count === 1 ? name : `and ${name}`}`);
    byId("light-count", HTMLElement).append(label);
  }

  /** Shows all numbers, except in the input that they came from. @param {HTMLElement} [except] */
  show(except) {
    for (const show of this.shows) show(except);
  }
}
