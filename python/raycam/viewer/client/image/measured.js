// Draws a measured distance over the image: a line between two pixels, with the distance at its middle.

/** @typedef {{ from: number[], to: number[], text: string }} Measured in pixels of the image */

/**
 * @param {CanvasRenderingContext2D} context
 * @param {Measured} measured
 * @param {{ zoom: number, left: number, top: number }} place of the image on the canvas
 */
export function drawMeasured(context, { from, to, text }, { zoom, left, top }) {
  const [[x0, y0], [x1, y1]] = [from, to].map(([u, v]) => [left + u * zoom, top + v * zoom]);
  for (const [width, color] of /** @type {[number, string][]} */ ([[4, "#000"], [2, "#fff"]])) {
    [context.lineWidth, context.strokeStyle] = [width, color];
    context.beginPath();
    context.moveTo(x0, y0);
    context.lineTo(x1, y1);
    context.stroke();
  }
  context.font = "600 13px system-ui, sans-serif";
  context.textAlign = "center";
  context.textBaseline = "middle";
  const half = context.measureText(text).width / 2 + 8;
  const [x, y] = [(x0 + x1) / 2, (y0 + y1) / 2];
  context.fillStyle = "#000000cc";
  context.fillRect(x - half, y - 11, 2 * half, 22);
  context.fillStyle = "#fff";
  context.fillText(text, x, y);
}
