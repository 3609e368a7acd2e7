// Several cameras at once: up to four images, in the channel and with the colours of the main image. A click on an image shows only this image.

import { byId, element, fillSelect } from "../dom.js";
import { paint, rangeOf } from "../image/paint.js";
import { layerOf } from "../picture.js";

/** @typedef {import("../client.js").Client} Client */
/** @typedef {import("../client.js").Message} Message */
/** @typedef {{ name: string, canvas: HTMLCanvasElement, select: HTMLSelectElement, progress: HTMLElement, newest: Message | null }} Pane */

const MOST_PANES = 4;

export class Panes {
  /** @param {Client} client @param {(name: string) => void} lookThrough */
  constructor(client, lookThrough) {
    this.client = client;
    this.lookThrough = lookThrough;
    /** The cameras of the world. @type {string[]} */
    this.cameras = [];
    /** @type {Pane[]} */
    this.panes = [];
    this.box = byId("panes", HTMLElement);
    this.button = byId("panes-button", HTMLButtonElement);
    this.button.addEventListener("click", () => this.toggle());
    this.box.addEventListener("keydown", (event) => {
      if (event.key === "Escape") this.show([]);
    });
    client.onRepaint = () => this.panes.forEach((pane) => this.draw(pane));
  }

  /** After a welcome: keeps the cameras that the world still has. @param {string[]} cameras */
  begin(cameras) {
    this.cameras = cameras;
    if (this.panes.length) this.show(this.panes.map(({ name }) => name).filter((name) => !name || cameras.includes(name)));
  }

  /** While this client follows a leader, it shows the leader's images only. @param {boolean} attached */
  follow(attached) {
    this.button.disabled = attached;
    if (attached && this.panes.length) this.lay([]);
  }

  toggle() {
    if (this.button.disabled) return;
    if (this.panes.length) return this.show([]);
    const current = byId("camera", HTMLSelectElement).value;
    const names = [...(current ? [] : [""]), ...this.cameras].slice(0, MOST_PANES);
    if (names.length < 2) return this.client.say("There is only one camera to show. Add views as cameras in the group Camera.", "notice");
    this.show(names);
    this.box.querySelector("button")?.focus();
  }

  /** True if keys must not move the camera: several cameras are shown, and the free camera does not have the focus. */
  get ignoresMoves() {
    const pane = this.panes.find(({ canvas }) => canvas.closest("figure")?.contains(document.activeElement));
    return this.panes.length > 0 && pane?.name !== "";
  }

  /** Shows the cameras `names`, or only the main image if the list is empty. @param {string[]} names */
  show(names) {
    this.lay(names);
    this.client.transport.send({ type: "panes", names });
  }

  /** @param {string[]} names */
  lay(names) {
    this.panes = names.map((name) => this.made(name));
    this.box.replaceChildren(...this.panes.map(({ canvas }) => /** @type {HTMLElement} */ (canvas.closest("figure"))));
    this.box.hidden = !names.length;
    this.button.setAttribute("aria-pressed", String(!this.box.hidden));
    document.body.classList.toggle("shows-panes", !this.box.hidden);
  }

  /** @param {string} name @returns {Pane} */
  made(name) {
    const figure = element("figure");
    const canvas = document.createElement("canvas");
    const title = name || "free camera";
    const button = element("button", "", { type: "button", title: "Show only this camera", "aria-label": `Show only ${title}` });
    const select = /** @type {HTMLSelectElement} */ (element("select", "", { "aria-label": `Camera in place of ${title}` }));
    const progress = element("span", "", { class: "samples" });
    const pane = { name, canvas, select, progress, newest: null };
    fillSelect(select, [["", "free camera"], ...this.cameras.map((each) => /** @type {[string, string]} */ ([each, each]))]);
    select.value = name;
    select.addEventListener("change", () => this.exchange(pane, select.value));
    button.append(canvas);
    button.addEventListener("click", () => {
      this.show([]);
      if (name) this.lookThrough(name);
      this.client.picture.canvas.focus();
    });
    const caption = element("figcaption");
    caption.append(select, progress);
    figure.append(button, caption);
    return pane;
  }

  /** Shows another camera in a pane; a camera that is already shown changes places with it. @param {Pane} changed @param {string} name */
  exchange(changed, name) {
    this.show(this.panes.map((pane) => (pane === changed ? name : pane.name === name ? changed.name : pane.name)));
  }

  /** @param {Message} message */
  receive(message) {
    const pane = this.panes.find(({ name }) => name === message.name);
    if (!pane) return;
    pane.newest = message;
    pane.progress.textContent = message.plane || message.samples >= message.wanted ? "" : `${message.samples} of ${message.wanted} samples`;
    this.draw(pane);
  }

  /** @param {Pane} pane */
  draw({ canvas, newest }) {
    if (!newest) return;
    const layer = layerOf(newest.plane ? paint(newest.plane, this.display()) : newest.bitmap);
    [canvas.width, canvas.height] = [layer.width, layer.height];
    canvas.getContext("2d")?.drawImage(layer, 0, 0);
  }

  /** The display of all panes: the range of the main image. */
  display() {
    const { client: { plane, controls: { display } } } = this;
    return plane ? { ...display, range: rangeOf(plane, display) } : display;
  }
}
