// The image on its canvas: fits, zooms and pans the image, and draws the divider between A and B and the values in
// large pixels.

import { inkOn } from "./image/colormap.js";
import { drawMeasured } from "./image/measured.js";
import { drawPoints } from "./image/points.js";

/** @typedef {{ column: number, row: number }} Pixel */
/**
 * @typedef {object} Layers
 * @property {HTMLCanvasElement | null} a
 * @property {HTMLCanvasElement | null} b
 * @property {"off" | "slider" | "flip" | "difference"} mode
 * @property {HTMLCanvasElement | null} photo a photograph over the image
 * @property {number} photoOpacity 0 to 1
 * @property {number} divider share of the image's width that shows A
 * @property {boolean} flipped
 * @property {Pixel | null} held
 * @property {{ name: string, lines: [number, number][][], color?: string, handle?: string, thin?: boolean, points?: number[] }[]} overlay lines in pixels of the image, and points as number, column and row
 * @property {import("./image/measured.js").Measured | null} measured
 * @property {Pixel[]} marks pixels that have an explanation
 * @property {((pixel: Pixel) => { lines: string[], ink: string }) | null} valuesIn the text in a pixel that is drawn large
 */

const OVERLAY_COLOR = "#ffd60a";
const GRID_FROM = 12; // minimum CSS pixels per image pixel at which the pixel grid is drawn
const VALUES_FROM = 56;
const MOST_ZOOM = 256;

