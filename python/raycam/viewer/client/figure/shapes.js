// Strokes that figures have in common.

/** @typedef {import("./board.js").Pen} Pen */

/**
 * A line through points.
 * @param {Pen} pen @param {number[][]} points
 * @param {{ color: string, width?: number, dash?: number[], fill?: string, close?: boolean }} style a name of a colour, or a colour
 */
export function drawLine({ ctx, color }, points, { color: name, width = 2, dash = [], fill = "", close = false }) {
  ctx.beginPath();
  points.forEach(([x, y], i) => (i ? ctx.lineTo(x, y) : ctx.moveTo(x, y)));
  if (close) ctx.closePath();
  if (fill) {
    ctx.fillStyle = color(fill);
    ctx.fill();
  }
  ctx.setLineDash(dash);
  [ctx.strokeStyle, ctx.lineWidth] = [color(name), width];
  if (width > 0) ctx.stroke();
  ctx.setLineDash([]);
}

/** An arrow; its head keeps its size. @param {Pen} pen @param {number[]} from @param {number[]} to @param {string} name @param {number} [width] */
export function drawArrow(pen, from, to, name, width = 2.5) {
  const { ctx, color } = pen;
  const length = Math.hypot(to[0] - from[0], to[1] - from[1]);
  if (length < 0.5) return;
  const [dx, dy] = [(to[0] - from[0]) / length, (to[1] - from[1]) / length];
  const head = Math.min(6 + 2 * width, length);
  const neck = [to[0] - head * dx, to[1] - head * dy];
  drawLine(pen, [from, neck], { color: name, width });
  ctx.beginPath();
  ctx.moveTo(to[0], to[1]);
  ctx.lineTo(neck[0] - 0.42 * head * dy, neck[1] + 0.42 * head * dx);
  ctx.lineTo(neck[0] + 0.42 * head * dy, neck[1] - 0.42 * head * dx);
  ctx.fillStyle = color(name);
  ctx.fill();
}

/** A dot with a rim in the ground's colour. @param {Pen} pen @param {number[]} at @param {string} name @param {number} [radius] */
export function drawDot({ ctx, color }, [x, y], name, radius = 5) {
  ctx.beginPath();
  ctx.arc(x, y, radius, 0, 2 * Math.PI);
  [ctx.fillStyle, ctx.strokeStyle, ctx.lineWidth] = [color(name), color("ground"), 1.5];
  ctx.fill();
  ctx.stroke();
}
