// The shown image, and the held pixel when the next image has another size or another camera.

/** @typedef {{ width: number, height: number }} Size */
/** @typedef {Size & { image: number, camera: number, moving: boolean }} Image the message `picture` */

export class ShownImage {
  /** @param {import("./client.js").Client} client */
  constructor(client) {
    this.client = client;
    /** The number of the image that is shown, which clicks specify; 0 before the first image. */
    this.number = 0;
    /** The number of the image's camera. */
    this.camera = 0;
    /** The camera of the image that was shown when the user moved the camera; null if the image is up to date. @type {number | null} */
    this.movedFrom = null;
  }

  /** Called when the user moves the camera: until the new image arrives, the user clicks on an outdated image. */
  outdate() {
    this.movedFrom = this.camera;
  }

  /**
   * Shows the next image. A pixel that was clicked in an outdated image is released, because the new image shows another
   * point there. If only the size changes, the held pixel moves to the same point, and is released if this point is
   * outside.
   * @param {Image} next
   */
  replace({ image, camera, moving, width, height }) {
    const { client, client: { picture, held }, movedFrom } = this;
    const isReleased = held !== null && movedFrom !== null && camera !== this.camera;
    if (!moving && camera !== movedFrom) this.movedFrom = null;
    this.number = image;
    this.camera = camera;
    if (isReleased) client.hold(null);
    if (width === picture.width && height === picture.height) return;
    const isInside = held !== null && !isReleased && moveWithImage(held, picture, { width, height });
    picture.setSize(width, height);
    if (isInside) client.onHold(held);
    else if (held && !isReleased) client.hold(null);
  }
}

/**
 * Moves a pixel to the same point in an image of another size. The middle of the image and the vertical field of view
 * stay the same (`View.with_space`). If the camera also moves to frame the world in the new shape, the pixel's point is
 * only near the old point.
 * @param {import("./picture.js").Pixel} pixel is changed
 * @param {Size} before
 * @param {Size} after
 * @returns {boolean} false if the point is outside the image
 */
function moveWithImage(pixel, before, after) {
  const scale = after.height / before.height;
  pixel.column = Math.floor((pixel.column + 0.5 - before.width / 2) * scale + after.width / 2);
  pixel.row = Math.floor((pixel.row + 0.5) * scale);
  return pixel.column >= 0 && pixel.column < after.width && pixel.row < after.height;
}
