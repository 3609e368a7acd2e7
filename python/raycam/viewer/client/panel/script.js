// The controls that a script added to the view.

import { byId, element, svgElement } from "../dom.js";

/** @typedef {Record<string, any> & { id: number, kind: string, label: string, folder: string }} ScriptControl */

const PLOT_WIDTH = 280, PLOT_HEIGHT = 90; // size of a plot, in the units of its SVG drawing

export class ScriptControls {
  /** @param {(id: number, value: boolean | number | string) => void} changed */
  constructor(changed) {
    this.changed = changed;
    this.shape = "";
    /** @type {Map<number, (control: ScriptControl) => void>} sets the value of a control */
    this.setters = new Map();
  }

  /** @param {ScriptControl[]} controls */
  show(controls) {
    byId("script", HTMLElement).hidden = !controls.length;
    const shape = JSON.stringify(controls.map(({ value, ...rest }) => rest));
    if (shape !== this.shape) this.build(controls);
    this.shape = shape;
    for (const control of controls) this.setters.get(control.id)?.(control);
  }

  /** @param {ScriptControl[]} controls */
  build(controls) {
    this.setters.clear();
    /** @type {Map<string, HTMLElement>} */
    const folders = new Map();
    const top = byId("script-controls", HTMLElement);
    top.replaceChildren();
    for (const control of controls) {
      if (control.folder && !folders.has(control.folder)) {
        const folder = element("fieldset");
        folder.append(element("legend", control.folder));
        folders.set(control.folder, folder);
        top.append(folder);
      }
      (folders.get(control.folder) || top).append(this.made(control));
    }
  }

  /** @param {ScriptControl} control @returns {HTMLElement} */
  made(control) {
    const { id, kind, label } = control;
    if (kind === "button") {
      const button = element("button", label, { type: "button" });
      button.addEventListener("click", () => this.changed(id, true));
      return button;
    }
    const row = element("label", `${label} `);
    if (kind === "image") row.append(element("img", "", { src: control.image, alt: label }));
    if (kind === "plot") row.append(plotOf(control));
    if (kind === "slider") this.addSlider(row, control);
    if (kind === "checkbox") {
      const box = /** @type {HTMLInputElement} */ (element("input", "", { type: "checkbox" }));
      box.addEventListener("change", () => this.changed(id, box.checked));
      this.setters.set(id, ({ value }) => (box.checked = value));
      row.className = "check";
      row.prepend(box);
    }
    if (kind === "text") {
      const input = /** @type {HTMLInputElement} */ (element("input", "", { type: "text", maxlength: "1000" }));
      input.readOnly = !control.editable;
      input.addEventListener("change", () => this.changed(id, input.value));
      this.setters.set(id, ({ value }) => document.activeElement !== input && (input.value = value));
      row.append(input);
    }
    return row;
  }

  /** @param {HTMLElement} row @param {ScriptControl} control */
  addSlider(row, { id, min, max, step }) {
    const output = element("output");
    const input = /** @type {HTMLInputElement} */ (element("input", "", { type: "range", min, max, step }));
    const show = (/** @type {unknown} */ value) => (output.textContent = String(Number(Number(value).toPrecision(6))));
    input.addEventListener("input", () => {
      show(input.value);
      this.changed(id, Number(input.value));
    });
    this.setters.set(id, ({ value }) => {
      const isHeld = document.activeElement === input;
      if (!isHeld) input.value = String(value);
      show(isHeld ? input.value : value); // the browser rounds input.value to a step
    });
    row.append(output, input);
  }
}

/** @param {ScriptControl} control @returns {SVGElement} */
function plotOf({ x, y, label }) {
  const [x0, x1, y0, y1] = [Math.min(...x), Math.max(...x), Math.min(...y), Math.max(...y)];
  const points = x.map((/** @type {number} */ each, /** @type {number} */ i) => {
    const column = ((each - x0) / (x1 - x0 || 1)) * PLOT_WIDTH;
    return `${column.toFixed(1)},${(PLOT_HEIGHT - ((y[i] - y0) / (y1 - y0 || 1)) * PLOT_HEIGHT).toFixed(1)}`;
  });
  const svg = svgElement("svg", {
    viewBox: `-4 -4 ${PLOT_WIDTH + 8} ${PLOT_HEIGHT + 8}`, class: "plot", role: "img", "aria-label": `${label}: from ${y0} to ${y1}`,
  });
  svg.append(svgElement("polyline", { points: points.join(" ") }));
  return svg;
}
