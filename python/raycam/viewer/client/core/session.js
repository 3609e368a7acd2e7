// A session in a worker, for pages that render without a server: the counterpart of viewer/session/ in Python.

import { apply, rowOf } from "./vectors.js";
import { groundBelow } from "./ground.js";
import { explainPixel } from "./explained_pixel.js";

/** @typedef {Record<string, any> & { type: string }} Message to the client */
/** @typedef {import("../messages").ClientMessage} ClientMessage */
/** @typedef {import("../image/planes.js").Plane} Plane */

const LARGEST = [640, 480]; // the largest still image: columns and rows
const SAMPLES = /** @type {Record<string, number>} */ ({ flat: 16, direct: 64, path: 256, ao: 64 });
const COLORS = ["color", "alpha", "coverage"]; // the channels that improve with more samples
const LEFT_OUT = [...COLORS, "shadow", "error"];
const MOVING_TIME = 60; // maximum render time of an image during a movement, in milliseconds
const BAND_TIME = 60; // milliseconds between two checks for new messages
const MAX_SENT = 32; // stored cameras of images that were sent
const REST = 150; // milliseconds without a change after which still images are rendered

export class Session {
  /**
   * @param {any} core the module of crates/web
   * @param {any} world
   * @param {{ title: string, integrator?: string, exposure?: number, view?: string, camera?: string, channel?: string, pose?: any, samples?: number }} options
   * @param {(message: Message, transfer?: Transferable[]) => void} say
   */
  constructor(core, world, options, say) {
    this.world = world;
    this.say = say;
    this.title = options.title;
    this.about = JSON.parse(world.about());
    this.table = JSON.parse(core.channels());
    this.truth = this.table.map((/** @type {any} */ row) => row.name).filter((/** @type {string} */ name) => !LEFT_OUT.includes(name));
    this.up = this.about.up === "y" ? [0, 1, 0] : [0, 0, 1];
    this.bounds = this.about.bounds || [[-1, -1, -1], [1, 1, 1]];
    this.middle = this.bounds[0].map((/** @type {number} */ low, /** @type {number} */ i) => (low + this.bounds[1][i]) / 2);
    this.pivot = this.middle;
    this.home = world.camera(options.camera, 640, 480);
    this.given = options.pose ? this.home.atPose(Float64Array.from(options.pose.R), Float64Array.from(options.pose.C)) : this.home;
    this.name = options.pose ? "" : options.camera || this.about.cameras[0] || "";
    this.homeName = this.name;
    this.integrator = options.integrator || this.about.render.integrator || "direct";
    this.most = options.samples || 0;
    this.exposure = options.exposure ?? this.about.render.exposure ?? 0;
    this.view = options.view || this.about.render.view || "standard";
    this.space = [640, 480];
    this.first = options.channel || "color";
    this.channel = this.first;
    this.seq = 0;
    this.version = 0;
    /** @type {Map<number, any>} cameras of the newest images by version: the page may still show an older image */
    this.sent = new Map();
    this.touched = 0;
    this.moved = -1;
    this.samples = 0;
    this.shown = "";
    /** @type {Map<string, Plane> | null} planes of the newest still image of this version */
    this.still = null;
    this.cost = 0.002; // milliseconds per pixel of a moving image, measured
    this.cares = true;
    /** @type {any} corners, ids and colours of all triangles */
    this.triangles = null;
  }

  welcome() {
    this.say({
      type: "welcome",
      title: this.title,
      channels: ["color", ...this.truth, ...COLORS.slice(1)].map((name) => ({ name })),
      cameras: this.about.cameras,
      names: { instance: Object.fromEntries(this.about.objects.map((/** @type {string} */ name, /** @type {number} */ id) => [id, name])), category: this.about.categories },
      channel: this.first,
      origin: [0, 0],
      exposure: this.exposure,
      view: this.view,
      integrator: this.integrator,
      explanations: [],
      time: { seconds: 0, now: 0, animation: "" },
      animations: [],
      variants: [],
      variant: "",
      ...this.described([]),
      camera: this.cameraMessage(),
    });
  }

  /** @param {string[]} notices */
  described(notices) {
    const { size, K, C } = this.given;
    const number = (/** @type {number} */ count, /** @type {string} */ what) => `${count} ${what}${count === 1 ? "" : "s"}`;
    const counts = `${number(this.about.objects.length, "object")}, ${number(this.about.triangles, "triangle")}, rendered in this page`;
    const text = `${counts}\n\ncamera of ${size[0]} x ${size[1]}\nK = [${[...K].join(", ")}]\nC = [${[...C].join(", ")}]`;
    return { about: text, notices: [...this.about.notices, ...notices] };
  }

