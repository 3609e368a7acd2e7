// The textures of the selected material, as small images. Textures can be replaced by a file, or removed.

import { byId, element } from "../dom.js";
import { sendPieces } from "../drop.js";

/** @typedef {import("../client.js").Client} Client */
/** @typedef {{ slot: import("../messages").Texture["slot"], file: string, used: boolean }} TextureSlot */

const LARGEST_IMAGE = 2 ** 28;
const IMAGE_TYPES = "image/png,image/jpeg,image/webp";

export class TextureSlots {
  /** @param {Client} client */
  constructor(client) {
    this.client = client;
    this.number = -1;
    this.material = 0;
    /** The shown slots as text: only a change requests images. */
    this.shown = "";
    this.list = byId("textures", HTMLElement);
    this.input = /** @type {HTMLInputElement} */ (element("input", "", { type: "file", accept: IMAGE_TYPES, hidden: "", "aria-label": "Texture file" }));
    this.list.after(this.input);
    /** The slot whose file is chosen. @type {TextureSlot["slot"]} */
    this.slot = "color";
    this.input.addEventListener("change", () => this.replace());
  }

  /** @param {number} number of the object @param {number} material the slot of its material @param {TextureSlot[]} slots */
  show(number, material, slots) {
    byId("texture-group", HTMLElement).hidden = !slots.length;
    const text = JSON.stringify([number, material, slots]);
    if (text === this.shown) return;
    [this.number, this.material, this.shown] = [number, material, text];
    this.list.replaceChildren(...slots.map((each) => this.row(each)));
    if (slots.some(({ used }) => used)) this.client.transport.send({ type: "thumbnails", number, material });
  }

  /** @param {TextureSlot} slot @returns {HTMLElement} */
  row({ slot, file, used }) {
    const row = element("li", "", { "data-slot": slot });
    const frame = element("span", "", { class: "thumbnail" });
    const name = element("span", slot, { class: "slot-name" });
    name.append(element("small", used ? file || "image" : "none"));
    const replace = element("button", used ? "Replace" : "Add", { type: "button", "aria-label": `${used ? "replace" : "add"} the ${slot} texture` });
    replace.addEventListener("click", () => {
      this.slot = slot;
      this.input.click();
    });
    row.append(frame, name, replace);
    if (used) {
      const clear = element("button", "Clear", { type: "button", "aria-label": `clear the ${slot} texture` });
      clear.addEventListener("click", () => this.client.transport.send({ type: "texture", number: this.number, material: this.material, slot, file: "" }));
      row.append(clear);
    }
    return row;
  }

  /** @param {import("../client.js").Message} thumbnails */
  receive({ number, material, images }) {
    if (number !== this.number || material !== Math.max(this.material, 0)) return;
    for (const row of /** @type {NodeListOf<HTMLElement>} */ (this.list.querySelectorAll("[data-slot]"))) {
      const source = images[row.dataset.slot || ""];
      if (source) row.querySelector(".thumbnail")?.replaceChildren(element("img", "", { src: source, alt: `${row.dataset.slot} texture` }));
    }
  }

  /** Sends the chosen file, and makes it the texture of the slot. */
  async replace() {
    const file = this.input.files?.[0];
    this.input.value = "";
    if (!file) return;
    if (!file.size || file.size > LARGEST_IMAGE) return this.client.say(`${file.name}: expected an image of 1 byte to 256 MiB.`, "error");
    const { number, material, slot } = this;
    await sendPieces(this.client, file.name, file);
    this.client.transport.send({ type: "texture", number, material, slot, file: file.name });
  }
}
