// The bar at the image's lower edge: the share of the still image's samples that are rendered.

import { byId } from "../dom.js";

export class ProgressBar {
  constructor() {
    this.bar = byId("progress", HTMLElement);
  }

  /** @param {number} samples of the shown image @param {number} wanted samples of the finished image */
  show(samples, wanted) {
    const share = wanted ? Math.min(samples / wanted, 1) : 0;
    this.bar.style.width = `${(100 * share).toFixed(1)}%`;
    this.bar.classList.toggle("done", share >= 1);
  }
}
