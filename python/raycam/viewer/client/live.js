// The live view: navigation, cameras, light and snapshots, as commands and mouse actions of a client.

import { byId, fillSelect } from "./dom.js";
import { Flying } from "./flying.js";
import { grouped } from "./image/numbers.js";
import { Gizmo } from "./gizmo.js";
import { spaceOf } from "./layout.js";
import { DOLLY_STEP, Navigator } from "./navigator.js";
import { showAbout } from "./panel/about.js";
import { LensControls } from "./panel/lens.js";
import { Axes } from "./panel/axes.js";
import { CameraControls } from "./panel/cameras.js";
import { FollowingControls } from "./panel/following.js";
import { Hint } from "./panel/hint.js";
import { FramingControls } from "./panel/framing.js";
import { LookControls } from "./panel/look.js";
import { Resets } from "./panel/resets.js";
import { Measure } from "./panel/measure.js";
import { Panes } from "./panel/panes.js";
import { ViewLink } from "./panel/view_link.js";
import { PhotographControls } from "./panel/photograph.js";
import { PoseControls } from "./panel/pose.js";
import { ProgressBar } from "./panel/progress.js";
import { ScanControls } from "./panel/scan.js";
import { ScriptControls } from "./panel/script.js";
import { StatusLine } from "./panel/status.js";
import { Timeline } from "./panel/timeline.js";
import { WorldControls } from "./panel/world.js";

/** @typedef {import("./client.js").Client} Client */
/** @typedef {import("./pointer.js").Point} Point */

export const LIVE_MOUSE =
  "Drag to orbit; Shift and drag, or drag with the right button, to pan. The wheel moves the camera towards the point " +
  "under the cursor; Ctrl and wheel magnify the pixels. Double-click to set the pivot of the orbit. Click to hold a " +
  "pixel; Alt and click, or a long press, to explain it. On a touch screen, use two fingers to move closer and to pan.";

const ORBIT_STEP = 14; // pixels of the drag that an arrow key replaces: 5 degrees
const PAN_PIXELS = 24; // image pixels by which an arrow key pans
const LONGEST_FILM = 60; // maximum duration of a video in seconds
export class LiveView {
  /** @param {Client} client */
  constructor(client) {
    this.client = client;
    this.following = new FollowingControls(client, (camera) => this.resume(camera));
    this.timeline = new Timeline(client);
    this.following.onTime = (time) => this.timeline.show(time);
    this.lens = new LensControls(client);
    this.pose = new PoseControls(client);
    this.photograph = new PhotographControls(client);
    this.gizmo = new Gizmo(client);
    /** Types of the files that the server opens; null if it opens none. @type {import("./files.js").FileTypes | null} */
    this.opens = null;
    this.world = new WorldControls(client);
    this.scan = new ScanControls(client);
    this.world.lookThrough = (name) => this.lookThrough(name);
    this.look = new LookControls(client);
    this.resets = new Resets();
    this.measure = new Measure(client);
    this.kept = new CameraControls(client);
    this.panes = new Panes(client, (name) => this.lookThrough(name));
    this.script = new ScriptControls((id, value) => client.transport.send({ type: "control", id, value }));
    this.axes = new Axes((side) => this.viewFrom(side), (axis) => client.transport.send({ type: "up", axis }));
    this.navigator = new Navigator((message) => client.transport.send(message), () => client.shown.number);
    this.navigator.onMove = () => this.moved();
    this.navigator.onCamera = (camera) => this.axes.show(camera);
    this.flying = new Flying(this.navigator);
    this.framing = new FramingControls(client, this.navigator, () => this.moved());
    this.status = new StatusLine();
    this.link = new ViewLink(this);
    this.hint = new Hint(client.picture.canvas);
    this.bar = new ProgressBar();
    /** @type {string[]} */
    this.cameras = [];
    /** The held pixel whose object was selected. @type {import("./picture.js").Pixel | null} */
    this.selectedBy = null;
    /** The camera that was selected last. */
    this.looked = "";
    this.camera = byId("camera", HTMLSelectElement);
    this.integrator = byId("integrator", HTMLSelectElement);
    fillSelect(this.integrator, [["direct", "direct"], ["path", "path: all light"]]);
    this.camera.addEventListener("change", () => this.lookThrough(this.camera.value));
    this.integrator.addEventListener("change", () => this.setIntegrator(this.integrator.value));
    for (const format of /** @type {const} */ (["png", "html", "npz"])) {
      byId(`snapshot-${format}`, HTMLButtonElement).addEventListener("click", () => client.transport.send({ type: "snapshot", format }));
    }
    for (const format of /** @type {const} */ (["python", "toml", "command", "opencv", "colmap"])) {
      byId(`copy-${format}`, HTMLButtonElement).addEventListener("click", () => client.transport.send({ type: "copy", format }));
    }
    byId("copy-link", HTMLButtonElement).addEventListener("click", () => this.link.copy());
    byId("film", HTMLButtonElement).addEventListener("click", () => client.transport.send({ type: "film", seconds: 4, degrees: 360 }));
    byId("film-time", HTMLButtonElement).addEventListener("click", () => {
      client.transport.send({ type: "film", seconds: Math.min(Math.max(this.timeline.seconds, 0.1), LONGEST_FILM), degrees: 0 });
    });
    byId("film-stop", HTMLButtonElement).addEventListener("click", () => client.transport.send({ type: "stop" }));
    document.addEventListener("visibilitychange", () => client.transport.send({ type: "visible", visible: !document.hidden }));
    new ResizeObserver(() => this.resized()).observe(client.picture.canvas);
    client.picture.onRatio = () => this.resized();
  }

