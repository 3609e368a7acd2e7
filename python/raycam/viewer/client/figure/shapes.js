// Shapes that several figures draw: lines, arrows, dots, lights.

/** @typedef {import("./board.js").Pen} Pen */

/**
 * Draws a line through points.
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

/** Draws an arrow, whose head has the same size for every length. @param {Pen} pen @param {number[]} from @param {number[]} to @param {string} name @param {number} [width] */
export function drawArrow(pen, from, to, name, width = 2.5) {
  const { ctx, color } = pen;
  const length = Math.hypot(to[0] - from[0], to[1] - from[1]);
  if (length < 0.5) return;
  const [dx, dy] = [(to[0] - from[0]) / length, (to[1] - from[1]) / length];
  const head = Math.min(6 + 2 * width, length);
  const neck = [to[0] - head * dx, to[1] - head * dy];
  drawLine(pen, [from, [neck[0] + 0.25 * head * dx, neck[1] + 0.25 * head * dy]], { color: name, width });
  ctx.beginPath();
  ctx.moveTo(to[0], to[1]);
  ctx.lineTo(neck[0] - 0.46 * head * dy, neck[1] + 0.46 * head * dx);
  ctx.lineTo(neck[0] + 0.25 * head * dx, neck[1] + 0.25 * head * dy);
  ctx.lineTo(neck[0] + 0.46 * head * dy, neck[1] - 0.46 * head * dx);
  ctx.fillStyle = color(name);
  ctx.fill();
}

/** Draws a dot with a rim in the background's colour. @param {Pen} pen @param {number[]} at @param {string} name @param {number} [radius] */
export function drawDot({ ctx, color }, [x, y], name, radius = 5) {
  ctx.beginPath();
  ctx.arc(x, y, radius, 0, 2 * Math.PI);
  [ctx.fillStyle, ctx.strokeStyle, ctx.lineWidth] = [color(name), color("ground"), 1.5];
  ctx.fill();
  ctx.stroke();
}

/** Draws a pale ring around a handle. @param {Pen} pen @param {number[]} at @param {string} name @param {number} radius */
export function drawRing({ ctx, color }, [x, y], name, radius) {
  ctx.beginPath();
  ctx.arc(x, y, radius, 0, 2 * Math.PI);
  [ctx.fillStyle, ctx.globalAlpha] = [color(name), 0.2];
  ctx.fill();
  ctx.globalAlpha = 1;
}

/** Draws a glow around a light. @param {Pen} pen @param {number[]} at @param {number} radius */
function drawGlow({ ctx, color }, [x, y], radius) {
  const glow = ctx.createRadialGradient(x, y, 0, x, y, radius);
  glow.addColorStop(0, color("glow"));
  glow.addColorStop(1, color("glow-end"));
  ctx.fillStyle = glow;
  ctx.fillRect(x - radius, y - radius, 2 * radius, 2 * radius);
}

/** Draws a bulb with a glow. @param {Pen} pen @param {number[]} at @param {number} [radius] */
export function drawBulb(pen, [x, y], radius = 6) {
  drawGlow(pen, [x, y], 5 * radius);
  const { ctx, color } = pen;
  ctx.fillStyle = color("L");
  ctx.fillRect(x - 0.5 * radius, y - 1.75 * radius, radius, 0.8 * radius);
  drawDot(pen, [x, y], "bulb", radius);
}

/** Draws the sun with a glow; `away` is the angle of an arrow towards a sun outside the figure. @param {Pen} pen @param {number[]} at @param {number} [radius] @param {number} [away] */
export function drawSun(pen, [x, y], radius = 8, away) {
  drawGlow(pen, [x, y], 4 * radius);
  const rays = away === undefined ? Array.from({ length: 8 }, (_, i) => (i * Math.PI) / 4) : [];
  for (const angle of rays) drawLine(pen, [1.35, 1.85].map((part) => [x + part * radius * Math.cos(angle), y + part * radius * Math.sin(angle)]), { color: "L", width: 2 });
  drawDot(pen, [x, y], "sun", radius);
  if (away !== undefined) drawArrow(pen, [x + (radius + 1) * Math.cos(away), y + (radius + 1) * Math.sin(away)], [x + (radius + 15) * Math.cos(away), y + (radius + 15) * Math.sin(away)], "L", 2.5);
}
