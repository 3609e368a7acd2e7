// A canvas for figures of the lecture and of explanations: its labels do not overlap, its symbols can be highlighted,
// and the reader can drag points.

import { placeLabels } from "./labels.js";

/** @typedef {{ at: number[], text: string, symbol?: string, color?: string }} Label */
/**
 * @typedef {object} Pen
 * @property {CanvasRenderingContext2D} ctx
 * @property {number} width in CSS pixels
 * @property {number} height
 * @property {(name: string) => string} color of a symbol or of a part of the page
 * @property {(symbol?: string) => boolean} lit true if the reader points at the symbol
 * @property {(label: Label) => void} label adds a label, which is drawn last
 * @property {(at: number[]) => void} avoid keeps labels away from a point
 * @property {(symbol: string | undefined, points: number[][]) => void} touch highlights the symbol when the pointer is on the line
 */
/**
 * @typedef {object} Drawing
 * @property {number} ratio height of the canvas by its width
 * @property {string} label what the canvas shows, for screen readers
 * @property {(pen: Pen) => void} draw
 * @property {(at: number[]) => boolean} [grab] begins to drag at a point; false if nothing is there
 * @property {(at: number[], from: number[]) => void} [drag]
 * @property {() => void} [release] the end of dragging
 * @property {(step: number[]) => void} [nudge] arrow keys, and Page Up (1) and Page Down (-1) as a third number
 * @property {(key: string) => boolean} [key] handles another key; true if the key had an effect
 * @property {(at: number[]) => boolean} [isHandle] true at a point that can be dragged
 * @property {() => string} [next] Enter: selects what the arrow keys move; returns its description
 */
/** @typedef {{ highlight: string, point: (symbol: string) => void, redraw: () => void }} Marks the symbol that the reader points at */

const NUDGES = /** @type {Record<string, number[]>} */ ({
  ArrowLeft: [-1, 0, 0], ArrowRight: [1, 0, 0], ArrowUp: [0, -1, 0], ArrowDown: [0, 1, 0], PageUp: [0, 0, 1], PageDown: [0, 0, -1],
});
const LABEL_HEIGHT = 20, REACH_PX = 9, LEADER_PX = 16, PARTS = /** @type {Record<string, string>} */ ({ v: "R", "f(t)": "t" });

