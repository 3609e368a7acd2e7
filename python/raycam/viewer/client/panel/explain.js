// Explanations: the text and the figure of one pixel. The figure is shown as an image, where scripts do not run.

import { byId } from "../dom.js";

/** @typedef {{ column: number, row: number, text: string, svg: string }} Explanation */

let figureUrl = "";

/**
 * Shows an explanation.
 * @param {Explanation} explanation
 */
export function showExplanation({ column, row, text, svg }) {
  const figure = byId("explained-figure", HTMLImageElement);
  URL.revokeObjectURL(figureUrl);
  figureUrl = svg ? URL.createObjectURL(new Blob([svg], { type: "image/svg+xml" })) : "";
  figure.hidden = !svg;
  if (svg) figure.src = figureUrl;
  figure.alt = `The ray through pixel ${column}, ${row} and the triangles near it; the text below says the same.`;
  byId("explained-text", HTMLPreElement).textContent = text;
  byId("explained-title", HTMLHeadingElement).textContent = `Pixel ${column}, ${row} explained`;
  const dialog = byId("explained", HTMLDialogElement);
  if (!dialog.open) dialog.showModal();
}
