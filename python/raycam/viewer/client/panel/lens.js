// The lens of the live view: focal lengths, principal point and distortion as numbers to be changed.

import { byId, element } from "../dom.js";

/** @typedef {import("../client.js").Client} Client */
/** @typedef {{ model: string, fx: number, fy: number, cx: number, cy: number, distortion: number[], names: string[] }} Lens */

const INTRINSICS = /** @type {const} */ (["fx", "fy", "cx", "cy"]);

export class LensControls {
  /** @param {Client} client */
  constructor(client) {
    this.client = client;
    this.fields = byId("lens-fields", HTMLElement);
    this.shape = "";
    /** @type {HTMLInputElement[]} */
    this.inputs = [];
  }

  /** @param {Lens} lens of the camera in its own size */
  show(lens) {
    const shape = [lens.model, ...lens.names].join(" ");
    byId("lens-model", HTMLElement).textContent = lens.model;
    if (shape !== this.shape) this.build([...INTRINSICS, ...lens.names]);
    this.shape = shape;
    const values = [...INTRINSICS.map((name) => lens[name]), ...lens.distortion];
    this.inputs.forEach((input, i) => {
      if (document.activeElement !== input) input.value = String(values[i]);
    });
  }

  /** @param {string[]} names */
  build(names) {
    this.inputs = names.map((name, i) => {
      const step = i < INTRINSICS.length ? "1" : "0.001";
      return /** @type {HTMLInputElement} */ (element("input", "", { type: "number", step, "data-name": name }));
    });
    this.fields.replaceChildren(
      ...this.inputs.map((input, i) => {
        const label = element("label", `${names[i]} `);
        label.append(input);
        input.addEventListener("change", () => this.tell());
        return label;
      }),
    );
  }

  tell() {
    const values = this.inputs.map((input) => Number(input.value));
    if (this.inputs.some((input) => !input.value) || !values.every(Number.isFinite)) {
      return this.client.say("A lens has numbers in all of its fields.", "error");
    }
    const [fx, fy, cx, cy, ...distortion] = values;
    this.client.transport.send({ type: "lens", fx, fy, cx, cy, distortion });
  }
}
