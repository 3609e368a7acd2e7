// The box over the image with notices and errors.

import { byId } from "../dom.js";

const MESSAGE_TIME = 6000; // milliseconds for which a notice is shown
const SAME_BREATH = 400; // milliseconds within which a message is added to the previous message

export class NoticeBox {
  constructor() {
    this.messageTimer = 0;
    /** The time of the last message, ms since the page was opened. */
    this.said = -Infinity;
    byId("message", HTMLElement).addEventListener("click", () => this.unsay());
  }

  /**
   * @param {string} text
   * @param {string} type "notice" or "error"
   * @param {boolean} joins whether it is added to the previous message, because one command may cause several messages
   */
  say(text, type, joins = false) {
    const box = byId("message", HTMLElement);
    const before = box.textContent || "";
    const isNew = !before.split("\n").includes(text) && !text.startsWith(before); // false if the box already shows the text
    const isNext = joins && isNew && !box.hidden && performance.now() - this.said < SAME_BREATH;
    box.textContent = isNext ? `${before}\n${text}` : text;
    box.classList.toggle("error", type === "error" || (isNext && box.classList.contains("error")));
    this.said = performance.now();
    box.hidden = false;
    clearTimeout(this.messageTimer);
    if (!box.classList.contains("error")) this.messageTimer = setTimeout(() => (box.hidden = true), MESSAGE_TIME);
  }

  /** Removes the message. */
  unsay() {
    clearTimeout(this.messageTimer);
    byId("message", HTMLElement).hidden = true;
  }
}
