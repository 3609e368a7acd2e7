// Figures below each other, each with a title. A symbol is highlighted in all figures at the same time.

import { element } from "../dom.js";
import { Board } from "./board.js";

/** @typedef {import("./board.js").Drawing & { title: string }} Panel */

/** Functions that remove the listeners of the figures in an element. @type {WeakMap<HTMLElement, () => void>} */
const SHOWN = new WeakMap();

/**
 * Fills an element with figures.
 * @param {HTMLElement} host
 * @param {Panel[]} panels
 */
export function showPanels(host, panels) {
  /** @type {Board[]} */
  const boards = [];
  const marks = {
    highlight: "",
    point: (/** @type {string} */ symbol) => {
      if (symbol !== marks.highlight) marks.highlight = symbol;
      marks.redraw();
    },
    redraw: () => requestAnimationFrame(() => boards.forEach((board) => board.paint())),
  };
  SHOWN.get(host)?.();
  host.replaceChildren();
  for (const { title, ...drawing } of panels) {
    const canvas = document.createElement("canvas");
    host.append(element("p", title, { class: "figure-title" }), canvas);
    boards.push(new Board(canvas, drawing, marks));
  }
  const observer = new ResizeObserver(marks.redraw);
  observer.observe(host);
  const scheme = matchMedia("(prefers-color-scheme: dark)");
  scheme.addEventListener("change", marks.redraw);
  SHOWN.set(host, () => {
    observer.disconnect();
    scheme.removeEventListener("change", marks.redraw);
  });
}

/** A panel with the view from outside, which the reader turns. @param {string} title @param {string} label @param {import("./outside.js").OutsideView} view @param {import("./outside.js").Content} content @returns {Panel} */
export function outsidePanel(title, label, view, content) {
  return {
    title, ratio: 0.6, label: `${label} Drag to turn the view; the arrow keys turn it too.`,
    draw: (pen) => view.draw(pen, content), grab: () => true, drag: (at, from) => view.orbit(at, from), nudge: ([x, y]) => view.orbit([8 * x, 8 * y], [0, 0]),
  };
}
