// The client: stores the displayed state and executes the commands that change it. It exchanges messages with a transport, which connects it to a saved page or a server.

import { styleOf } from "./image/channels.js";
import { inkOn } from "./image/colormap.js";
import { areComparable, differenceKind, differenceOf, perceptualOf } from "./image/compare.js";
import { showAbout } from "./panel/about.js";
import { ComparePanel } from "./panel/compare.js";
import { DisplayControls } from "./panel/display.js";
import { byId, fillSelect, saveFile } from "./dom.js";
import { listExplanations, showExplaining, showExplanation } from "./panel/explain.js";
import { ShownImage } from "./held.js";
import { fillLegend, fillScale } from "./panel/legend.js";
import { sixDigits } from "./image/numbers.js";
import { NoticeBox } from "./panel/notices.js";
import { paint } from "./image/paint.js";
import { PictureView, layerOf, resizedLayer } from "./picture.js";
import { Tiles } from "./tiles.js";
import { fillReadout, readoutText } from "./panel/readout.js";

/** @typedef {import("./image/planes.js").Plane} Plane */
/** @typedef {import("./picture.js").Pixel} Pixel */
/** @typedef {Record<string, any> & { type: string }} Message */
/** @typedef {{ live: boolean, open: (say: (message: Message) => void) => void, send: (message: import("./messages").ClientMessage) => void }} Transport */

const DIVIDER_REACH = 10; // distance in CSS pixels within which the pointer grabs the divider
const VALUES_ZOOM = 40; // minimum CSS pixels per image pixel at which the pixels' numbers are requested
const BLINK_TIME = 500; // milliseconds after which A and B are exchanged
const PROBE_PAUSE = 20; // minimum milliseconds between two requests for values; a server answers at most 60 per second

export class Client {
  /** @param {Transport} transport */
  constructor(transport) {
    this.transport = transport;
    this.picture = new PictureView(byId("picture", HTMLCanvasElement));
    this.controls = new DisplayControls(() => this.repaint());
    this.compare = new ComparePanel(() => this.repaint());
    /** @type {string[]} */
    this.channels = [];
    this.channel = "";
    this.shown = new ShownImage(this);
    /** @type {Plane | null} */
    this.plane = null;
    /** True if a server sends exact numbers; otherwise it sends compressed images and rounded numbers. */
    this.wantsPlanes = false;
    this.isExact = true;
    this.tiles = new Tiles(this);
    /** True if the next plane becomes B. */
    this.takesNext = false;
    /** @type {Plane | null} the second frame, B, that was received together with A */
    this.frameB = null;
    /** @type {{ plane: Plane | null, layer: HTMLCanvasElement } | null} an image that the user kept as B */
    this.taken = null;
    this.mode = "off";
    this.blinking = 0;
    /** The names of the files of A and B. */
    this.nameA = "";
    this.nameB = "";
    /** @type {Record<string, Record<string, string>>} names of ids by channel */
    this.names = {};
    /** The column and row of the arrays' top left corner in the whole image. */
    this.origin = { column: 0, row: 0 };
    /** @type {Pixel | null} */
    this.hovered = null;
    /** @type {Pixel | null} */
    this.held = null;
    this.probes = 0;
    /** @type {{ pixel: Pixel, values: import("./panel/readout.js").PixelValues } | null} */
    this.known = null;
    this.pointAt = byId("pixel-place", HTMLElement).textContent;
    this.notices = new NoticeBox();
    this.probed = -Infinity;
    this.probeTimer = 0;
    /** Called with every message, after the client has handled it. @type {(message: Message) => void} */
    this.onMessage = () => {};
    /** Called with the pixel that is held. @type {(pixel: Pixel | null) => void} */
    this.onHold = () => {};
    this.onRepaint = () => {}; // called after the image was painted with another range or colour map
    this.controls.onWrong = (text) => this.say(text, "error");
    this.controls.onExact = () => this.wantPlanes();
    this.picture.onZoom = () => this.showZoom();
    this.picture.layers.valuesIn = (pixel) => this.valuesIn(pixel);
  }

  open() {
    this.transport.open((message) => this.receive(message));
  }

