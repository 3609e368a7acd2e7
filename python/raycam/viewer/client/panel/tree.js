// The scene tree: objects, lights and cameras by name. Objects can be searched, hidden and isolated.

import { byId, element, icon } from "../dom.js";

const EYE = "M1 8 Q8 1.5 15 8 Q8 14.5 1 8 Z M8 5.8 A2.2 2.2 0 1 0 8.01 5.8";
const CLOSED_EYE = "M1 7 Q8 13 15 7 M3 9.5 L1.8 11.5 M8 11 L8 13.2 M13 9.5 L14.2 11.5";

/** @typedef {{ name: string, visible: boolean }} TreeObject */
/**
 * @typedef {object} TreeListener
 * @property {(number: number) => void} select
 * @property {(number: number, visible: boolean) => void} show
 * @property {(number: number, isOnly: boolean) => void} isolate
 * @property {(number: number) => void} light
 * @property {(name: string) => void} lookThrough
 */

export class SceneTree {
  /** @param {TreeListener} listener */
  constructor(listener) {
    this.listener = listener;
    /** @type {TreeObject[]} */
    this.objects = [];
    /** @type {string[]} */
    this.lights = [];
    /** @type {string[]} */
    this.cameras = [];
    this.selected = -1;
    this.selectedLight = -1;
    this.editable = false;
    this.search = byId("tree-search", HTMLInputElement);
    this.search.addEventListener("input", () => this.draw());
  }

  /** @param {Partial<Pick<SceneTree, "objects" | "lights" | "cameras" | "editable" | "selected" | "selectedLight">>} changed */
  show(changed) {
    Object.assign(this, changed);
    this.draw();
  }

  draw() {
    const wanted = this.search.value.trim().toLowerCase();
    const matches = (/** @type {string} */ name) => name.toLowerCase().includes(wanted);
    const objects = this.objects.map(({ name }, i) => name || `object ${i}`);
    const groups = /** @type {[string, HTMLElement[]][]} */ ([
      ["Objects", objects.flatMap((name, i) => (matches(name) ? [this.objectRow(name, i)] : []))],
      ["Lights", this.lights.flatMap((name, i) => (matches(name) ? [this.plainRow(name, () => this.listener.light(i), i === this.selectedLight)] : []))],
      ["Cameras", this.cameras.flatMap((name) => (matches(name) ? [this.plainRow(name, () => this.listener.lookThrough(name))] : []))],
    ]);
    const list = byId("tree-list", HTMLElement);
    const top = list.scrollTop;
    list.replaceChildren(...groups.flatMap(([title, rows]) => {
      if (!rows.length) return [];
      const made = element("ul", "", { "aria-label": title });
      made.append(...rows);
      return [element("h2", title), made];
    }));
    if (!list.children.length) list.append(element("p", wanted ? `Nothing matches "${this.search.value}".` : "The world is empty."));
    list.scrollTop = top;
  }

  /**
   * @param {string} name
   * @param {() => void} act
   * @param {boolean} isSelected
   * @returns {HTMLElement}
   */
  plainRow(name, act, isSelected = false) {
    const row = element("li", "", isSelected ? { "aria-current": "true" } : {});
    const button = element("button", name, { type: "button", class: "row-name", title: name });
    button.addEventListener("click", act);
    row.append(button);
    return row;
  }

  /**
   * @param {string} name
   * @param {number} number
   * @returns {HTMLElement}
   */
  objectRow(name, number) {
    const { visible } = this.objects[number];
    const row = this.plainRow(name, () => this.listener.select(number), number === this.selected);
    row.classList.toggle("off", !visible);
    if (!this.editable) return row;
    if (this.objects.length > 1) {
      const isAlone = visible && this.objects.filter((each) => each.visible).length === 1;
      const [text, title, label] = isAlone ? ["all", "Show all objects", "show all objects"] : ["only", "Hide all other objects", `show only ${name}`];
      const only = element("button", text, { type: "button", class: "row-only", title, "aria-label": label });
      only.addEventListener("click", () => this.listener.isolate(number, !isAlone));
      row.append(only);
    }
    const label = `${visible ? "hide" : "show"} ${name}`;
    const eye = element("button", "", { type: "button", class: "row-eye", "aria-label": label, title: label, "aria-pressed": String(!visible) });
    eye.append(icon(visible ? EYE : CLOSED_EYE));
    eye.addEventListener("click", () => this.listener.show(number, !visible));
    row.append(eye);
    return row;
  }
}