  /** The message `camera`, with everything that the client needs for navigation. */
  cameraMessage() {
    const { camera } = this;
    const [R, size, corner] = [[...camera.R], [...camera.size], camera.offset - 0.5];
    const [x, y] = [corner + size[0] / 2, corner + size[1] / 2];
    const edges = [[corner, y], [corner + size[0], y], [x, corner], [x, corner + size[1]]]
      .map(([u, v]) => apply(R, [...camera.ray(u, v)].slice(3)))
      .filter((ray) => ray.every(Number.isFinite));
    const { seq, name, up, bounds, pivot } = this;
    return { type: "camera", seq, name, R, C: [...camera.C], K: [...camera.K], size, up, parallel: false, edges, bounds, pivot };
  }

  sendCamera() {
    this.say(this.cameraMessage());
  }

  /** @returns {[number, number]} the size of a still image */
  get size() {
    const [width, height] = this.given.size;
    const scale = Math.min(Math.min(this.space[0], LARGEST[0]) / width, Math.min(this.space[1], LARGEST[1]) / height);
    return [Math.max(1, Math.round(width * scale)), Math.max(1, Math.round(height * scale))];
  }

  get camera() {
    return this.given.resized(...this.size);
  }

  get target() {
    return this.most || SAMPLES[this.integrator] || 64;
  }

  changed() {
    this.version += 1;
    this.touched = performance.now();
    this.samples = 0;
    this.still = null;
    this.shown = "";
  }

  /** Executes a message; messages of controls that pages do not show are ignored. @param {ClientMessage} message */
  receive(message) {
    switch (message.type) {
      case "size": return this.resize(message);
      case "move": return this.move(message);
      case "home": return this.goHome(message);
      case "locate": return this.locate(message);
      case "ground": return this.findGround(message);
      case "camera": return this.lookThrough(message);
      case "channel": return this.chooseChannel(message.name);
      case "display": return void ([this.exposure, this.view] = [message.exposure, message.view]);
      case "quality":
        this.integrator = message.integrator;
        return this.changed();
      case "visible": return void (this.cares = message.visible);
      case "probe": return this.probe(message);
      case "explain": return this.explain(message);
      case "copy": return this.say({ type: "copied", text: this.copied() });
      case "snapshot": return this.snapshot(message.format);
      default:
    }
  }

  /** @param {string} name */
  chooseChannel(name) {
    this.channel = name;
    this.shown = "";
    if (this.moved === this.version) this.touched = 0;
  }

  /** @param {import("../messages").Size} message */
  resize({ width, height, ratio }) {
    const before = String(this.size);
    this.space = [Math.max(1, Math.round(width * ratio)), Math.max(1, Math.round(height * ratio))];
    if (this.version && before === String(this.size)) return;
    this.changed();
    this.sendCamera();
  }

  /** @param {import("../messages").LookThrough} message */
  lookThrough({ seq, name }) {
    this.seq = seq;
    if (name) this.given = this.world.camera(name, 640, 480);
    this.name = name;
    this.changed();
    this.sendCamera();
  }

  /** @param {import("../messages").Move} message */
  move({ seq, R, C, pivot }) {
    this.seq = seq;
    this.pivot = pivot;
    if (String(R) === String([...this.given.R]) && String(C) === String([...this.given.C])) return;
    this.given = this.given.atPose(Float64Array.from(R), Float64Array.from(C));
    this.name = "";
    this.changed();
  }

  /** @param {import("../messages").Home} message */
  goHome({ seq }) {
    this.seq = seq;
    [this.given, this.pivot, this.name] = [this.home, this.middle, this.about.cameras.includes(this.homeName) ? this.homeName : ""];
    this.changed();
    this.sendCamera();
  }

  /** @param {import("../messages").Locate} message */
  locate({ id, image, u, v }) {
    const camera = this.sent.get(image) || this.camera;
    const corner = camera.offset - 0.5;
    const ray = [...camera.ray(u + corner, v + corner)];
    const [origin, direction] = ray.every(Number.isFinite) ? [ray.slice(0, 3), ray.slice(3)] : [null, null];
    this.say({ type: "answer", id, origin, direction, point: this.pointAt(camera, u, v), bounds: null });
  }

  /** @param {import("../messages").Ground} message */
  findGround({ id, begin, end, foot }) {
    const { corners } = this.shownTriangles();
    this.say({ type: "answer", id, below: [begin, end].map((place) => groundBelow(corners, this.up, place, foot)) });
  }

