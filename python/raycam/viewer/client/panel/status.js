// The status line: samples and render time of the image, or a report that the image is late.

import { byId } from "../dom.js";

const LATE = 2, REMIND = 5; // seconds after which a late image is reported, and between two reports

export class StatusLine {
  constructor() {
    this.waiting = 0;
  }

  /** @param {import("../client.js").Message} message with an image */
  show({ samples, wanted, ms, moving, integrator, rate, change }) {
    const still = wanted ? `${integrator}, ${samples} ${samples === 1 ? "sample" : "samples"}` : "ground truth"; // only images with light are refined
    const light = moving ? "moving" : still;
    this.showRefinement(moving ? 0 : rate, moving ? null : change);
    byId("status", HTMLElement).textContent = `${light}, ${ms < 1000 ? `${Math.round(ms)} ms` : `${(ms / 1000).toFixed(1)} s`}`;
  }

  /**
   * Shows how fast the still image is refined, and how much it changes.
   * @param {number} rate samples per second, or 0
   * @param {{ share: number, since: number } | null} change
   */
  showRefinement(rate, change) {
    byId("status-change", HTMLElement).textContent = change ? `${Number((100 * change.share).toPrecision(2))} % changed since ${change.since} samples` : "";
    byId("status-rate", HTMLElement).textContent = rate ? `${(rate / 1e6).toPrecision(2)} M samples/s` : "";
  }

  /** Shows the number of cameras that are shown at once; each image shows its own samples. @param {number} count */
  showCameras(count) {
    this.await(false);
    this.showRefinement(0, null);
    byId("status", HTMLElement).textContent = `${count} cameras`;
  }

  /** @param {boolean} follows true if an image is expected, which is reported if it is late */
  await(follows) {
    clearInterval(this.waiting);
    if (!follows) return;
    let seconds = 0;
    this.waiting = setInterval(() => {
      seconds += 1;
      if (seconds !== LATE && seconds % REMIND) return;
      byId("status", HTMLElement).textContent = `rendering the next image, ${seconds} s`;
    }, 1000);
  }
}
