// Reset buttons of fields: a button next to a field whose value has changed restores the field's first value.

import { element } from "../dom.js";

/** @typedef {HTMLInputElement | HTMLSelectElement} ResetField */

const RESET_FIELDS = "[data-subject] label :is(input, select):not([type='text'])";

export class Resets {
  constructor() {
    /** The first values, by the field and the object, light or camera that it belongs to. @type {Map<string, string>} */
    this.first = new Map();
    document.addEventListener("change", () => this.refresh());
  }

  /** Forgets all first values, because another world is shown. */
  forget() {
    this.first.clear();
  }

  /** Records the values of fields that are shown for the first time, and shows the buttons of changed fields. */
  refresh() {
    for (const each of document.querySelectorAll(RESET_FIELDS)) {
      const field = /** @type {ResetField} */ (each);
      const subject = /** @type {HTMLElement} */ (field.closest("[data-subject]")).dataset.subject || "";
      if (!subject) continue;
      const key = `${field.id || field.dataset.name}|${subject}`;
      const first = this.first.get(key);
      if (first === undefined) this.first.set(key, valueOf(field));
      const button = buttonOf(field, () => this.restore(field, key));
      button.hidden = first === undefined || first === valueOf(field) || field.disabled;
      button.title = `Reset to ${first}`;
    }
  }

  /** @param {ResetField} field @param {string} key */
  restore(field, key) {
    const first = this.first.get(key) || "";
    if (field.type === "checkbox") /** @type {HTMLInputElement} */ (field).checked = first === "on";
    else field.value = first;
    for (const type of ["input", "change"]) field.dispatchEvent(new Event(type, { bubbles: true }));
  }
}

/** @param {ResetField} field @returns {string} */
function valueOf(field) {
  return field.type === "checkbox" ? (/** @type {HTMLInputElement} */ (field).checked ? "on" : "off") : field.value;
}

/**
 * The reset button of a field, which is created if it is missing.
 * @param {ResetField} field
 * @param {() => void} restore
 * @returns {HTMLElement}
 */
function buttonOf(field, restore) {
  const label = /** @type {HTMLElement} */ (field.closest("label"));
  let button = /** @type {HTMLButtonElement | null} */ (label.querySelector(".undo-field"));
  if (!button) {
    const name = (label.firstChild?.textContent || "").trim();
    button = /** @type {HTMLButtonElement} */ (element("button", "↺", { type: "button", class: "undo-field", "aria-label": `Reset ${name}` }));
    field.before(button);
  }
  button.onclick = (event) => {
    event.preventDefault();
    restore();
  };
  return button;
}
