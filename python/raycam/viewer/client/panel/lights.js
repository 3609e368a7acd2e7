// The lights of the world: strength, colour, position and direction of the selected light; adding and removing lights.

import { byId, fillSelect, numbersOf } from "../dom.js";

/** @typedef {import("../client.js").Client} Client */
/** @typedef {{ name: string, unit: string, color: string | null, level: number | null, position: number[] | null, direction: number[] | null }} SceneLight */

const LIGHT_TYPES = /** @type {[string, string][]} */ ([["", "Add a light"], ["point", "point light"], ["spot", "spot light"], ["sun", "sun"], ["area", "area light"]]);

export class LightControls {
  /** @param {Client} client */
  constructor(client) {
    this.client = client;
    /** @type {SceneLight[]} */
    this.lights = [];
    this.light = byId("light", HTMLSelectElement);
    this.color = byId("light-color", HTMLInputElement);
    this.level = byId("light-level", HTMLInputElement);
    this.type = byId("light-type", HTMLSelectElement);
    this.vectors = /** @type {const} */ (["position", "direction"]).map((key) => ({
      key, box: byId(`light-${key}`, HTMLElement), inputs: ["x", "y", "z"].map((axis) => byId(`light-${key}-${axis}`, HTMLInputElement)),
    }));
    const wrong = (/** @type {string} */ text) => client.say(text, "error");
    fillSelect(this.type, LIGHT_TYPES);
    this.light.addEventListener("change", () => this.select(Number(this.light.value)));
    this.color.addEventListener("change", () => this.change("color", this.color.value));
    this.level.addEventListener("change", () => {
      const [value] = numbersOf([this.level], wrong) || [];
      if (value !== undefined) this.change("level", value);
    });
    for (const { key, inputs } of this.vectors) {
      inputs.forEach((input, axis) => {
        input.addEventListener("change", () => {
          const [value] = numbersOf([input], wrong) || [];
          if (value !== undefined) this.change(key, [axis, value]);
        });
      });
    }
    this.type.addEventListener("change", () => {
      const { value } = this.type;
      this.type.value = "";
      this.awaited++;
      client.transport.send({ type: "edit", kind: "light", number: 0, key: "add", value });
    });
    byId("light-remove", HTMLButtonElement).addEventListener("click", () => this.change("remove", true));
    /** Called with the number of the light that is selected. @type {(number: number) => void} */
    this.onSelect = () => {};
    /** The number of added lights that are not listed yet. */
    this.awaited = 0;
  }

  /** @param {"color" | "level" | "position" | "direction" | "remove"} key @param {import("../messages").Edit["value"]} value */
  change(key, value) {
    this.client.transport.send({ type: "edit", kind: "light", number: Number(this.light.value), key, value });
  }

  /** @param {SceneLight[]} lights */
  show(lights) {
    const before = this.light.value;
    const added = lights.length - this.lights.length;
    this.lights = lights;
    byId("lights", HTMLElement).hidden = byId("light-remove", HTMLElement).hidden = !lights.length;
    fillSelect(this.light, lights.map(({ name }, i) => [String(i), name]));
    if (added > 0 && this.awaited > 0) {
      this.awaited = Math.max(this.awaited - added, 0);
      return this.select(lights.length - 1);
    }
    this.light.value = before && Number(before) < lights.length ? before : "0";
    this.showFields();
  }

  /** Shows a light in the panel, and its handles over the image. @param {number} number */
  select(number) {
    this.light.value = String(number);
    this.client.transport.send({ type: "select_light", number });
    this.onSelect(number);
    this.showFields();
  }

  showFields() {
    const light = this.lights[Number(this.light.value)];
    byId("light-group", HTMLElement).dataset.subject = light ? `${this.light.value} ${this.lights.length}` : "";
    if (!light) return;
    const put = (/** @type {HTMLInputElement} */ input, /** @type {string} */ value) => document.activeElement !== input && (input.value = value);
    byId("light-color-row", HTMLElement).hidden = light.color === null;
    byId("light-level-row", HTMLElement).hidden = light.level === null;
    byId("light-unit", HTMLElement).textContent = light.unit;
    if (light.color) put(this.color, light.color);
    if (light.level !== null) put(this.level, String(light.level));
    for (const { key, box, inputs } of this.vectors) {
      const values = light[key];
      box.hidden = !values;
      if (values) inputs.forEach((input, i) => put(input, String(Number(values[i].toFixed(6)))));
    }
  }
}
