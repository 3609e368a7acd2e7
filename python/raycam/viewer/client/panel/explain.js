// Explanations: texts and figures of one pixel. Figures of light and of the tree are images, where scripts do not run.

import { byId, element } from "../dom.js";
import { showPixelFigure } from "../figure/pixel.js";

/** @typedef {{ title: string, text: string, svg: string, figure?: import("../figure/pixel.js").PixelFigure }} Section */
/** @typedef {Omit<Section, "title"> & { column: number, row: number, sections?: Section[] }} Explanation */

/**
 * Shows an explanation: its ray, and by buttons its other sections.
 * @param {Explanation} explanation
 */
export function showExplanation({ column, row, text, svg, figure, sections = [] }) {
  const all = [{ title: "The ray", text, svg, figure }, ...sections];
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
function showSection({ title, text, svg, figure }, column, row) {
  const drawing = byId("explained-drawing", HTMLElement);
  drawing.hidden = !figure;
  if (figure) showPixelFigure(drawing, figure, byId("picture", HTMLCanvasElement));
  const image = byId("explained-figure", HTMLImageElement);
  image.hidden = !svg;
  // No blob: a notebook around the page may allow images of data alone.
  if (svg) image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(svg)}`;
  image.alt = `${title} of pixel ${column}, ${row}, drawn; the text below says the same.`;
  byId("explained-text", HTMLPreElement).textContent = text;
  byId("explained-scroll", HTMLElement).scrollTop = 0;
}
