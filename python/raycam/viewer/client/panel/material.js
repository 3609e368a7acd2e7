// The material slots of the selected object, and the fields of the selected slot's material.

import { byId, element, numbersOf } from "../dom.js";
import { grouped } from "../image/numbers.js";
import { Textures } from "./textures.js";

/** @typedef {import("../client.js").Client} Client */
/** @typedef {import("../messages").EditMaterial} EditMaterial */

export const ALL_SLOTS = -1;

export class MaterialFields {
  /** @param {Client} client @param {(slot: number) => void} onSelect called with a slot that the user selects */
  constructor(client, onSelect) {
    this.client = client;
    this.onSelect = onSelect;
    this.textures = new Textures(client);
    this.number = -1;
    /** The selected slot of the object, or `ALL_SLOTS`. */
    this.slot = 0;
    this.color = byId("object-color", HTMLInputElement);
    this.roughness = byId("object-roughness", HTMLInputElement);
    this.metallic = byId("object-metallic", HTMLInputElement);
    this.emission = byId("object-emission", HTMLInputElement);
    for (const [key, input] of /** @type {["roughness" | "metallic" | "emission", HTMLInputElement][]} */ ([["roughness", this.roughness], ["metallic", this.metallic], ["emission", this.emission]])) {
      input.addEventListener("change", () => {
        const [value] = numbersOf([input], (text) => client.say(text, "error")) || [];
        if (value !== undefined) this.edit(key, value);
      });
    }
    for (const input of [this.roughness, this.metallic]) input.addEventListener("input", () => this.showValues());
    this.color.addEventListener("change", () => this.edit("color", this.color.value));
  }

  /** @param {EditMaterial["key"]} key @param {EditMaterial["value"]} value */
  edit(key, value) {
    this.client.transport.send({ type: "edit_material", number: this.number, slot: this.slot, key, value });
  }

  /** @param {import("../client.js").Message} selected */
  show({ number, material, slots, slot, slot_count, textures }) {
    [this.number, this.slot] = [number, slot];
    this.showSlots(slots || [], slot_count || 0);
    this.textures.show(number, slot, textures || []);
    if (!material.color) return;
    const shown = [this.color, this.roughness, this.metallic, this.emission];
    const values = [material.color, material.roughness, material.metallic, Number(material.emission.toPrecision(6))];
    shown.forEach((input, i) => {
      if (document.activeElement !== input) input.value = String(values[i]);
    });
    this.showValues();
    const one = `Material: ${material.model}${material.textured ? ", with a texture" : ""}`;
    const all = "The values are those of the first material. A change applies to all materials of the object.";
    byId("object-model", HTMLElement).textContent = slot === ALL_SLOTS ? all : one;
  }

  /**
   * Lists the slots of an object that has several.
   * @param {{ name: string, color: string, textured: boolean }[]} slots
   * @param {number} count the number of slots, which may be larger than the list
   */
  showSlots(slots, count) {
    byId("slot-group", HTMLElement).hidden = count < 2;
    const rows = slots.map(({ name, color, textured }, i) => this.row(i, name || `material ${i}`, color, textured));
    byId("slots", HTMLElement).replaceChildren(this.row(ALL_SLOTS, "all materials", "", false), ...rows);
    const unlisted = byId("slots-unlisted", HTMLElement);
    unlisted.hidden = slots.length >= count;
    unlisted.textContent = `${grouped(slots.length)} of ${grouped(count)} materials are listed. To select another material, click it in the image.`;
  }

  /**
   * @param {number} slot
   * @param {string} name
   * @param {string} color as "#rrggbb"; empty for no swatch
   * @param {boolean} textured
   * @returns {HTMLElement}
   */
  row(slot, name, color, textured) {
    const row = element("li", "", slot === this.slot ? { "aria-current": "true" } : {});
    const button = element("button", "", { type: "button", class: "row-name", title: name, "data-slot": String(slot) });
    const swatch = element("span", "", { class: "swatch" });
    if (color) swatch.style.background = color;
    button.append(swatch, element("span", name, { class: "slot-name" }));
    if (textured) button.append(element("small", "texture"));
    button.addEventListener("click", () => this.onSelect(slot));
    row.append(button);
    return row;
  }

  showValues() {
    byId("roughness-text", HTMLOutputElement).textContent = Number(this.roughness.value).toFixed(2);
    byId("metallic-text", HTMLOutputElement).textContent = Number(this.metallic.value).toFixed(2);
  }
}