  /** @param {Message} message */
  receive(message) {
    if (message.type === "welcome") this.welcome(message);
    if (message.type === "picture") this.showPicture(message);
    if (message.type === "values" && message.id === this.probes) this.showValues(message);
    if (message.type === "unpacked") this.probe();
    if (message.type === "tile") this.tiles.receive(message);
    if (message.type === "explained" || message.type === "error") showExplaining(false);
    if (message.type === "explained") showExplanation(/** @type {any} */ (message), this.picture.layers.a);
    if (message.type === "notice" || message.type === "error") this.say(message.text, message.type, true);
    if (message.type === "status") byId("status", HTMLElement).textContent = message.text;
    if (message.type === "file") this.say(saveFile(message.name, message.media, message.bytes), "notice", true);
    if (message.type === "about") showAbout(message);
    this.onMessage(message);
  }

  /** @param {Message} welcome */
  welcome(welcome) {
    [this.wantsPlanes, this.shown.number] = [false, 0];
    document.body.classList.toggle("live", this.transport.live);
    byId("title", HTMLElement).textContent = welcome.title;
    document.title = welcome.title;
    [this.nameA, this.nameB] = welcome.compared || ["", ""];
    this.channels = welcome.channels.map((/** @type {any} */ each) => each.name);
    this.names = welcome.names;
    this.origin = { column: welcome.origin[0], row: welcome.origin[1] };
    fillSelect(byId("channel", HTMLSelectElement), this.channels.map((name) => [name, name]));
    if (welcome.resumed) this.controls.onDisplay(this.controls.display);
    else {
      this.controls.firstExposure = welcome.exposure;
      this.controls.setExposure(welcome.exposure);
      this.controls.setView(welcome.view);
    }
    showAbout(welcome);
    this.picture.layers.marks = welcome.explanations;
    listExplanations(welcome.explanations, this.origin, (pixel) => this.explain(pixel));
    const channel = this.channel || welcome.channel;
    this.setChannel(this.channels.includes(channel) ? channel : this.channels[0]);
  }

  /** @param {string} name */
  setChannel(name) {
    if (!this.channels.includes(name)) return this.say(`Channel ${name} is not available in this view.`, "notice");
    if (name !== this.channel && this.wantsPlanes && !this.taken) this.transport.send({ type: "planes", wanted: (this.wantsPlanes = false) });
    this.channel = name;
    byId("channel", HTMLSelectElement).value = name;
    this.transport.send({ type: "channel", name: /** @type {import("./messages").Channel["name"]} */ (name) });
  }

  /** @param {number} step */
  stepChannel(step) {
    const count = this.channels.length;
    this.setChannel(this.channels[(this.channels.indexOf(this.channel) + step + count) % count]);
  }

  /** @param {Message} message */
  showPicture({ channel, plane, other, bitmap, image, camera, width, height, moving, exact = true }) {
    if (channel !== this.channel) return;
    this.plane = plane || null;
    this.isExact = Boolean(plane) && exact;
    this.tiles.forget();
    this.frameB = other || null;
    byId("status-picture", HTMLElement).textContent = `${width} x ${height}`;
    this.shown.replace({ image, camera, moving, width, height });
    if (plane) {
      this.controls.show(plane, this.isExact);
      this.repaint();
      if (!moving) this.probe();
      if (this.takesNext && this.isExact && !moving) this.takeB();
    } else {
      this.controls.showLight();
      fillScale(byId("scale", HTMLElement), null, this.controls.display);
      this.picture.show({ a: layerOf(bitmap), mode: differenceKind(this.mode) ? "off" : this.picture.layers.mode });
      this.showCompare(null, []); // the numbers belong to an earlier image
      if (!moving) this.probe();
    }
    this.describe();
    if (!moving) this.showZoom();
  }

  /** Paints the image again after a change of the display settings, the channel or the mode. */
  repaint() {
    const { plane, controls } = this;
    this.onRepaint();
    if (!plane) {
      fillScale(byId("scale", HTMLElement), null, controls.display);
      if (this.taken && !differenceKind(this.mode)) this.picture.show({ b: this.taken.layer, mode: this.layerMode() });
      return this.showCompare(null, []);
    }
    const b = this.frameB || this.taken?.plane;
    const kind = differenceKind(this.mode);
    const layerA = layerOf(paint(plane, controls.display));
    const imageB = this.frameB ? layerOf(paint(this.frameB, controls.display)) : this.taken?.layer || null;
    const numeric = kind !== "perceptual" && b && areComparable(plane, b) ? differenceOf(plane, b, kind || "absolute") : null;
    const difference = kind === "perceptual" ? perceptualOf(layerA, imageB) : numeric;
    let [layerB, display] = [imageB, controls.display];
    if (kind && difference) {
      display = { ...controls.display, ...this.compare.displayOf(difference) };
      layerB = layerOf(paint(difference.plane, display));
    }
    this.picture.show({ a: layerA, b: layerB, mode: layerB && (!kind || difference) ? this.layerMode() : "off" });
    const legend = kind && difference ? difference.plane : plane;
    fillScale(byId("scale", HTMLElement), legend, display);
    fillLegend(byId("legend", HTMLElement), legend, display, this.names[plane.name] || {});
    this.showCompare(difference, [layerA, imageB]);
  }

