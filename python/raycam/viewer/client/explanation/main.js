// The page of an explanation: its figures, which the lecture and the live view draw with the same modules, and its text.

import { byId } from "../dom.js";
import { showFigure } from "../figure/explained.js";

/** Draws the figures as soon as the image is decoded. */
async function openExplanation() {
  const picture = byId("picture", HTMLImageElement);
  await picture.decode().catch(() => undefined);
  showFigure(byId("figures", HTMLElement), JSON.parse(byId("figure", HTMLElement).textContent || ""), picture);
}

openExplanation();
