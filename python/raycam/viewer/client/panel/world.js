// The world of the live view: its objects and lights as lists, and what may be changed of them.

import { byId, element, fillSelect } from "../dom.js";

/** @typedef {import("../client.js").Client} Client */

const MOVES = /** @type {[string, number[]][]} */ ([
  ["-x", [-1, 0, 0]], ["+x", [1, 0, 0]], ["-y", [0, -1, 0]], ["+y", [0, 1, 0]], ["-z", [0, 0, -1]], ["+z", [0, 0, 1]],
]);
const TURN = 15; // degrees
const GROWTH = 1.1;
const THIRD_STOP = 2 ** (1 / 3);

export class WorldControls {
  /** @param {Client} client */
  constructor(client) {
    this.client = client;
    this.object = byId("object", HTMLSelectElement);
    this.light = byId("light", HTMLSelectElement);
    this.shown = byId("object-visible", HTMLInputElement);
    this.step = byId("move-step", HTMLInputElement);
    this.color = byId("object-color", HTMLInputElement);
    this.cameras = byId("show-cameras", HTMLInputElement);
    /** @type {{ name: string, visible: boolean }[]} */
    this.objects = [];
    this.cameras.addEventListener("change", () => client.transport.send({ type: "overlay", cameras: this.cameras.checked }));
    this.object.addEventListener("change", () => this.choose(Number(this.object.value)));
    this.shown.addEventListener("change", () => this.edit("object", "visible", this.shown.checked));
    this.color.addEventListener("change", () => this.edit("object", "color", this.color.value));
    for (const [name, axis] of MOVES) {
      this.button("moves", name, `move ${name}`, () => this.edit("object", "move", axis.map((each) => each * Number(this.step.value) || 0)));
    }
    this.button("turns", "turn left", "turn left", () => this.edit("object", "turn", TURN));
    this.button("turns", "turn right", "turn right", () => this.edit("object", "turn", -TURN));
    this.button("turns", "larger", "larger", () => this.edit("object", "scale", GROWTH));
    this.button("turns", "smaller", "smaller", () => this.edit("object", "scale", 1 / GROWTH));
    this.button("light-strength", "brighter", "brighter light", () => this.edit("light", "strength", THIRD_STOP));
    this.button("light-strength", "darker", "darker light", () => this.edit("light", "strength", 1 / THIRD_STOP));
    for (const type of ["undo", "redo"]) {
      byId(type, HTMLButtonElement).addEventListener("click", () => client.transport.send({ type }));
    }
    byId("snapshot-glb", HTMLButtonElement).addEventListener("click", () => client.transport.send({ type: "snapshot", format: "glb" }));
  }

  /**
   * @param {string} parent
   * @param {string} text
   * @param {string} label
   * @param {() => void} act
   */
  button(parent, text, label, act) {
    const made = element("button", text, { type: "button", "aria-label": label });
    made.addEventListener("click", act);
    byId(parent, HTMLElement).append(made);
  }

  /** @param {import("../client.js").Message} contents */
  show({ editable, undo, redo, objects, lights }) {
    const [object, light] = [this.object.value, this.light.value];
    this.objects = objects;
    fillSelect(this.object, objects.map((/** @type {any} */ each, /** @type {number} */ i) => [String(i), each.name || `object ${i}`]));
    fillSelect(this.light, lights.map((/** @type {string} */ name, /** @type {number} */ i) => [String(i), name]));
    byId("edit", HTMLElement).hidden = !editable || !objects.length;
    byId("lights", HTMLElement).hidden = !editable || !lights.length;
    byId("undo", HTMLButtonElement).disabled = !undo;
    byId("redo", HTMLButtonElement).disabled = !redo;
    this.light.value = light && Number(light) < lights.length ? light : "0";
    this.choose(object && Number(object) < objects.length ? Number(object) : 0);
  }

  /** @param {number} number of the object that is changed from now on */
  choose(number) {
    if (!this.objects[number]) return;
    this.object.value = String(number);
    this.shown.checked = this.objects[number].visible;
  }

  /**
   * @param {"object" | "light"} kind
   * @param {string} key
   * @param {any} value
   */
  edit(kind, key, value) {
    const number = Number((kind === "object" ? this.object : this.light).value);
    this.client.transport.send({ type: "edit", kind, number, key, value });
  }
}
