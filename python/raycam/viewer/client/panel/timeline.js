// Time and variants of the live view: a slider, a play button, and lists of animations and variants.

import { byId, fillSelect } from "../dom.js";

/** @typedef {import("../client.js").Client} Client */

const FRAME = 1 / 30; // seconds by which a key changes the time
const SHOWN_DIGITS = 2;

export class Timeline {
  /** @param {Client} client */
  constructor(client) {
    this.client = client;
    this.seconds = 0;
    this.playing = false;
    /** The time of the page, ms, at which the world's time was 0. */
    this.began = 0;
    this.slider = byId("time", HTMLInputElement);
    this.animation = byId("animation", HTMLSelectElement);
    this.variant = byId("variant", HTMLSelectElement);
    this.button = byId("play", HTMLButtonElement);
    this.slider.addEventListener("input", () => this.scrub(Number(this.slider.value)));
    this.animation.addEventListener("change", () => this.tell());
    this.variant.addEventListener("change", () => client.transport.send({ type: "variant", name: this.variant.value }));
    this.button.addEventListener("click", () => this.play(!this.playing));
  }

  /** @param {import("../client.js").Message} welcome */
  welcome({ time, animations, variants, variant }) {
    this.seconds = time.seconds;
    byId("timeline", HTMLElement).hidden = !this.seconds;
    byId("variants", HTMLElement).hidden = !variants.length;
    byId("animations", HTMLElement).hidden = animations.length < 2;
    this.slider.max = String(this.seconds);
    fillSelect(this.animation, animations.map((/** @type {string} */ name) => [name, name]));
    fillSelect(this.variant, [["", "as in the file"], ...variants.map((/** @type {string} */ name) => [name, name])]);
    this.animation.value = time.animation || animations[0] || "";
    this.variant.value = variant;
    this.show(time.now);
  }

  /** @param {number} time */
  show(time) {
    this.slider.value = String(time);
    byId("time-text", HTMLOutputElement).textContent = `${time.toFixed(SHOWN_DIGITS)} s of ${this.seconds.toFixed(SHOWN_DIGITS)} s`;
  }

  /** @param {number} time */
  scrub(time) {
    this.play(false);
    this.show(time);
    this.tell();
  }

  /** @param {number} steps */
  step(steps) {
    if (!this.seconds) return this.client.say("Nothing moves in this world.", "notice");
    this.scrub(Math.min(Math.max(Number(this.slider.value) + steps * FRAME, 0), this.seconds));
  }

  tell() {
    this.client.transport.send({ type: "time", t: Number(this.slider.value), animation: this.animation.value });
  }

  /** @param {boolean} plays */
  play(plays) {
    if (plays && !this.seconds) return this.client.say("Nothing moves in this world.", "notice");
    this.playing = plays;
    this.button.textContent = plays ? "Pause" : "Play";
    if (!plays) return;
    this.began = performance.now() - 1000 * Number(this.slider.value);
    this.next();
  }

  /** Shows the present time of the animation, and requests its image. The next call waits until this image has arrived. */
  next() {
    if (!this.playing) return;
    this.show(((performance.now() - this.began) / 1000) % this.seconds);
    this.tell();
  }
}
