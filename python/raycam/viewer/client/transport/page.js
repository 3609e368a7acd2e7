// The transport of a saved page: answers the client's messages with the arrays in the page.

import { bytesOfBase64, unpackPlane } from "../image/planes.js";
import { LIGHT_PREFIX, relitColor } from "../image/relight.js";

/** @typedef {import("../image/planes.js").Plane} Plane */
/** @typedef {import("../image/planes.js").PlaneHeader} PlaneHeader */
/** @typedef {Record<string, any> & { type: string }} Message */

export class PageTransport {
  constructor() {
    this.live = false;
    this.document = JSON.parse(document.getElementById("document")?.textContent || "null");
    /** @type {Map<string, Promise<Plane>>} */
    this.planes = new Map();
    /** @type {Map<string, Plane>} */
    this.unpacked = new Map();
    /** @type {Map<string, number>} factors of lights by channel; the default is 1 */
    this.factors = new Map();
  }

  /** @returns {boolean} true if this page contains a frame */
  get isThere() {
    return this.document !== null;
  }

  /**
   * Opens the transport, which then passes messages to the client.
   * @param {(message: Message) => void} say
   */
  open(say) {
    this.say = say;
    say({ type: "welcome", ...this.document });
    this.unpackAll();
  }

  /** Unpacks the channels one after the other, after the channel that is shown. */
  async unpackAll() {
    await new Promise((resolve) => setTimeout(resolve, 50));
    for (const { key, name } of this.document.planes) await this.plane(key).catch((error) => this.sayDamaged(name, error));
    this.say?.({ type: "unpacked" });
  }

  /**
   * @param {string} key
   * @returns {Promise<Plane>}
   */
  plane(key) {
    let plane = this.planes.get(key);
    if (!plane) {
      const number = this.document.planes.findIndex((/** @type {any} */ each) => each.key === key);
      const text = document.getElementById(`plane-${number}`)?.textContent || "";
      plane = unpackPlane(this.document.planes[number], bytesOfBase64(text));
      plane.then((unpacked) => this.unpacked.set(key, unpacked), () => {}); // the caller of plane() gets the error
      this.planes.set(key, plane);
    }
    return plane;
  }

  /** @returns {string[]} the channels of lights by whose parts the frame's colour can be changed */
  lightChannels() {
    const form = (/** @type {string} */ key) => {
      const plane = this.document.planes.find((/** @type {any} */ each) => each.key === key);
      return plane && plane.components === 3 ? `${plane.width} ${plane.height}` : "";
    };
    const color = form("a-color");
    const names = this.document.channels.map((/** @type {any} */ each) => each.name);
    return color ? names.filter((/** @type {string} */ name) => name.startsWith(LIGHT_PREFIX) && form(`a-${name}`) === color) : [];
  }

  /** Changes the brightness of lights in the frame's colour. @param {Map<string, number>} factors by channel */
  relight(factors) {
    this.factors = factors;
  }

  /** @returns {Promise<Plane>} the frame's colour with the factors of its lights */
  async relitPlane() {
    const color = await this.plane("a-color");
    /** @type {[Plane, number][]} */
    const lights = [];
    for (const [name, factor] of this.factors) if (factor !== 1) lights.push([await this.plane(`a-${name}`), factor]);
    const relit = lights.length ? relitColor(color, lights) : color;
    this.unpacked.set("a-color", relit); // the readout shows the values of this plane
    return relit;
  }

  /**
   * @param {string} slot "a" or "b"
   * @param {string} name
   * @returns {string | null} the key of a plane
   */
  keyOf(slot, name) {
    const key = `${slot}-${name}`;
    return this.document.planes.some((/** @type {any} */ each) => each.key === key) ? key : null;
  }

  /** @param {import("../messages").ClientMessage} message */
  send(message) {
    if (message.type === "channel") this.sendPicture(message.name);
    if (message.type === "probe") this.sendValues(message);
    if (message.type === "explain") this.sendExplanation(message);
  }

  /** @param {string} name */
  async sendPicture(name) {
    const [keyA, keyB] = [this.keyOf("a", name), this.keyOf("b", name)];
    if (!keyA) return;
    try {
      const plane = name === "color" && this.factors.size ? await this.relitPlane() : await this.plane(keyA);
      const other = keyB ? await this.plane(keyB) : null;
      this.say?.({ type: "picture", channel: name, plane, other, width: plane.width, height: plane.height, image: 1, camera: 1, moving: false });
    } catch (error) {
      this.sayDamaged(name, error);
    }
  }

  /** @param {string} name @param {unknown} error */
  sayDamaged(name, error) {
    this.say?.({ type: "error", text: `The channel ${name} of this page is damaged: ${error}` });
  }

  /** @param {import("../messages").Probe} message */
  sendValues({ id, u, v }) {
    /** @type {import("../panel/readout.js").PixelValues} */
    const values = {};
    for (const { name } of this.document.channels) {
      const plane = this.unpacked.get(`a-${name}`);
      const numbers = plane && numbersAt(plane, u, v);
      if (!numbers) continue;
      const other = this.unpacked.get(`b-${name}`);
      values[name] = {
        dtype: plane.dtype,
        numbers,
        name: this.document.names[name]?.[numbers[0]],
        other: other && { dtype: other.dtype, numbers: numbersAt(other, u, v) },
      };
    }
    this.say?.({ type: "values", id, u, v, values });
  }

  /** @param {import("../messages").Explain} message */
  sendExplanation({ u, v }) {
    const found = this.document.explanations.find((/** @type {any} */ each) => each.column === u && each.row === v);
    const [x, y] = this.document.origin;
    if (found) this.say?.({ type: "explained", ...found, column: found.column + x, row: found.row + y });
    else {
      const text = this.document.explanations.length
        ? "This page explains only the marked pixels."
        : "This page contains no explanations; save it with world=... and explain=[(column, row)].";
      this.say?.({ type: "notice", text });
    }
  }
}

/**
 * @param {Plane} plane
 * @param {number} column
 * @param {number} row
 * @returns {number[]}
 */
function numbersAt({ values, components, width }, column, row) {
  const at = (row * width + column) * components;
  return Array.from(values.subarray(at, at + components));
}