  /**
   * @param {import("./image/compare.js").Difference | null} difference
   * @param {(HTMLCanvasElement | null)[]} layers A and B as displayed
   */
  showCompare(difference, layers) {
    const b = this.frameB ? "frame" : this.taken ? "kept" : "";
    this.compare.show({ b, names: [this.nameA, this.nameB], mode: this.mode, difference, layers });
  }

  /** The mode in which the canvas draws the image and B. @returns {import("./picture.js").Layers["mode"]} */
  layerMode() {
    if (differenceKind(this.mode)) return "difference";
    return /** @type {any} */ (this.mode === "blink" ? "flip" : this.mode);
  }

  /** @param {string} mode */
  setMode(mode) {
    this.mode = mode;
    this.picture.layers.flipped = mode === "flip";
    clearInterval(this.blinking);
    if (mode === "blink") this.blinking = setInterval(() => this.picture.show({ flipped: !this.picture.layers.flipped }), BLINK_TIME);
    this.repaint();
    this.describe();
  }

  nextMode() {
    if (!this.frameB && !this.taken) return this.say("No image to compare with; press B to keep this image as B.", "notice");
    const enabled = [...byId("compare-mode", HTMLSelectElement).options].filter((option) => !option.disabled);
    const at = enabled.findIndex((option) => option.value === this.mode);
    this.setMode(enabled[(at + 1) % enabled.length].value);
  }

  flip() {
    if (this.mode !== "flip") this.setMode("flip");
    else this.picture.show({ flipped: !this.picture.layers.flipped });
    this.describe();
  }

  takeB() {
    if (!this.picture.layers.a) return;
    this.takesNext = !this.isExact && this.transport.live;
    if (this.takesNext) return this.wantPlanes();
    this.taken = { plane: this.plane, layer: this.picture.layers.a };
    this.frameB = null;
    this.say("This image is kept as B. Change something to compare A with B.", "notice");
    this.repaint();
  }

  /** Uses an image as image B of the comparison. @param {HTMLCanvasElement} layer @param {string} text that is shown */
  takeLayer(layer, text) {
    this.taken = { plane: null, layer: resizedLayer(layer, this.picture.width, this.picture.height) };
    this.frameB = null;
    this.say(text, "notice");
    this.wantPlanes();
    this.repaint();
  }

  /** Requests exact numbers, which comparisons and ranges need. */
  wantPlanes() {
    if (this.wantsPlanes || this.isExact) return;
    this.wantsPlanes = true;
    this.transport.send({ type: "planes", wanted: true });
  }

  /** @param {number} share */
  setDivider(share) {
    const divider = Math.min(Math.max(share, 0), 1);
    byId("divider", HTMLInputElement).value = String(divider);
    this.picture.show({ divider });
  }

  /**
   * @param {import("./pointer.js").Point} at
   * @returns {boolean} true if the divider is under the pointer
   */
  grabsDivider({ x }) {
    return this.mode === "slider" && Math.abs(x - this.picture.dividerX()) < DIVIDER_REACH;
  }

  /** @param {import("./pointer.js").Point} at */
  divideAt({ x }) {
    const { left, zoom, width } = this.picture;
    this.setDivider((x - left) / (zoom * width));
  }

  /** @param {Pixel | null} pixel */
  hover(pixel) {
    if (this.held || (pixel?.column === this.hovered?.column && pixel?.row === this.hovered?.row)) return;
    this.hovered = pixel;
    this.probe();
  }

  /** @param {Pixel | null} pixel */
  hold(pixel) {
    this.held = pixel;
    this.onHold(pixel);
    this.picture.show({ held: pixel });
    if (pixel) this.picture.reveal(pixel);
    for (const id of ["copy", "explain", "leave"]) byId(id, HTMLButtonElement).disabled = !pixel;
    if (!pixel) this.forgetValues();
    this.probe();
  }

  /** Holds a clicked pixel, and reports it to the server, because the script that shows the view may react to it.
   * @param {Pixel | null} pixel */
  pick(pixel) {
    this.hold(pixel);
    if (pixel && this.transport.live) this.transport.send({ type: "pick", image: this.shown.number, u: pixel.column, v: pixel.row });
  }

