// The world of the live view: the selected object and its properties, and the strengths of lights.

import { byId, element, fillSelect } from "../dom.js";
import { grouped } from "../image/numbers.js";
import { LightControls } from "./lights.js";
import { MaterialFields } from "./material.js";
import { PlacementFields } from "./placement.js";
import { SceneTree } from "./tree.js";

/** @typedef {import("../client.js").Client} Client */

const TURN = 15; // degrees by which the turn buttons rotate the selected object
const GROWTH = 1.1;
const REVEALED_HEIGHT = 256; // CSS pixels of the group Selection that are visible after a click on the image
const THIRD_STOP = 2 ** (1 / 3);

export class WorldControls {
  /** @param {Client} client */
  constructor(client) {
    this.client = client;
    this.object = byId("object", HTMLSelectElement);
    this.lights = new LightControls(client);
    this.material = new MaterialFields(client, (slot) => this.selectSlot(slot));
    this.placement = new PlacementFields((place, value) => this.edit("object", "place", [place, value]), (text) => client.say(text, "error"));
    this.shown = byId("object-visible", HTMLInputElement);
    this.tool = "none";
    this.tools = /** @type {HTMLButtonElement[]} */ ([...document.querySelectorAll("[data-tool]")]);
    for (const button of this.tools) button.addEventListener("click", () => this.setTool(button.dataset.tool || "none"));
    this.showTool();
    this.cameras = byId("show-cameras", HTMLInputElement);
    this.explained = byId("show-explained", HTMLInputElement);
    this.grid = byId("show-grid", HTMLInputElement);
    this.count = 0;
    /** @type {{ name: string, visible: boolean }[]} */
    this.objects = [];
    this.selected = -1;
    /** The selected material slot of the object. */
    this.slot = 0;
    this.names = "";
    /** True once the user has selected an object; objects are outlined only after that. */
    this.isChosen = false;
    /** True from the choice of a tool or an object until the server's answer, if handles are expected over the image. */
    this.expectsHandles = false;
    this.tree = new SceneTree({
      select: (number) => {
        this.pick(number);
        byId("edit", HTMLDetailsElement).open = true;
        byId("edit", HTMLElement).scrollIntoView({ block: "start" });
      },
      show: (number, visible) => this.change("object", number, "visible", visible),
      isolate: (number, isOnly) => this.change("object", number, "isolate", isOnly),
      light: (number) => {
        this.lights.select(number);
        byId("light-group", HTMLElement).scrollIntoView({ block: "nearest" });
      },
      lookThrough: (name) => this.lookThrough(name),
    });
    this.lights.onSelect = (number) => {
      byId("light-group", HTMLDetailsElement).open = true;
      this.tree.show({ selectedLight: number, selected: -1 });
    };
    /** Called with the name of a camera that is chosen in the tree. @type {(name: string) => void} */
    this.lookThrough = () => {};
    for (const box of [this.cameras, this.explained, this.grid]) box.addEventListener("change", () => this.tellOverlay());
    this.object.addEventListener("change", () => this.pick(Number(this.object.value)));
    this.shown.addEventListener("change", () => this.edit("object", "visible", this.shown.checked));
    this.button("turns", "turn left", `Rotate by ${TURN}° counterclockwise, seen from above`, () => this.edit("object", "turn", TURN));
    this.button("turns", "turn right", `Rotate by ${TURN}° clockwise, seen from above`, () => this.edit("object", "turn", -TURN));
    this.button("turns", "larger", "Enlarge by 10 %", () => this.edit("object", "scale", GROWTH));
    this.button("turns", "smaller", "Shrink by 9 %", () => this.edit("object", "scale", 1 / GROWTH));
    this.button("light-strength", "brighter", "Increase the strength by a third of a stop (26 %)", () => this.edit("light", "strength", THIRD_STOP));
    this.button("light-strength", "darker", "Decrease the strength by a third of a stop (21 %)", () => this.edit("light", "strength", 1 / THIRD_STOP));
    for (const type of /** @type {const} */ (["undo", "redo"])) {
      byId(type, HTMLButtonElement).addEventListener("click", () => client.transport.send({ type }));
    }
    for (const format of /** @type {const} */ (["glb", "toml"])) {
      byId(`snapshot-${format}`, HTMLButtonElement).addEventListener("click", () => client.transport.send({ type: "snapshot", format }));
    }
  }

  /**
   * @param {string} parent
   * @param {string} text
   * @param {string} title
   * @param {() => void} act
   */
  button(parent, text, title, act) {
    const made = element("button", text, { type: "button", title });
    made.addEventListener("click", act);
    byId(parent, HTMLElement).append(made);
  }

  /** @param {import("../client.js").Message} contents */
  show({ editable, objects, lights, counts }) {
    const object = this.object.value;
    this.objects = objects;
    this.count = counts[0];
    /** @type {[string, any[], number][]} */
    const lists = [["objects", objects, counts[0]], ["lights", lights, counts[1]]];
    const cut = lists.filter(([, listed, count]) => listed.length < count);
    const unlisted = byId("unlisted", HTMLElement);
    unlisted.hidden = !cut.length;
    unlisted.textContent = cut.map(([what, listed, count]) => `${grouped(listed.length)} of ${grouped(count)} ${what} are listed.`).join(" ");
    if (!unlisted.hidden) unlisted.append(" Click any other object in the image.");
    fillSelect(this.object, objects.map((/** @type {any} */ each, /** @type {number} */ i) => [String(i), each.name || `object ${i}`]));
    byId("edit", HTMLElement).hidden = !editable || !objects.length;
    for (const button of this.tools) button.hidden = !editable || !objects.length;
    byId("light-group", HTMLElement).hidden = !editable;
    byId("camera-edit", HTMLElement).hidden = byId("camera-add", HTMLElement).hidden = !editable;
    this.tree.show({ objects, lights: lights.map((/** @type {any} */ each) => each.name), editable });
    this.lights.show(lights);
    this.choose(object && Number(object) < this.count ? Number(object) : 0);
  }

