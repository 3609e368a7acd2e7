// Zoom and field of view: frames the whole world from the present direction, as --zoom and --fov of the command line.

import { byId, numbersOf } from "../dom.js";

/** @typedef {import("../client.js").Client} Client */
/** @typedef {import("../navigator.js").Navigator} Navigator */

export class FramingControls {
  /**
   * @param {Client} client
   * @param {Navigator} navigator
   * @param {() => void} onMove called before the camera moves
   */
  constructor(client, navigator, onMove) {
    this.client = client;
    this.navigator = navigator;
    this.onMove = onMove;
    this.zoom = byId("framing-zoom", HTMLInputElement);
    this.fov = byId("framing-fov", HTMLInputElement);
    this.zoom.addEventListener("change", () => this.tell(false));
    this.fov.addEventListener("change", () => this.tell(true));
    byId("camera-home", HTMLButtonElement).addEventListener("click", () => {
      this.onMove();
      this.navigator.home();
    });
  }

  /** @param {boolean} hasFov false to keep the lens */
  tell(hasFov) {
    const [value] = numbersOf([hasFov ? this.fov : this.zoom], (text) => this.client.say(text, "error")) || [];
    if (value === undefined) return;
    const zoom = hasFov ? Number(this.zoom.value) || 1 : value;
    this.onMove();
    if (!hasFov) this.zoom.value = String(zoom); // `onMove` empties the field
    this.client.transport.send({ type: "framing", seq: ++this.navigator.seq, zoom, fov: hasFov ? value : 0 });
  }

  /** Empties the zoom after another move, because the field of view and the distance no longer belong to it. */
  forget() {
    this.zoom.value = "";
  }

  /** @param {{ fy: number, size: number[] }} lens */
  show({ fy, size }) {
    const degrees = (360 / Math.PI) * Math.atan(size[1] / (2 * fy));
    if (document.activeElement !== this.fov) this.fov.value = String(Number(degrees.toFixed(2)));
  }
}