  /** Empties the readout, because its values are out of date. */
  forgetValues() {
    this.known = null;
    byId("pixel-place", HTMLElement).textContent = this.pointAt;
    byId("values", HTMLTableSectionElement).replaceChildren();
    byId("held", HTMLElement).textContent = "";
  }

  /** Requests the values of the held or hovered pixel. */
  probe() {
    clearTimeout(this.probeTimer);
    const wait = this.transport.live ? this.probed + PROBE_PAUSE - performance.now() : 0;
    if (wait > 0) this.probeTimer = setTimeout(() => this.askForValues(), wait);
    else this.askForValues();
  }

  askForValues() {
    this.probed = performance.now();
    const pixel = this.held || this.hovered;
    if (!this.shown.number || !pixel || pixel.column >= this.picture.width || pixel.row >= this.picture.height) return;
    this.transport.send({ type: "probe", id: ++this.probes, image: this.shown.number, u: pixel.column, v: pixel.row });
  }

  /** @param {Message} message */
  showValues({ u, v, values }) {
    const pixel = { column: u + this.origin.column, row: v + this.origin.row };
    this.known = { pixel, values };
    byId("pixel-place", HTMLElement).textContent = `column ${pixel.column}, row ${pixel.row}${this.held ? " (held)" : ""}`;
    fillReadout(byId("values", HTMLTableSectionElement), values, this.channel);
    if (this.held) byId("held", HTMLElement).textContent = readoutText(pixel, values);
  }

  async copy() {
    if (!this.known) return;
    try {
      await navigator.clipboard.writeText(readoutText(this.known.pixel, this.known.values));
      this.say("Copied the values.", "notice");
    } catch {
      this.say("Nothing was copied: the browser blocks the clipboard. Allow clipboard access for this page and try again.", "error");
    }
  }

  /** @param {Pixel | null} pixel */
  explain(pixel = this.held) {
    if (!pixel) return this.say("No pixel is held; click the image to hold a pixel.", "notice");
    if (pixel !== this.held) this.hold(pixel);
    showExplaining(this.transport.live);
    this.transport.send({ type: "explain", id: ++this.probes, image: this.shown.number, u: pixel.column, v: pixel.row });
    this.probe();
  }

  /**
   * The lines of text that are drawn in a large pixel.
   * @param {Pixel} pixel
   */
  valuesIn({ column, row }) {
    const { numbers, dtype } = (this.mode === "off" && this.numbersAt(column, row)) || { numbers: [], dtype: "" };
    const lines = numbers.map((v) => (dtype === "int32" ? String(v) : sixDigits(Number(v.toPrecision(4)), "float64")));
    if (!lines.length) return { lines, ink: "#fff" };
    const context = /** @type {CanvasRenderingContext2D} */ (this.picture.layers.a?.getContext("2d"));
    return { lines, ink: inkOn(context.getImageData(column, row, 1, 1).data) };
  }

  /** The exact numbers of a pixel, if they have arrived. @param {number} column @param {number} row */
  numbersAt(column, row) {
    const { plane } = this;
    if (!plane || !this.isExact || plane.width !== this.picture.width) return this.tiles.at(this.channel, column, row);
    const at = (row * plane.width + column) * plane.components;
    return { numbers: [...plane.values.subarray(at, at + plane.components)], dtype: plane.dtype };
  }

  showZoom() {
    const percent = 100 * this.picture.zoom * this.picture.ratio;
    const hasPicture = Boolean(byId("status-picture", HTMLElement).textContent);
    if (this.transport.live && hasPicture && this.picture.zoom >= VALUES_ZOOM && !this.isExact) this.tiles.request();
    byId("status-zoom", HTMLElement).textContent = !hasPicture ? "" : `${percent < 10 ? percent.toFixed(1) : Math.round(percent)} %`;
  }

  /** Describes the image for screen readers. */
  describe() {
    const compare = this.mode === "off" ? "" : `, comparing by ${this.mode}`;
    const shown = this.plane ? ` (${styleOf(this.plane).kind})` : "";
    const text = `Image of ${this.picture.width} by ${this.picture.height} pixels, channel ${this.channel}${shown}${compare}.`;
    this.picture.canvas.setAttribute("aria-label", `${text} Arrow keys move the held pixel, P holds a pixel, question mark lists the keys.`);
  }

  /** Shows a message. @param {string} text @param {string} type "notice" or "error" @param {boolean} joins true to add it to the previous message */
  say(text, type, joins = false) {
    this.notices.say(text, type, joins);
  }

  /** Removes the message. */
  unsay() {
    this.notices.unsay();
  }
}
