// The photograph of the current camera: drawn over the image of the model, or as B of a comparison.

import { byId } from "../dom.js";
import { layerOf } from "../picture.js";

/** @typedef {import("../client.js").Client} Client */

const FIRST_OPACITY = 0.5; // initial opacity of photographs

export class PhotographControls {
  /** @param {Client} client */
  constructor(client) {
    this.client = client;
    /** Cameras with a photograph. @type {string[]} */
    this.cameras = [];
    /** The camera whose photograph is shown or was requested; empty if there is none. */
    this.camera = "";
    this.isFirst = true;
    this.opacity = byId("photograph-opacity", HTMLInputElement);
    this.opacity.addEventListener("input", () => this.show());
    byId("photograph-b", HTMLButtonElement).addEventListener("click", () => this.compare());
  }

  /** @param {string[]} cameras with a photograph */
  begin(cameras) {
    this.cameras = cameras;
    this.camera = "";
    this.client.picture.show({ photo: null });
    byId("photograph", HTMLElement).hidden = true;
  }

  /** @param {string} name of the current camera; empty for a free camera */
  showFor(name) {
    const wanted = this.cameras.includes(name) ? name : "";
    if (wanted === this.camera) return;
    this.camera = wanted;
    this.client.picture.show({ photo: null });
    byId("photograph", HTMLElement).hidden = !wanted;
    if (wanted) this.client.transport.send({ type: "photograph", name: wanted });
  }

  /** @param {import("../client.js").Message} photograph */
  receive({ camera, bitmap }) {
    if (camera !== this.camera) return;
    if (this.isFirst) this.opacity.value = String(FIRST_OPACITY);
    this.isFirst = false;
    this.client.picture.show({ photo: layerOf(bitmap) });
    this.show();
  }

  show() {
    const share = Number(this.opacity.value);
    byId("photograph-text", HTMLOutputElement).textContent = `${Math.round(100 * share)} %`;
    this.client.picture.show({ photoOpacity: share });
  }

  /** Makes the photograph B of the comparison, with a divider between A and B. */
  compare() {
    const { photo, a } = this.client.picture.layers;
    if (!photo || !a) return this.client.say("The photograph has not arrived yet.", "notice");
    this.opacity.value = "0";
    this.show();
    this.client.takeLayer(photo, "The photograph is now image B.");
    this.client.setMode("slider");
  }
}
