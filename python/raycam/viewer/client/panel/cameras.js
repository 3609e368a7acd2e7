// The list of the world's cameras: adds the current view as a camera, and removes the current camera.

import { byId } from "../dom.js";

/** @typedef {import("../client.js").Client} Client */

const LONGEST_CAMERA_NAME = 1000;

export class CameraControls {
  /** @param {Client} client */
  constructor(client) {
    this.client = client;
    this.name = byId("camera-name", HTMLInputElement);
    this.remove = byId("camera-remove", HTMLButtonElement);
    /** The name of the current camera; empty if the camera was moved. */
    this.shown = "";
    byId("camera-keep", HTMLButtonElement).addEventListener("click", () => this.keep());
    this.add = byId("camera-add", HTMLButtonElement);
    this.add.addEventListener("click", () => this.keep());
    this.remove.addEventListener("click", () => client.transport.send({ type: "remove_camera", name: this.shown }));
  }

  keep() {
    this.client.transport.send({ type: "keep_camera", name: this.name.value.trim().slice(0, LONGEST_CAMERA_NAME) });
    this.name.value = "";
  }

  /** @param {string} name */
  show(name) {
    this.shown = name;
    this.remove.hidden = !name;
    this.remove.textContent = `Remove ${name}`;
  }
}
