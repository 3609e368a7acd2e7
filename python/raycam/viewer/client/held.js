// The held pixel in images of different sizes.

/** @typedef {{ width: number, height: number }} Size */

/**
 * Shows images of another size. The held pixel moves to the same point of the new image, and is released if this point
 * is outside.
 * @param {import("./client.js").Client} client
 * @param {Size} size
 */
export function showSize(client, size) {
  const { picture, held } = client;
  if (size.width === picture.width && size.height === picture.height) return;
  const isInside = held !== null && moveWithImage(held, picture, size);
  picture.setSize(size.width, size.height);
  if (isInside) client.onHold(held);
  else if (held) client.hold(null);
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
