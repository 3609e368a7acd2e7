// The line at the image's lower edge that explains the mouse. The line is shown until the mouse is used on the image.

import { byId } from "../dom.js";

const HINT_TIME = 12000; // milliseconds until the hint disappears

export class Hint {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.box = byId("hint", HTMLElement);
    this.wasShown = false;
    for (const event of ["pointerdown", "wheel", "keydown"]) canvas.addEventListener(event, () => this.hide(), { passive: true });
  }

  /** Shows the hint once, when the first image is there. */
  show() {
    if (this.wasShown) return;
    this.wasShown = true;
    this.box.hidden = false;
    setTimeout(() => this.hide(), HINT_TIME);
  }

  hide() {
    this.box.classList.add("gone");
  }
}
