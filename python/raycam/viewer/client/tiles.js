// Exact values of the pixels that are drawn large enough to show their values. The values are requested in tiles.

/** @typedef {import("./image/planes.js").Plane} Plane */
/** @typedef {import("./client.js").Client} Client */

const TILE_PAUSE = 80; // milliseconds after the last move of the image until numbers are requested
const TILE_SIDE = 256; // side of a tile in pixels, the largest that the server accepts

export class Tiles {
  /** @param {Client} client */
  constructor(client) {
    this.client = client;
    this.count = 0;
    this.timer = 0;
    /** @type {{ channel: string, u: number, v: number, plane: Plane } | null} */
    this.tile = null;
  }

  /** Discards the numbers, because the image has changed. */
  forget() {
    this.tile = null;
  }

  /** Requests the numbers of the visible pixels as soon as the image is no longer moved. */
  request() {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => {
      const [u, v, right, bottom] = this.client.picture.visible();
      const [width, height] = [Math.min(right - u, TILE_SIDE), Math.min(bottom - v, TILE_SIDE)];
      if (width > 0 && height > 0) this.client.transport.send({ type: "tile", id: ++this.count, image: this.client.shown.number, u, v, width, height });
    }, TILE_PAUSE);
  }

  /** @param {import("./client.js").Message} message */
  receive({ id, channel, u, v, plane }) {
    if (id === this.count) this.tile = { channel, u, v, plane };
    this.client.picture.redraw();
  }

  /**
   * The numbers of a pixel, or nothing if they have not arrived.
   * @param {string} channel @param {number} column @param {number} row
   * @returns {{ numbers: number[], dtype: string } | null}
   */
  at(channel, column, row) {
    const { tile } = this;
    if (!tile || tile.channel !== channel) return null;
    const { plane } = tile;
    const [x, y] = [column - tile.u, row - tile.v];
    if (x < 0 || y < 0 || x >= plane.width || y >= plane.height) return null;
    const start = (y * plane.width + x) * plane.components;
    return { numbers: [...plane.values.subarray(start, start + plane.components)], dtype: plane.dtype };
  }
}
