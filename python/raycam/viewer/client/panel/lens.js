// The lens of the live view: focal lengths, principal point and distortion as numbers that can be edited.

import { byId, element, numbersOf } from "../dom.js";

/** @typedef {import("../client.js").Client} Client */
/** @typedef {{ model: string, fx: number, fy: number, cx: number, cy: number, distortion: number[], names: string[], size: number[], corner: number }} Lens */

/** The smallest and the largest numbers that the server accepts. */
const FOCALS = ["0.001", "1e7"], PLACES = ["-1e7", "1e7"], COEFFICIENTS = ["-1e6", "1e6"];
const INTRINSICS = /** @type {const} */ (["fx", "fy", "cx", "cy"]);

const TITLES = /** @type {Record<string, string>} */ ({
  fx: "Horizontal focal length in pixels", fy: "Vertical focal length in pixels",
  cx: "Column of the principal point in pixels", cy: "Row of the principal point in pixels",
});

/** @param {string} name @returns {string} the tooltip of a field */
const titleOf = (name) => TITLES[name] || `Coefficient ${name} of the lens model`;

export class LensControls {
  /** @param {Client} client */
  constructor(client) {
    this.client = client;
    this.fields = byId("lens-fields", HTMLElement);
    this.shape = "";
    /** The camera that the lens belongs to; moves do not change it. */
    this.subject = "";
    /** @type {HTMLInputElement[]} */
    this.inputs = [];
  }

  /** @param {Lens} lens of the camera in its own size @param {string} camera the camera's name; empty if it was moved */
  show(lens, camera) {
    const shape = [lens.model, ...lens.names].join(" ");
    byId("lens-model", HTMLElement).textContent = lens.model;
    if (shape !== this.shape) this.build([...INTRINSICS, ...lens.names]);
    const subject = `${shape} ${lens.size.join(" ")}`;
    if (camera || !this.subject.endsWith(subject)) this.subject = `${camera} ${subject}`;
    [this.shape, this.fields.dataset.subject] = [shape, this.subject];
    const values = [...INTRINSICS.map((name) => lens[name]), ...lens.distortion];
    this.inputs.forEach((input, i) => {
      if (document.activeElement !== input) input.value = String(values[i]);
    });
  }

  /** @param {string[]} names of the intrinsics and of the lens coefficients */
  build(names) {
    this.inputs = names.map((name, i) => {
      const step = i < INTRINSICS.length ? "1" : "0.001";
      const [min, max] = i < 2 ? FOCALS : i < INTRINSICS.length ? PLACES : COEFFICIENTS;
      return /** @type {HTMLInputElement} */ (element("input", "", { type: "number", step, min, max, "data-name": name }));
    });
    this.fields.replaceChildren(
      ...this.inputs.map((input, i) => {
        const label = element("label", `${names[i]}${i < INTRINSICS.length ? ", px" : ""} `, { title: titleOf(names[i]) });
        label.append(input);
        input.addEventListener("change", () => this.tell());
        return label;
      }),
    );
  }

  tell() {
    const values = numbersOf(this.inputs, (text) => this.client.say(text, "error"));
    if (!values) return;
    const [fx, fy, cx, cy, ...distortion] = values;
    this.client.transport.send({ type: "lens", fx, fy, cx, cy, distortion });
  }
}
