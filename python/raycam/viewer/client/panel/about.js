// Texts that describe the world and the frame, and the notices about both.

import { byId, element } from "../dom.js";

/** Shows texts about the world and the frame, and their notices. @param {Record<string, any>} about */
export function showAbout({ about, notices }) {
  byId("about", HTMLPreElement).textContent = about;
  byId("notices", HTMLElement).replaceChildren(...notices.map((/** @type {string} */ text) => element("li", text)));
}