  /**
   * Executes the part of a message that only concerns the live view.
   * @param {import("./client.js").Message} message
   */
  receive(message) {
    this.following.receive(message);
    if (message.type === "welcome") {
      this.cameras = message.cameras;
      fillSelect(this.camera, [["", "free camera"], ...message.cameras.map((/** @type {string} */ name) => [name, name])]);
      this.integrator.value = message.integrator;
      this.timeline.welcome(message);
      this.opens = message.opens || null;
      this.photograph.begin(message.photographs || []);
    }
    this.scan.receive(message);
    if (message.type === "following") this.panes.follow(message.attached);
    if (message.type === "pane") {
      this.panes.receive(message);
      this.status.showCameras(this.panes.panes.length);
    }
    if (message.type === "photograph") this.photograph.receive(message);
    if (message.type === "welcome") {
      this.resume(message.camera);
      this.begin(message);
      if (message.look) this.look.show(message.look);
      if (!message.resumed) this.resets.forget();
      this.panes.begin(message.cameras);
      this.world.tree.show({ cameras: message.cameras });
    }
    if (message.type === "look") {
      this.look.show(message.look);
      if (message.exposure !== this.client.controls.display.exposure) this.client.controls.setExposure(message.exposure);
      this.integrator.value = message.integrator;
      byId("variant", HTMLSelectElement).value = message.variant;
      showAbout(/** @type {any} */ (message));
    }
    if (message.type === "selected") this.world.showSelected(message);
    if (message.type === "thumbnails") this.world.material.textures.receive(message);
    if (message.type === "camera") {
      this.navigator.receive(/** @type {any} */ (message));
      this.showCamera(message);
    }
    if (message.type === "answer") this.navigator.answer(/** @type {any} */ (message));
    if (message.type === "picture") {
      this.status.show(message);
      this.hint.show();
      this.bar.show(message.moving ? 0 : message.samples, message.wanted || 0);
      this.timeline.next();
      if (!message.moving && message.channel === this.client.channel) this.link.holdPixel();
    }
    if (message.type === "progress") this.bar.show(message.samples, message.wanted);
    if (message.type === "welcome" || message.type === "picture") this.status.await(message.type === "welcome" || Boolean(message.moving));
    if (message.type === "picture" || message.type === "overlay") this.client.picture.show({ overlay: message.overlay ?? [] });
    if (message.type === "values" && this.client.held) {
      const isMeasuring = this.measure.isActive;
      this.measure.receive(message);
      const { held } = this.client;
      const isNew = held !== this.selectedBy && message.u === held.column && message.v === held.row;
      // Only once, because another object may have been selected in the meantime.
      if (isNew && !isMeasuring && this.world.pick(message.values.instance?.numbers[0], message.values.material?.slot)) this.world.reveal();
      if (isNew) this.selectedBy = held;
    }
    if (message.type === "controls") this.script.show(message.controls);
    if (message.type === "contents") {
      this.world.show(message);
      this.look.nameLights(message.counts[1] > 0);
    }
    if (message.type === "history") this.world.showHistory(message);
    if (message.type === "copied") this.copied(message.text);
    if (message.type === "filming") this.showFilming(message);
    if (message.type === "status") byId("status-connection", HTMLElement).textContent = message.text;
    if (message.type === "status" && message.text !== "connected") {
      this.showFilming({ done: 0, total: 0 });
      this.status.await(false);
    }
    if (["selected", "contents", "camera"].includes(message.type)) this.resets.refresh();
    if (message.type === "closing") this.client.say(message.text, "error");
  }

