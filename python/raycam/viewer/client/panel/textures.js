// The textures of the selected material, as small images. Textures can be replaced by a file, or removed.

import { byId, element } from "../dom.js";
import { sendPieces } from "../drop.js";

/** @typedef {import("../client.js").Client} Client */
/** @typedef {{ texture: import("../messages").Texture["texture"], file: string, used: boolean }} Texture */

const LARGEST_IMAGE = 2 ** 28;
const IMAGE_TYPES = "image/png,image/jpeg,image/webp";

export class Textures {
  /** @param {Client} client */
  constructor(client) {
    this.client = client;
    this.number = -1;
    /** The slot of the material. */
    this.slot = 0;
    /** The shown textures as text: only a change requests images. */
    this.shown = "";
    this.list = byId("textures", HTMLElement);
    this.input = /** @type {HTMLInputElement} */ (element("input", "", { type: "file", accept: IMAGE_TYPES, hidden: "", "aria-label": "Texture file" }));
    this.list.after(this.input);
    /** The texture whose file is chosen. @type {Texture["texture"]} */
    this.texture = "color";
    this.input.addEventListener("change", () => this.replace());
  }

  /** @param {number} number of the object @param {number} slot of its material @param {Texture[]} textures */
  show(number, slot, textures) {
    byId("texture-group", HTMLElement).hidden = !textures.length;
    const text = JSON.stringify([number, slot, textures]);
    if (text === this.shown) return;
    [this.number, this.slot, this.shown] = [number, slot, text];
    this.list.replaceChildren(...textures.map((each) => this.row(each)));
    if (textures.some(({ used }) => used)) this.client.transport.send({ type: "thumbnails", number, slot });
  }

  /** @param {Texture} described @returns {HTMLElement} */
  row({ texture, file, used }) {
    const row = element("li", "", { "data-texture": texture });
    const frame = element("span", "", { class: "thumbnail" });
    const name = element("span", texture, { class: "slot-name" });
    name.append(element("small", used ? file || "image" : "none"));
    const replace = element("button", used ? "Replace" : "Add", { type: "button", "aria-label": `${used ? "replace" : "add"} the ${texture} texture` });
    replace.addEventListener("click", () => {
      this.texture = texture;
      this.input.click();
    });
    row.append(frame, name, replace);
    if (used) {
      const clear = element("button", "Clear", { type: "button", "aria-label": `clear the ${texture} texture` });
      clear.addEventListener("click", () => this.client.transport.send({ type: "texture", number: this.number, slot: this.slot, texture, file: "" }));
      row.append(clear);
    }
    return row;
  }

  /** @param {import("../client.js").Message} thumbnails */
  receive({ number, slot, images }) {
    if (number !== this.number || slot !== Math.max(this.slot, 0)) return;
    for (const row of /** @type {NodeListOf<HTMLElement>} */ (this.list.querySelectorAll("[data-texture]"))) {
      const source = images[row.dataset.texture || ""];
      if (source) row.querySelector(".thumbnail")?.replaceChildren(element("img", "", { src: source, alt: `${row.dataset.texture} texture` }));
    }
  }

  /** Sends the chosen file, and makes it the texture of the material. */
  async replace() {
    const file = this.input.files?.[0];
    this.input.value = "";
    if (!file) return;
    if (!file.size || file.size > LARGEST_IMAGE) return this.client.say(`${file.name}: expected an image of 1 byte to 256 MiB.`, "error");
    const { number, slot, texture } = this;
    await sendPieces(this.client, file.name, file);
    this.client.transport.send({ type: "texture", number, slot, texture, file: file.name });
  }
}