export class PictureView {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    this.context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d", { alpha: false }));
    /** @type {Layers} */
    this.layers = { a: null, b: null, photo: null, photoOpacity: 0, mode: "off", divider: 0.5, flipped: false, held: null, overlay: [], measured: null, marks: [], valuesIn: null };
    this.width = 1;
    this.height = 1;
    this.zoom = 1; // CSS pixels per pixel of the image
    this.left = 0; // position of the image's top left corner on the canvas, in CSS pixels
    this.top = 0;
    this.fitted = true;
    this.waiting = false;
    /** Device pixels per CSS pixel of the drawn image. */
    this.ratio = devicePixelRatio || 1;
    /** The colour of a point by its number. @type {(number: number) => string} */
    this.pointColor = () => OVERLAY_COLOR;
    /** Called when the ratio changes, such as on another screen. */
    this.onRatio = () => {};
    /** Called when the zoom changes. */
    this.onZoom = () => {};
    new ResizeObserver(() => this.resized()).observe(canvas);
    this.watchRatio();
    canvas.addEventListener("pointermove", () => this.checkRatio());
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.redraw());
  }

  /** Draws again when the window moves to a screen with another ratio, because the window's size in CSS pixels may stay the same. */
  watchRatio() {
    matchMedia(`(resolution: ${devicePixelRatio}dppx)`).addEventListener("change", () => {
      this.watchRatio();
      this.checkRatio();
    }, { once: true });
  }

  checkRatio() {
    if (this.ratio === (devicePixelRatio || 1)) return;
    this.resized();
    this.onRatio();
  }

  /**
   * Shows images of this size. A new size is fitted.
   * @param {number} width
   * @param {number} height
   */
  setSize(width, height) {
    if (width === this.width && height === this.height) return;
    const ratio = this.width / width;
    this.width = width;
    this.height = height;
    if (this.fitted) this.fit();
    else this.zoom *= ratio;
  }

  /** @param {Partial<Layers>} changed */
  show(changed) {
    Object.assign(this.layers, changed);
    this.redraw();
  }

  resized() {
    this.ratio = devicePixelRatio || 1;
    const { width, height } = this.canvas.getBoundingClientRect();
    this.canvas.width = Math.max(1, Math.round(width * this.ratio));
    this.canvas.height = Math.max(1, Math.round(height * this.ratio));
    if (this.fitted) this.fit();
    else this.redraw();
  }

  /** Shows all of the image. */
  fit() {
    const { width, height } = this.canvas.getBoundingClientRect();
    this.zoom = Math.max(Math.min(width / this.width, height / this.height), 1e-3);
    this.left = (width - this.zoom * this.width) / 2;
    this.top = (height - this.zoom * this.height) / 2;
    this.fitted = true;
    this.changed();
  }

  /** Shows one pixel of the image as one pixel of the display. The middle stays where it is. */
  oneToOne() {
    const { width, height } = this.canvas.getBoundingClientRect();
    this.zoomAt(1 / this.ratio / this.zoom, width / 2, height / 2);
  }

  /**
   * Zooms by a factor; the point of the image at (x, y) stays there.
   * @param {number} factor
   * @param {number} x CSS pixels from the canvas' left
   * @param {number} y
   */
  zoomAt(factor, x, y) {
    const zoom = Math.min(Math.max(this.zoom * factor, 0.02), MOST_ZOOM);
    this.left = x - ((x - this.left) * zoom) / this.zoom;
    this.top = y - ((y - this.top) * zoom) / this.zoom;
    this.zoom = zoom;
    this.pan(0, 0);
  }

  /**
   * Moves the image; some of it stays visible.
   * @param {number} dx CSS pixels
   * @param {number} dy
   */
  pan(dx, dy) {
    const { width, height } = this.canvas.getBoundingClientRect();
    const kept = 32;
    this.left = Math.min(Math.max(this.left + dx, kept - this.zoom * this.width), width - kept);
    this.top = Math.min(Math.max(this.top + dy, kept - this.zoom * this.height), height - kept);
    this.fitted = false;
    this.changed();
  }

  /** Called after a zoom or a move. Puts the image's corner on a whole pixel of the display, so that 1:1 is exact. */
  changed() {
    const { ratio } = this;
    this.left = Math.round(this.left * ratio) / ratio;
    this.top = Math.round(this.top * ratio) / ratio;
    this.onZoom();
    this.redraw();
  }

  /**
   * The pixel under a point of the canvas, or null outside the image.
   * @param {number} x CSS pixels
   * @param {number} y
   * @returns {Pixel | null}
   */
  pixelAt(x, y) {
    const column = Math.floor((x - this.left) / this.zoom);
    const row = Math.floor((y - this.top) / this.zoom);
    return column >= 0 && row >= 0 && column < this.width && row < this.height ? { column, row } : null;
  }

  /**
   * Pans so that a pixel is visible.
   * @param {Pixel} pixel
   */
  reveal({ column, row }) {
    const { width, height } = this.canvas.getBoundingClientRect();
    const [x, y] = [this.left + (column + 0.5) * this.zoom, this.top + (row + 0.5) * this.zoom];
    const margin = Math.min(24, width / 4, height / 4);
    const dx = Math.max(margin - x, 0) + Math.min(width - margin - x, 0);
    const dy = Math.max(margin - y, 0) + Math.min(height - margin - y, 0);
    if (dx || dy) this.pan(dx, dy);
  }

  redraw() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.draw();
    });
  }

  draw() {
    const { context, canvas, layers, ratio } = this;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.fillStyle = getComputedStyle(canvas).backgroundColor;
    context.fillRect(0, 0, canvas.width, canvas.height);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    const isReduced = layers.a !== null && layers.a.width !== this.width;
    context.imageSmoothingEnabled = isReduced || this.zoom * ratio < 1;
    context.imageSmoothingQuality = "high";
    const showsB = layers.b && (layers.mode === "difference" || (layers.mode === "flip" && layers.flipped));
    this.drawLayer(showsB ? layers.b : layers.a, 0, 1);
    if (layers.photo && layers.photoOpacity > 0) {
      context.globalAlpha = layers.photoOpacity;
      this.drawLayer(layers.photo, 0, 1);
      context.globalAlpha = 1;
    }
    if (layers.mode === "slider" && layers.b) {
      this.drawLayer(layers.b, layers.divider, 1);
      this.drawDivider();
    }
    if (this.zoom >= GRID_FROM) this.drawGrid();
    if (this.zoom >= VALUES_FROM && layers.valuesIn) this.drawValues(layers.valuesIn);
    if (layers.overlay.length) this.drawOverlay(layers.overlay);
    if (layers.measured) drawMeasured(context, layers.measured, this);
    for (const mark of layers.marks) this.drawBox(mark, "#e08a00");
    if (layers.held) this.drawBox(layers.held, "#ff2d55");
  }

  /**
   * @param {HTMLCanvasElement | null} layer
   * @param {number} from share of the width where it begins
   * @param {number} to
   */
  drawLayer(layer, from, to) {
    if (!layer) return;
    const [width, height] = [this.zoom * this.width, this.zoom * this.height];
    const scale = layer.width;
    this.context.drawImage(
      layer,
      from * scale, 0, (to - from) * scale, layer.height,
      this.left + from * width, this.top, (to - from) * width, height,
    );
  }

  drawDivider() {
    const { context } = this;
    const x = this.dividerX();
    const height = this.zoom * this.height;
    context.fillStyle = "#000";
    context.fillRect(x - 1.5, this.top, 3, height);
    context.fillStyle = "#fff";
    context.fillRect(x - 0.5, this.top, 1, height);
    context.font = "600 13px system-ui, sans-serif";
    context.textBaseline = "top";
    for (const [name, align, at] of /** @type {[string, CanvasTextAlign, number][]} */ ([["A", "right", x - 8], ["B", "left", x + 8]])) {
      context.textAlign = align;
      context.lineWidth = 3;
      context.strokeStyle = "#000";
      context.strokeText(name, at, Math.max(this.top, 0) + 8);
      context.fillText(name, at, Math.max(this.top, 0) + 8);
    }
  }

  /** @returns {number} the column of the divider, in CSS pixels of the canvas */
  dividerX() {
    return this.left + this.layers.divider * this.zoom * this.width;
  }

  /** The pixels that are visible, as first column, first row, end column, end row. */
  visible() {
    const { width, height } = this.canvas.getBoundingClientRect();
    return [
      Math.max(Math.floor(-this.left / this.zoom), 0),
      Math.max(Math.floor(-this.top / this.zoom), 0),
      Math.min(Math.ceil((width - this.left) / this.zoom), this.width),
      Math.min(Math.ceil((height - this.top) / this.zoom), this.height),
    ];
  }

  drawGrid() {
    const { context, zoom } = this;
    const [column0, row0, column1, row1] = this.visible();
    context.beginPath();
    for (let column = column0; column <= column1; column++) {
      context.moveTo(this.left + column * zoom, this.top + row0 * zoom);
      context.lineTo(this.left + column * zoom, this.top + row1 * zoom);
    }
    for (let row = row0; row <= row1; row++) {
      context.moveTo(this.left + column0 * zoom, this.top + row * zoom);
      context.lineTo(this.left + column1 * zoom, this.top + row * zoom);
    }
    context.strokeStyle = "rgba(128, 128, 128, 0.35)";
    context.lineWidth = 1;
    context.stroke();
  }

  /** @param {NonNullable<Layers["valuesIn"]>} valuesIn */
  drawValues(valuesIn) {
    const { context, zoom } = this;
    const [column0, row0, column1, row1] = this.visible();
    const size = Math.min(zoom / 6, 14);
    context.font = `${size}px ui-monospace, monospace`;
    context.textAlign = "center";
    context.textBaseline = "middle";
    for (let row = row0; row < row1; row++) {
      for (let column = column0; column < column1; column++) {
        const { lines, ink } = valuesIn({ column, row });
        const [x, y] = [this.left + (column + 0.5) * zoom, this.top + (row + 0.5) * zoom];
        context.fillStyle = ink;
        lines.forEach((line, i) => context.fillText(line, x, y + (i - (lines.length - 1) / 2) * 1.25 * size, zoom - 4));
      }
    }
  }

  /** @param {Layers["overlay"]} overlay */
  drawOverlay(overlay) {
    const { context, zoom, left, top } = this;
    context.save();
    context.beginPath();
    context.rect(left, top, zoom * this.width, zoom * this.height);
    context.clip();
    for (const { points } of overlay) if (points) drawPoints(context, points, this, this.pointColor);
    context.font = "600 12px system-ui, sans-serif";
    context.textAlign = "left";
    context.textBaseline = "bottom";
    for (const isHalo of [true, false]) {
      for (const { lines, color, handle, thin } of overlay) {
        if (thin && isHalo) continue;
        context.lineWidth = thin ? 1 : (isHalo ? 3 : 1.5) + (handle ? 1.5 : 0);
        context.strokeStyle = isHalo ? "#000" : color || OVERLAY_COLOR;
        context.beginPath();
        for (const line of lines) line.forEach(([u, v], i) => (i ? context.lineTo(left + u * zoom, top + v * zoom) : context.moveTo(left + u * zoom, top + v * zoom)));
        context.stroke();
      }
    }
    for (const { name, lines, color, thin } of overlay) {
      if (!name) continue;
      const line = lines[lines.length - 1];
      const inside = thin && lines.flat().find(([u, v]) => u > 0 && v > this.height / 4 && u < this.width / 2 && v < this.height);
      const [u, v] = inside || (color ? line[line.length - 1] : lines[0][0]);
      context.lineWidth = 3;
      context.fillStyle = color || OVERLAY_COLOR;
      context.strokeStyle = haloOf(String(context.fillStyle));
      context.strokeText(name, left + u * zoom, top + v * zoom - 3);
      context.fillText(name, left + u * zoom, top + v * zoom - 3);
    }
    context.restore();
  }

  /**
   * @param {Pixel} pixel
   * @param {string} color
   */
  drawBox({ column, row }, color) {
    const { context } = this;
    const size = Math.max(this.zoom, 7);
    const x = this.left + (column + 0.5) * this.zoom - size / 2;
    const y = this.top + (row + 0.5) * this.zoom - size / 2;
    context.lineWidth = 4;
    context.strokeStyle = "#fff";
    context.strokeRect(x, y, size, size);
    context.lineWidth = 2;
    context.strokeStyle = color;
    context.strokeRect(x, y, size, size);
  }
}

/**
 * A canvas that holds an image.
 * @param {ImageData | ImageBitmap} image
 * @returns {HTMLCanvasElement}
 */
export function layerOf(image) {
  const canvas = document.createElement("canvas");
  canvas.width = image.width;
  canvas.height = image.height;
  const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d", { willReadFrequently: true }));
  if (image instanceof ImageData) context.putImageData(image, 0, 0);
  else context.drawImage(image, 0, 0);
  return canvas;
}

/**
 * A copy of a layer in another size.
 * @param {HTMLCanvasElement} layer @param {number} width @param {number} height
 * @returns {HTMLCanvasElement}
 */
export function resizedLayer(layer, width, height) {
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [width, height];
  const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d", { willReadFrequently: true }));
  context.imageSmoothingQuality = "high";
  context.drawImage(layer, 0, 0, width, height);
  return canvas;
}

/**
 * The outline of letters in a colour: black or white, whichever makes the letters readable.
 * @param {string} color as "#rrggbb"
 * @returns {string}
 */
function haloOf(color) {
  return inkOn([1, 3, 5].map((at) => parseInt(color.slice(at, at + 2), 16)));
}
