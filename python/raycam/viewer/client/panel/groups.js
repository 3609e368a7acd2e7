// The bar at the top of the panel: a button for each group, which opens the group and scrolls to it.

import { byId, element } from "../dom.js";

const GROUP_REACH = 12; // CSS pixels below the bar within which a group's top is the current group

export class GroupBar {
  constructor() {
    this.panel = byId("panel", HTMLElement);
    this.bar = byId("groups", HTMLElement);
    /** @type {[HTMLDetailsElement, HTMLButtonElement][]} */
    this.entries = [...this.panel.querySelectorAll("details.group")].map((each) => {
      const group = /** @type {HTMLDetailsElement} */ (each);
      const title = group.querySelector("h2")?.textContent || "";
      const button = element("button", group.dataset.short || title, { type: "button", title });
      button.addEventListener("click", () => this.show(group));
      return [group, /** @type {HTMLButtonElement} */ (button)];
    });
    this.bar.append(...this.entries.map(([, button]) => button));
    const observer = new MutationObserver(() => this.update());
    for (const [group] of this.entries) observer.observe(group, { attributes: true, attributeFilter: ["hidden", "open"] });
    observer.observe(document.body, { attributes: true, attributeFilter: ["class"] });
    this.panel.addEventListener("scroll", () => this.update());
    this.update();
  }

  /** Opens a group, and scrolls to its top. @param {HTMLDetailsElement} group */
  show(group) {
    group.open = true;
    this.panel.scrollTop += group.getBoundingClientRect().top - this.bar.getBoundingClientRect().bottom;
    this.update();
  }

  /** Hides the buttons of hidden groups, and marks the group at the top of the panel. */
  update() {
    const limit = this.bar.getBoundingClientRect().bottom + GROUP_REACH;
    let current = null;
    for (const [group, button] of this.entries) {
      button.hidden = !group.checkVisibility();
      if (!button.hidden && (!current || group.getBoundingClientRect().top <= limit)) current = button;
    }
    for (const [, button] of this.entries) {
      if (button === current) button.setAttribute("aria-current", "true");
      else button.removeAttribute("aria-current");
    }
  }
}
