// Explanations: texts and figures of one pixel.

import { byId, element } from "../dom.js";
import { showFigure } from "../figure/explained.js";

/** @typedef {{ title: string, text: string, figure: import("../figure/explained.js").ExplainedFigure }} Section */
/** @typedef {Omit<Section, "title"> & { column: number, row: number, sections?: Section[] }} Explanation */

/**
 * Shows an explanation: first the section about the ray; buttons show the other sections.
 * @param {Explanation} explanation
 * @param {HTMLCanvasElement | null} picture
 */
export function showExplanation({ column, row, text, figure, sections = [] }, picture) {
  const all = [{ title: "The ray", text, figure }, ...sections];
  const buttons = all.map((section, i) => {
    const button = element("button", section.title, { type: "button", "aria-pressed": String(i === 0) });
    button.addEventListener("click", () => {
      buttons.forEach((each) => each.setAttribute("aria-pressed", String(each === button)));
      showSection(section, picture);
    });
    return button;
  });
  const bar = byId("explained-sections", HTMLElement);
  bar.replaceChildren(...buttons);
  bar.hidden = all.length < 2;
  showSection(all[0], picture);
  byId("explained-title", HTMLHeadingElement).textContent = `Pixel ${column}, ${row} explained`;
  const dialog = byId("explained", HTMLDialogElement);
  if (!dialog.open) dialog.showModal();
}

/** @param {Section} section @param {HTMLCanvasElement | null} picture */
function showSection({ text, figure }, picture) {
  showFigure(byId("explained-drawing", HTMLElement), figure, picture);
  byId("explained-text", HTMLPreElement).textContent = text;
  byId("explained-scroll", HTMLElement).scrollTop = 0;
}

/** Shows whether an explanation is being computed. @param {boolean} isExplaining */
export function showExplaining(isExplaining) {
  const button = byId("explain", HTMLButtonElement);
  button.setAttribute("aria-busy", String(isExplaining));
  button.textContent = isExplaining ? "Explaining ..." : "Explain";
}

/**
 * Lists the pixels whose explanations a page contains.
 * @param {import("../picture.js").Pixel[]} pixels
 * @param {import("../picture.js").Pixel} origin the pixel of the whole image at the left top corner of the arrays
 * @param {(pixel: import("../picture.js").Pixel) => void} explain
 */
export function listExplanations(pixels, origin, explain) {
  byId("explanations", HTMLElement).hidden = !pixels.length;
  byId("explanation-list", HTMLElement).replaceChildren(
    ...pixels.map(({ column, row }) => {
      const button = element("button", `${column + origin.column}, ${row + origin.row}`, { type: "button" });
      button.addEventListener("click", () => explain({ column, row }));
      return button;
    }),
  );
}
