// The command palette: a list of all commands, which is filtered by the typed text.

import { byId, element } from "./dom.js";

/** @typedef {{ text: string, more?: string, key: string, act: () => void }} PaletteEntry `more` is found too, but not shown */

export class Palette {
  /** @param {() => PaletteEntry[]} entries called each time the palette opens */
  constructor(entries) {
    this.entries = entries;
    this.dialog = byId("palette", HTMLDialogElement);
    this.search = byId("palette-search", HTMLInputElement);
    this.list = byId("palette-list", HTMLElement);
    /** @type {PaletteEntry[]} */
    this.found = [];
    this.at = 0;
    this.search.addEventListener("input", () => this.find());
    this.search.addEventListener("keydown", (event) => this.pressed(event));
    this.dialog.addEventListener("click", (event) => {
      if (event.target === this.dialog) this.dialog.close();
    });
  }

  open() {
    if (this.dialog.open) return;
    this.search.value = "";
    this.find();
    this.dialog.showModal();
    this.search.focus();
  }

  find() {
    const words = plain(this.search.value).split(/\s+/).filter(Boolean);
    this.found = this.entries().filter(({ text, more = "" }) => words.every((word) => plain(`${text} ${more}`).includes(word)));
    this.at = 0;
    this.draw();
  }

  draw() {
    this.list.replaceChildren(...this.found.map((entry, i) => {
      const row = element("li", "", { role: "option", "aria-selected": String(i === this.at) });
      const button = element("button", "", { type: "button", tabindex: "-1" });
      button.append(element("span", entry.text), element("kbd", entry.key));
      button.addEventListener("click", () => this.choose(entry));
      row.append(button);
      return row;
    }));
    if (!this.found.length) this.list.append(element("li", "No command matches.", { role: "option", "aria-selected": "false" }));
    this.list.children[this.at]?.scrollIntoView({ block: "nearest" });
  }

  /** @param {PaletteEntry} entry */
  choose(entry) {
    this.dialog.close();
    entry.act();
  }

  /** @param {KeyboardEvent} event */
  pressed(event) {
    const step = event.key === "ArrowDown" ? 1 : event.key === "ArrowUp" ? -1 : 0;
    if (step && this.found.length) {
      event.preventDefault();
      this.at = (this.at + step + this.found.length) % this.found.length;
      this.draw();
    }
    if (event.key === "Enter" && this.found[this.at]) {
      event.preventDefault();
      this.choose(this.found[this.at]);
    }
  }
}

/** A text in small letters and American spelling, so that both spellings are found. @param {string} text */
function plain(text) {
  return text.toLowerCase().replaceAll("colour", "color");
}