  /** @param {any} camera @param {number} u @param {number} v @returns {number[] | null} the surface point at this position, and its object */
  pointAt(camera, u, v) {
    const [[width, height], column, row] = [camera.size, Math.floor(u), Math.floor(v)];
    if (column < 0 || row < 0 || column >= width || row >= height) return null;
    const position = [...this.render(camera, { channels: ["position"], region: [column, row, 1, 1] }, true).get("position").values];
    return position.every(Number.isFinite) ? position : null;
  }

  /**
   * Renders an image; returns its planes by channel.
   * @param {any} camera
   * @param {Record<string, any>} request
   * @param {boolean} [exact] one sample without light
   * @returns {Map<string, any>}
   */
  render(camera, request, exact = false) {
    const asked = exact ? { integrator: "flat", samples: 1, ambient_occlusion: false, ...request } : request;
    const frame = this.world.render(camera, JSON.stringify(asked));
    const [, , width, height] = frame.region;
    const planes = new Map();
    for (const name of request.channels) {
      const { dtype, components } = this.table.find((/** @type {any} */ row) => row.name === name);
      planes.set(name, { name, dtype, width, height, components, values: frame.plane(name) });
    }
    this.notices = frame.notices;
    frame.free();
    return planes;
  }

  /** One piece of work: a moving image, a channel, or more samples. @returns {Promise<boolean>} true if there may be more */
  async work() {
    if (!this.version || !this.cares) return false;
    if (this.moved !== this.version) this.showMoving();
    else if (performance.now() - this.touched < REST) return true;
    else if (!COLORS.includes(this.channel) && this.shown !== this.channel) await this.inBands({ channels: [this.channel] }, 1, true);
    else if (COLORS.includes(this.channel) && this.still && this.shown !== this.channel) this.show(this.still, this.samples, 0, false);
    else if (this.samples < this.target) await this.inBands({ channels: COLORS, integrator: this.integrator }, Math.min(this.samples * 4 || 4, this.target), false);
    else return false;
    return true;
  }

  showMoving() {
    const started = performance.now();
    const [width, height] = this.size;
    const divisor = [1, 2, 4].find((each) => (width * height * this.cost) / each ** 2 <= MOVING_TIME) || 4;
    const camera = this.given.resized(Math.max(1, Math.round(width / divisor)), Math.max(1, Math.round(height / divisor)));
    const lit = COLORS.includes(this.channel) ? (this.integrator === "flat" ? "flat" : "direct") : "flat";
    const planes = this.render(camera, { channels: [this.channel], integrator: lit, samples: 1, ambient_occlusion: false });
    const ms = performance.now() - started;
    const [w, h] = camera.size;
    this.cost += 0.4 * (ms / (w * h) - this.cost);
    this.moved = this.version;
    this.show(planes, 1, ms, true);
  }

  /**
   * An image in full size, rendered some rows at a time. Messages are handled between the rows. A message that
   * changes the view ends the image.
   * @param {Record<string, any>} request
   * @param {number} samples
   * @param {boolean} exact
   */
  async inBands(request, samples, exact) {
    const [version, channel, started] = [this.version, this.channel, performance.now()];
    const { camera } = this;
    const [width, height] = [...camera.size];
    const whole = new Map();
    let rows = 4;
    for (let top = 0; top < height; ) {
      const before = performance.now();
      const count = Math.min(rows, height - top);
      const planes = this.render(camera, { ...request, samples, region: [0, top, width, count] }, exact);
      for (const [name, plane] of planes) {
        if (!whole.has(name)) whole.set(name, { ...plane, height, values: new plane.values.constructor(width * height * plane.components) });
        whole.get(name).values.set(plane.values, top * width * plane.components);
      }
      top += count;
      const spent = Math.max(performance.now() - before, 1);
      rows = Math.max(1, Math.min(height, Math.round((count * BAND_TIME) / spent), 4 * rows));
      await nextTurn();
      const other = this.channel !== channel && (exact || !COLORS.includes(this.channel));
      if (this.version !== version || other) return;
    }
    const ms = performance.now() - started;
    if (exact) return this.show(whole, 1, ms, false);
    this.still = whole;
    this.samples = samples;
    this.say({ type: "about", ...this.described(this.notices || []) });
    if (COLORS.includes(this.channel)) this.show(whole, samples, ms, false);
  }