  /** @param {import("../client.js").Message} history the numbers of steps */
  showHistory({ undo, redo }) {
    byId("undo", HTMLButtonElement).disabled = !undo;
    byId("redo", HTMLButtonElement).disabled = !redo;
  }

  /**
   * Shows the lines that the session draws over the image. Keeps the selected object of a world with the same objects,
   * and sends it again, because it may be a new session.
   * @param {{ cameras: boolean, explained: boolean, grid: boolean } | undefined} overlay
   * @param {string} names the names of all objects
   */
  begin(overlay, names) {
    this.isChosen = this.isChosen && names === this.names && this.tree.selectedLight < 0;
    if (names !== this.names) this.slot = 0;
    this.names = names;
    this.selected = this.tree.selectedLight = -1;
    if (overlay) [this.cameras.checked, this.explained.checked, this.grid.checked] = [overlay.cameras, overlay.explained, overlay.grid];
  }

  tellOverlay() {
    const [cameras, explained, grid] = [this.cameras, this.explained, this.grid].map((box) => box.checked);
    this.client.transport.send({ type: "overlay", cameras, explained, grid });
  }

  /**
   * Selects an object and one of its material slots, and outlines the object.
   * @param {number} number
   * @param {number} slot
   * @returns {boolean} false if the object does not exist
   */
  pick(number, slot = 0) {
    if (!(number >= 0 && number < this.count)) return false;
    this.isChosen = true;
    this.selected = this.tree.selectedLight = -1;
    this.slot = slot;
    this.choose(number);
    return true;
  }

  /** Scrolls the panel until the top of the group Selection is visible. The focus does not move. */
  reveal() {
    const panel = byId("panel", HTMLElement);
    const [seen, group] = [panel, byId("edit", HTMLElement)].map((each) => each.getBoundingClientRect());
    const top = byId("groups", HTMLElement).getBoundingClientRect().bottom;
    const below = group.top + Math.min(group.height, REVEALED_HEIGHT) - seen.bottom;
    if (below > 0) panel.scrollTop += below;
    else if (group.top < top) panel.scrollTop -= top - group.top;
  }

  /** Shows an object in the panel. @param {number} number */
  choose(number) {
    if (!(number >= 0 && number < this.count)) return;
    if (number >= this.objects.length && ![...this.object.options].some(({ value }) => value === String(number))) {
      this.object.append(element("option", `object ${number}`, { value: String(number) }));
    }
    this.object.value = String(number);
    if (this.objects[number]) this.shown.checked = this.objects[number].visible;
    if (this.selected !== number) {
      if (this.selected >= 0) this.slot = 0; // the slot belonged to another object
      this.select();
    }
    if (this.tree.selectedLight < 0) this.tree.show({ selected: this.isChosen ? number : -1 });
  }

  /** Sends the selected object and its tool to the server. */
  select() {
    this.selected = Number(this.object.value);
    const chosen = this.tool === "none" && this.isChosen ? "outline" : this.tool;
    const tool = /** @type {import("../messages").Select["tool"]} */ (chosen);
    this.expectsHandles = this.tool !== "none";
    this.client.transport.send({ type: "select", number: this.selected, slot: this.slot, tool });
  }

  /** @param {number} slot */
  selectSlot(slot) {
    this.slot = slot;
    this.select();
  }

  /** @param {string} name of the tool to use; the name of the current tool deselects it */
  setTool(name) {
    this.tool = this.tool === name ? "none" : name;
    this.showTool();
    this.select();
  }

  showTool() {
    for (const button of this.tools) button.setAttribute("aria-pressed", String(button.dataset.tool === this.tool));
  }

  /** @param {import("../client.js").Message} selected */
  showSelected(selected) {
    const { number, name, visible, animated, place } = selected;
    if (number !== Number(this.object.value)) return;
    byId("edit", HTMLElement).dataset.subject = `${number} ${selected.slot}`;
    this.placement.show(place, Boolean(animated));
    this.material.show(selected);
    const fixed = byId("object-fixed", HTMLElement);
    fixed.hidden = !animated;
    fixed.textContent = animated ? "An animation moves this object, so it cannot be moved here." : "";
    if (animated && this.expectsHandles) this.client.say(fixed.textContent, "notice");
    this.expectsHandles = false;
    for (const button of document.querySelectorAll("#turns button")) /** @type {HTMLButtonElement} */ (button).disabled = Boolean(animated);
    if (number >= this.objects.length && name) {
      this.object.selectedOptions[0].textContent = name;
      this.shown.checked = visible;
    }
  }

  /**
   * @param {import("../messages").Edit["kind"]} kind
   * @param {import("../messages").Edit["key"]} key
   * @param {import("../messages").Edit["value"]} value
   */
  edit(kind, key, value) {
    this.change(kind, Number((kind === "object" ? this.object : this.lights.light).value), key, value);
  }

  /**
   * @param {import("../messages").Edit["kind"]} kind
   * @param {number} number
   * @param {import("../messages").Edit["key"]} key
   * @param {import("../messages").Edit["value"]} value
   */
  change(kind, number, key, value) {
    this.client.transport.send({ type: "edit", kind, number, key, value });
  }
}
