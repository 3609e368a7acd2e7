// Relighting in a saved page: one slider for each light, if the page contains the light's part of the colour.

import { byId, element } from "../dom.js";
import { LIGHT_PREFIX } from "../image/relight.js";

const MAX_FACTOR = 4; // largest brightness of a light, relative to the light in the frame

export class RelightPanel {
  /**
   * @param {import("../transport/page.js").PageTransport} page
   * @param {import("../client.js").Client} client
   */
  constructor(page, client) {
    this.page = page;
    this.client = client;
    /** @type {Map<string, HTMLInputElement>} sliders by channel */
    this.sliders = new Map();
    const channels = page.lightChannels();
    byId("relight", HTMLElement).hidden = !channels.length;
    byId("relight-lights", HTMLElement).replaceChildren(...channels.map((name) => this.row(name)));
    byId("relight-reset", HTMLButtonElement).addEventListener("click", () => this.reset());
  }

  /** @param {string} name of a channel */
  row(name) {
    const label = element("label", `${name.slice(LIGHT_PREFIX.length)} `);
    const factor = /** @type {HTMLOutputElement} */ (element("output", "1.00"));
    const slider = /** @type {HTMLInputElement} */ (element("input", "", { type: "range", min: "0", max: String(MAX_FACTOR), step: "0.05", value: "1" }));
    slider.addEventListener("input", () => {
      factor.value = Number(slider.value).toFixed(2);
      this.relight();
    });
    this.sliders.set(name, slider);
    label.append(factor, slider);
    return label;
  }

  reset() {
    for (const slider of this.sliders.values()) {
      slider.value = "1";
      slider.dispatchEvent(new Event("input"));
    }
  }

  /** Shows the colour with the factors of the sliders. */
  relight() {
    this.page.relight(new Map([...this.sliders].map(([name, slider]) => [name, Number(slider.value)])));
    this.client.setChannel("color");
  }
}