/** Distance of a point from the segment between two other points. @param {number[]} at @param {number[]} a @param {number[]} b */
function distanceToLine([x, y], [ax, ay], [bx, by]) {
  const [dx, dy] = [bx - ax, by - ay];
  const s = Math.max(0, Math.min(1, ((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy || 1)));
  return Math.hypot(x - ax - s * dx, y - ay - s * dy);
}

/** A thin line from a point to its label, if the label had to move away. @param {CanvasRenderingContext2D} ctx @param {number[]} at @param {import("./labels.js").Box} box @param {string} ink */
function drawLeader(ctx, [x, y], box, ink) {
  const end = [Math.max(box.x, Math.min(box.x + box.width, x)), Math.max(box.y, Math.min(box.y + box.height, y))];
  if (Math.hypot(end[0] - x, end[1] - y) < LEADER_PX) return;
  ctx.beginPath();
  ctx.moveTo(x, y);
  ctx.lineTo(end[0], end[1]);
  [ctx.strokeStyle, ctx.lineWidth, ctx.globalAlpha] = [ink, 1, 0.6];
  ctx.stroke();
}

export class Board {
  /** @param {HTMLCanvasElement} canvas @param {Drawing} drawing @param {Marks} marks */
  constructor(canvas, drawing, marks) {
    this.canvas = canvas;
    this.drawing = drawing;
    this.marks = marks;
    /** @type {{ symbol: string, points: number[][] }[]} */
    this.touches = [];
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", drawing.label);
    canvas.style.aspectRatio = String(1 / drawing.ratio);
    canvas.addEventListener("pointerleave", () => marks.point(""));
    if (drawing.drag || drawing.nudge) this.makeInteractive();
    canvas.addEventListener("pointermove", (event) => {
      if (this.held) return;
      const at = this.pointOf(event);
      marks.point(this.symbolAt(at));
      canvas.classList.toggle("over-handle", Boolean(drawing.isHandle?.(at)));
    });
    /** @type {number[] | null} */
    this.held = null;
  }

  paint() {
    const { canvas, drawing } = this;
    const { clientWidth: width, clientHeight: height } = canvas;
    const ctx = canvas.getContext("2d");
    if (!width || !height || !ctx) return;
    const density = Math.min(devicePixelRatio || 1, 2);
    const size = [width, height].map((side) => Math.round(side * density));
    if (canvas.width !== size[0] || canvas.height !== size[1]) [canvas.width, canvas.height] = size;
    ctx.setTransform(density, 0, 0, density, 0, 0);
    ctx.clearRect(0, 0, width, height);
    [ctx.lineJoin, ctx.lineCap] = ["round", "round"];
    const style = getComputedStyle(canvas);
    /** @type {Label[]} */
    const labels = [];
    /** @type {number[][]} */
    const marked = [];
    this.touches = [];
    const { highlight } = this.marks;
    /** @type {Pen} */
    const pen = {
      ctx, width, height,
      color: (name) => style.getPropertyValue(`--${name === "f(t)" ? "t" : name}`).trim() || name,
      lit: (symbol) => symbol !== undefined && highlight !== "" && (symbol === highlight || PARTS[symbol] === highlight),
      label: (label) => label.text && labels.push(label),
      avoid: (at) => marked.push(at),
      touch: (symbol, points) => symbol && this.touches.push({ symbol, points }),
    };
    drawing.draw(pen);
    this.drawLabels(pen, labels, marked, style.fontFamily);
  }

  /** @param {Pen} pen @param {Label[]} labels @param {number[][]} marked @param {string} family */
  drawLabels(pen, labels, marked, family) {
    const { ctx, width, height, color } = pen;
    ctx.font = `600 13.5px ${family}`;
    const boxes = placeLabels(labels.map(({ at, text }) => ({ at, width: ctx.measureText(text).width + 10, height: LABEL_HEIGHT })), width, height, marked);
    this.canvas.dataset.labels = JSON.stringify(boxes.flatMap((box, i) => (box ? [{ ...box, text: labels[i].text }] : [])));
    labels.forEach(({ text, color: own, symbol }, i) => {
      const box = boxes[i];
      if (!box) return;
      const ink = own || color(symbol || "ink");
      drawLeader(ctx, labels[i].at, box, ink);
      ctx.globalAlpha = pen.lit(symbol) ? 1 : 0.86;
      ctx.beginPath();
      ctx.roundRect(box.x, box.y, box.width, box.height, 5);
      ctx.fillStyle = pen.lit(symbol) ? ink : color("ground");
      ctx.fill();
      ctx.globalAlpha = 1;
      ctx.fillStyle = pen.lit(symbol) ? color("ground") : ink;
      ctx.fillText(text, box.x + 5, box.y + 14.5);
      if (symbol) this.touches.unshift({ symbol, points: [[box.x + 4, box.y + 10], [box.x + box.width - 4, box.y + 10]] });
    });
  }

  /** The symbol of the closest line or label within reach; "" if nothing is within reach. @param {number[]} at */
  symbolAt(at) {
    let [best, found] = [REACH_PX, ""];
    for (const { symbol, points } of this.touches) {
      for (let i = 0; i < points.length; i++) {
        const distance = distanceToLine(at, points[i], points[i + 1] || points[i]);
        if (distance < best) [best, found] = [distance, symbol];
      }
    }
    return found;
  }

  /** @param {PointerEvent} event */
  pointOf(event) {
    const { left, top } = this.canvas.getBoundingClientRect();
    return [event.clientX - left, event.clientY - top];
  }

  makeInteractive() {
    const { canvas, drawing, marks } = this;
    canvas.tabIndex = 0;
    canvas.setAttribute("role", "application");
    canvas.setAttribute("aria-roledescription", "figure, arrow keys");
    canvas.classList.add("draggable");
    canvas.addEventListener("pointerdown", (event) => {
      const at = this.pointOf(event);
      if (drawing.grab && !drawing.grab(at)) return;
      this.held = at;
      canvas.setPointerCapture(event.pointerId);
      canvas.classList.add("held");
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!this.held) return;
      const at = this.pointOf(event);
      drawing.drag?.(at, this.held);
      this.held = at;
      marks.redraw();
    });
    for (const kind of /** @type {const} */ (["pointerup", "pointercancel"]))
      canvas.addEventListener(kind, () => {
        if (this.held) drawing.release?.();
        this.held = null;
        canvas.classList.remove("held");
      });
    canvas.addEventListener("keydown", (event) => {
      if (event.key === "Enter" && drawing.next) {
        event.preventDefault();
        canvas.setAttribute("aria-label", `${drawing.label} ${drawing.next()}`);
        marks.redraw();
      }
      const isPlain = !event.ctrlKey && !event.metaKey && !event.altKey;
      if (isPlain && drawing.key?.(event.key)) return event.preventDefault();
      const step = NUDGES[event.key];
      if (!step || !drawing.nudge || (step[2] && !drawing.key)) return;
      event.preventDefault();
      drawing.nudge(step.map((value) => value * (event.shiftKey ? 10 : 1)));
      marks.redraw();
    });
  }
}