  /**
   * @param {Map<string, any>} planes
   * @param {number} samples
   * @param {number} ms
   * @param {boolean} moving
   */
  show(planes, samples, ms, moving) {
    const plane = planes.get(this.channel);
    if (!plane) return;
    if (!moving) this.shown = this.channel;
    const [width, height] = this.size;
    if (!this.sent.has(this.version)) this.sent = new Map(/** @type {[number, any][]} */ ([...this.sent, [this.version, this.camera]]).slice(-MAX_SENT));
    this.say({ type: "picture", version: this.version, image: this.version, camera: this.seq, channel: this.channel, plane, width, height, samples, wanted: COLORS.includes(this.channel) ? this.target : 0, integrator: this.integrator, ms, moving });
  }

  /** @param {import("../messages").Probe} message */
  probe({ id, image, u, v }) {
    const camera = this.sent.get(image);
    if (!camera) return; // the page repeats the request with the next image
    const planes = this.render(camera, { channels: this.truth, region: [u, v, 1, 1] }, true);
    /** @type {Record<string, any>} */
    const values = {};
    for (const name of COLORS) {
      const plane = image === this.version ? this.still?.get(name) : undefined;
      const at = plane ? (v * plane.width + u) * plane.components : 0;
      if (plane) values[name] = { dtype: plane.dtype, numbers: [...plane.values.subarray(at, at + plane.components)] };
    }
    for (const [name, plane] of planes) values[name] = { dtype: plane.dtype, numbers: [...plane.values] };
    values.instance.name = this.about.objects[values.instance.numbers[0]];
    if (values.category) values.category.name = this.about.categories[values.category.numbers[0]];
    this.say({ type: "values", id, u, v, values });
  }

  shownTriangles() {
    return (this.triangles ||= trianglesOf(this.world));
  }

  /** The triangles as they are in the middle of the exposure of a pixel's line. @param {any} camera @param {number} u @param {number} v */
  trianglesAt(camera, u, v) {
    if (!this.about.moves) return this.shownTriangles();
    const moved = this.world.atLine(camera, u, v);
    const triangles = trianglesOf(moved);
    moved.free();
    return triangles;
  }

  /** @param {import("../messages").Explain} message */
  explain({ image, u, v }) {
    const camera = this.sent.get(image);
    if (!camera) return this.say({ type: "error", text: "image: out of date; click again in the new image" });
    const triangles = this.trianglesAt(camera, u + camera.offset, v + camera.offset);
    try {
      const explained = explainPixel(camera, u, v, { names: this.about.objects, up: this.up, ...triangles });
      this.say({ type: "explained", column: u, row: v, ...explained });
    } catch (error) {
      this.say({ type: "notice", text: /** @type {Error} */ (error).message });
    }
  }

  copied() {
    const { K, R, C, size, offset } = this.given;
    const { model, coefficients, further } = JSON.parse(this.given.lensRay(0, 0));
    if (model === "parallel") further.push("parallel rays");
    if (further.length) this.say({ type: "notice", text: `Copied, but without parts that this page cannot write: ${further.join(", ")}. raycam view copies them.` });
    const lens = coefficients.length || !["pinhole", "parallel"].includes(model) ? `, distortion=[${coefficients.join(", ")}], model="${model}"` : "";
    const rows = (/** @type {Float64Array} */ m) => `[[${[0, 1, 2].map((i) => rowOf([...m], i).join(", ")).join("], [")}]]`;
    return `camera = raycam.Camera(${rows(K)}, ${rows(R)}, [${[...C].join(", ")}], (${[...size].join(", ")}), pixel_center="${offset ? "half" : "integer"}", up="${this.about.up}"${lens})`;
  }

  /** @param {string} format */
  snapshot(format) {
    if (format !== "png") return this.say({ type: "notice", text: "This page can save only PNG images; use raycam view to save pages and NPZ files." });
    const frame = this.world.render(this.camera, JSON.stringify({ channels: ["color"], integrator: this.integrator, samples: Math.max(this.samples, 1) }));
    const bytes = frame.png(this.exposure, this.view);
    frame.free();
    this.say({ type: "file", name: "raycam.png", media: "image/png", bytes });
  }
}

/** Corners, ids and colours of all triangles. @param {any} world */
const trianglesOf = (world) => ({ corners: world.triangles(), ids: world.triangleIds(), colors: world.triangleColors() });

/** Returns after waiting messages were handled. */
export function nextTurn() {
  return new Promise((resolve) => {
    const { port1, port2 } = new MessageChannel();
    port1.onmessage = () => {
      port1.close();
      resolve(undefined);
    };
    port2.postMessage(0);
  });
}
