// The gizmo of the live view: finds the handle under the pointer, and sends drags of the handle to the server.

/** @typedef {import("./client.js").Client} Client */
/** @typedef {import("./pointer.js").Point} Point */

const HANDLE_REACH = 9; // distance in CSS pixels within which the pointer grabs a handle

export class Gizmo {
  /** @param {Client} client */
  constructor(client) {
    this.client = client;
    /** The handle that is being dragged; "" without a drag. */
    this.handle = "";
    this.stroke = 0;
    /** @type {number[]} where the drag began, in pixels of the image */
    this.begin = [0, 0];
  }

  /**
   * Begins to drag the handle under the pointer, if a handle is there.
   * @param {Point} at
   * @returns {boolean} true if a handle is there
   */
  grab(at) {
    this.handle = this.handleAt(at);
    if (this.handle) {
      this.stroke = Date.now();
      this.begin = this.place(at);
    }
    return this.handle !== "";
  }

  /** @param {Point} at */
  drag(at) {
    const handle = /** @type {import("./messages").Gizmo["handle"]} */ (this.handle);
    this.client.transport.send({ type: "gizmo", handle, stroke: this.stroke, begin: this.begin, end: this.place(at) });
  }

  /**
   * @param {Point} at
   * @returns {string} the nearest handle within reach, or ""
   */
  handleAt(at) {
    const { picture } = this.client;
    let [found, nearest] = ["", HANDLE_REACH];
    for (const { handle, lines } of picture.layers.overlay) {
      if (!handle) continue;
      for (const line of lines) {
        for (let i = 1; i < line.length; i++) {
          const [a, b] = [line[i - 1], line[i]].map(([u, v]) => ({ x: picture.left + u * picture.zoom, y: picture.top + v * picture.zoom }));
          const distance = toSegment(at, a, b);
          if (distance < nearest) [found, nearest] = [handle, distance];
        }
      }
    }
    return found;
  }

  /**
   * @param {Point} at
   * @returns {number[]} the position in pixels of the image
   */
  place({ x, y }) {
    const { picture } = this.client;
    return [(x - picture.left) / picture.zoom, (y - picture.top) / picture.zoom].map((value) => Math.min(Math.max(value, -1e4), 1e4));
  }
}

/**
 * The distance from a point to a segment.
 * @param {Point} p
 * @param {Point} a
 * @param {Point} b
 * @returns {number}
 */
function toSegment(p, a, b) {
  const [dx, dy] = [b.x - a.x, b.y - a.y];
  const share = Math.min(Math.max(((p.x - a.x) * dx + (p.y - a.y) * dy) / (dx * dx + dy * dy || 1), 0), 1);
  return Math.hypot(p.x - a.x - share * dx, p.y - a.y - share * dy);
}