  /** @param {any} camera the server's camera, at the start and after moves that were not sent */
  resume(camera) {
    this.navigator.welcome(camera);
    this.showCamera(camera);
  }

  /** @param {any} camera as the message `camera` describes it; its name is out of date if a newer move is on its way */
  showCamera({ seq, name, lens, pose }) {
    if (seq >= this.navigator.seq) {
      this.camera.value = name;
      this.kept.show(name);
      this.photograph.showFor(name);
      this.looked = name || this.looked;
    }
    if (lens) {
      this.lens.show((this.link.lens = lens), name);
      this.framing.show(lens);
    }
    if (pose) this.pose.show(pose);
  }

  /**
   * After a welcome: sends this page's settings to the server's session, and adopts the session's state.
   * @param {import("./client.js").Message} welcome
   */
  begin({ overlay, names, triangles }) {
    this.client.transport.send({ type: "visible", visible: !document.hidden });
    this.world.begin(overlay, JSON.stringify(names?.instance));
    this.link.follow();
    const count = triangles === undefined ? "" : `${grouped(triangles)} ${triangles === 1 ? "triangle" : "triangles"}`;
    byId("status-world", HTMLElement).textContent = count;
  }

  /** @param {Record<string, any>} progress of the video; 0 of 0 at its end */
  showFilming({ done, total }) {
    const stop = byId("film-stop", HTMLButtonElement);
    stop.hidden = !total;
    stop.textContent = `Stop the video: frame ${done} of ${total}`;
    for (const id of ["film", "film-time"]) byId(id, HTMLButtonElement).disabled = total > 0;
  }

  /** @param {string} text */
  async copied(text) {
    try {
      await navigator.clipboard.writeText(text);
      this.client.say("Copied to the clipboard.", "notice", true);
    } catch {
      this.client.say(text, "notice", true);
    }
  }

  resized() {
    clearTimeout(this.resizing);
    this.resizing = setTimeout(() => this.client.transport.send({ type: "size", ...this.size() }), 150);
  }

  /** @returns {{ width: number, height: number, ratio: number }} the space for the image */
  size() {
    return spaceOf(this.client.picture.canvas);
  }

  /**
   * A point of the canvas in pixels of the image, its middle if no point is given.
   * @param {Point} [at]
   * @returns {[number, number]}
   */
  pixel(at) {
    const { picture } = this.client;
    if (!at) return [picture.width / 2, picture.height / 2];
    const limited = (/** @type {number} */ value) => Math.min(Math.max(value || 0, -1e4), 1e4);
    return [limited((at.x - picture.left) / picture.zoom), limited((at.y - picture.top) / picture.zoom)];
  }

  /** Called after each move: the camera is no longer a camera of the world, and the held pixel shows another point. */
  moved() {
    this.camera.value = "";
    this.kept.show("");
    this.photograph.showFor("");
    this.framing.forget();
    this.measure.forget();
    this.client.shown.outdate();
    if (this.client.held) this.client.hold(null);
  }

  /** Views the whole world from a side. @param {string} name */
  viewFrom(name) {
    this.client.picture.fit();
    this.moved();
    this.client.transport.send({ type: "side", seq: ++this.navigator.seq, name: /** @type {any} */ (name) });
  }

  /** Looks through a camera, and shows only its image. @param {string} name */
  lookThrough(name) {
    if (this.panes.panes.length) this.panes.show([]);
    this.camera.value = name;
    this.looked = name || this.looked;
    this.client.shown.outdate();
    this.navigator.lookThrough(name);
  }

