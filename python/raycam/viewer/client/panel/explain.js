// Explanations: texts and figures of one pixel. The figure is shown as an image, where scripts do not run.

import { byId, element } from "../dom.js";

/** @typedef {{ title: string, text: string, svg: string }} Section */
/** @typedef {{ column: number, row: number, text: string, svg: string, sections?: Section[] }} Explanation */

/**
 * Shows an explanation: its ray, and by buttons its other sections.
 * @param {Explanation} explanation
 */
export function showExplanation({ column, row, text, svg, sections = [] }) {
  const all = [{ title: "The ray", text, svg }, ...sections];
  const buttons = all.map((section, i) => {
    const button = element("button", section.title, { type: "button", "aria-pressed": String(i === 0) });
    button.addEventListener("click", () => {
      buttons.forEach((each) => each.setAttribute("aria-pressed", String(each === button)));
      showSection(section, column, row);
    });
    return button;
  });
  const bar = byId("explained-sections", HTMLElement);
  bar.replaceChildren(...buttons);
  bar.hidden = all.length < 2;
  showSection(all[0], column, row);
  byId("explained-title", HTMLHeadingElement).textContent = `Pixel ${column}, ${row} explained`;
  const dialog = byId("explained", HTMLDialogElement);
  if (!dialog.open) dialog.showModal();
}

/**
 * @param {Section} section
 * @param {number} column
 * @param {number} row
 */
function showSection({ title, text, svg }, column, row) {
  const figure = byId("explained-figure", HTMLImageElement);
  figure.hidden = !svg;
  // No blob: a notebook around the page may allow images of data alone.
  if (svg) figure.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(svg)}`;
  figure.alt = `${title} of pixel ${column}, ${row}, drawn; the text below says the same.`;
  byId("explained-text", HTMLPreElement).textContent = text;
  byId("explained-scroll", HTMLElement).scrollTop = 0;
}
