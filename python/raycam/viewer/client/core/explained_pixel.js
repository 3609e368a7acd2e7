// The explanation of a pixel of a page's camera: the text with its numbers, and the figure.

import { explanationOf } from "./explanation.js";
import { pixelFigureOf } from "./pixel_figure.js";

/**
 * Throws an error if the pixel has no ray.
 *
 * @param {any} camera
 * @param {number} column
 * @param {number} row
 * @param {any} world the objects' names, the up axis, and the triangles
 */
export function explainPixel(camera, column, row, { names, up, ...triangles }) {
  const { offset } = camera;
  const size = [...camera.size];
  const lensRay = JSON.parse(camera.lensRay(column + offset, row + offset));
  const { text, ray, found } = explanationOf({ K: [...camera.K], lensRay, size, offset, column, row, names, ...triangles });
  const rayAt = (/** @type {number} */ x, /** @type {number} */ y) => [...camera.ray(x, y)];
  const figure = pixelFigureOf({ rayAt, size, offset, up, isFlat: lensRay.model === "pinhole", ray, found, ...triangles });
  return { text, figure };
}
