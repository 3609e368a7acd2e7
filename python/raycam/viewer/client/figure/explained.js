// The figures of an explanation: of the ray, or of the lines of the light or the tree.

import { linesPanels } from "./lines.js";
import { showPanels } from "./panels.js";
import { pixelPanels } from "./pixel.js";

/** @typedef {import("./pixel.js").PixelFigure | import("./lines.js").LinesFigure} ExplainedFigure */

/**
 * Fills an element with the figures of an explanation.
 * @param {HTMLElement} host
 * @param {ExplainedFigure} figure
 * @param {CanvasImageSource | null} picture
 */
export function showFigure(host, figure, picture) {
  showPanels(host, "lines" in figure ? linesPanels(figure, picture) : pixelPanels(figure, picture));
}