  /** @param {string} name */
  setIntegrator(name) {
    this.integrator.value = name;
    this.client.transport.send({ type: "quality", integrator: name === "path" ? "path" : "direct" });
  }

  /** @param {number} step */
  stepCamera(step) {
    if (!this.cameras.length) return this.client.say("This world has no cameras.", "notice");
    const at = this.cameras.indexOf(this.camera.value);
    this.lookThrough(this.cameras[(Math.max(at, step < 0 ? 0 : -1) + step + this.cameras.length) % this.cameras.length]);
  }

  /** @returns {Record<string, (...words: string[]) => void>} */
  commands() {
    const { client } = this;
    /** @param {(...words: string[]) => void} act @returns {(...words: string[]) => void} */
    const moving = (act) => (...words) => {
      if (!this.panes.ignoresMoves) act(...words);
    };
    return {
      fit: moving(() => {
        const { held, picture } = client;
        picture.fit();
        if (held) this.navigator.frame(held.column + 0.5, held.row + 0.5);
        else this.navigator.fit();
      }),
      home: moving(() => {
        client.picture.fit();
        client.shown.outdate();
        this.navigator.home();
      }),
      step: moving((dx, dy) => {
        const { held, picture } = client;
        if (!held) return this.flying.turn(ORBIT_STEP * Number(dx), ORBIT_STEP * Number(dy));
        const column = Math.min(Math.max(held.column + Number(dx), 0), picture.width - 1);
        client.hold({ column, row: Math.min(Math.max(held.row + Number(dy), 0), picture.height - 1) });
      }),
      "look-through-camera": (...words) => this.lookThrough(words.join(" ")),
      side: moving((name) => this.viewFrom(name)),
      "next-scan": () => this.scan.next(),
      "camera-step": moving((step) => this.stepCamera(Number(step))),
      "look-through": moving(() => {
        if (this.camera.value) this.lookThrough("");
        else if (this.cameras.includes(this.looked)) this.lookThrough(this.looked);
        else this.stepCamera(1);
      }),
      pan: moving((dx, dy) => this.navigator.pan(-PAN_PIXELS * Number(dx), -PAN_PIXELS * Number(dy))),
      nearer: moving((steps) => this.navigator.dolly(Number(steps), ...this.pixel())),
      integrator: () => this.setIntegrator(this.integrator.value === "direct" ? "path" : "direct"),
      tool: (name) => this.world.setTool(name),
      undo: () => client.transport.send({ type: "undo" }),
      redo: () => client.transport.send({ type: "redo" }),
      panes: () => this.panes.toggle(),
      measure: () => this.measure.toggle(),
      "copy-link": () => this.link.copy(),
      play: () => this.timeline.play(!this.timeline.playing),
      frame: (steps) => this.timeline.step(Number(steps)),
      drive: () => client.say(this.flying.nextWay(), "notice"),
    };
  }

  /** @returns {Partial<import("./pointer.js").PointerListener>} */
  pointers() {
    const { client, client: { picture } } = this;
    return {
      grabs: (at) => this.gizmo.grab(at) || client.grabsDivider(at),
      dragGrabbed: (at) => (this.gizmo.handle ? this.gizmo.drag(at) : client.divideAt(at)),
      drag: (_, dx, dy, pans) => {
        if (pans) this.navigator.pan(dx / picture.zoom, dy / picture.zoom);
        else this.flying.turn(dx, dy);
      },
      wheel: (at, steps, magnifies) => {
        if (magnifies) picture.zoomAt(1.25 ** steps, at.x, at.y);
        else if (this.flying.way === "orbit") this.navigator.dolly(steps, ...this.pixel(at));
        else client.say(this.flying.changeSpeed(steps), "notice");
      },
      pinch: (at, factor, dx, dy) => {
        this.navigator.dolly(Math.log(factor) / Math.log(DOLLY_STEP), ...this.pixel(at));
        this.navigator.pan(dx / picture.zoom, dy / picture.zoom);
      },
      doubleClick: (at) => this.navigator.setPivot(...this.pixel(at)),
    };
  }
}
