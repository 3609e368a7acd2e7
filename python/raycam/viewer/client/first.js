// The first image of the live view. It is drawn before the client's script is loaded, which then draws it again.

import { splitMessage } from "./transport/connection.js";

/**
 * Waits for the first image and draws it on the canvas, as the client does.
 * @param {WebSocket} socket
 * @param {HTMLCanvasElement} canvas
 * @returns {Promise<void>} resolved when the image is painted
 */
export function drawFirstImage(socket, canvas) {
  return new Promise((resolve) => {
    socket.addEventListener("message", async function draw({ data }) {
      const { message, buffers } = splitMessage(data);
      if (message.type !== "picture") return;
      socket.removeEventListener("message", draw);
      if (message.encoding === "jpeg") {
        const image = await createImageBitmap(new Blob([buffers[0]], { type: "image/jpeg" }));
        requestAnimationFrame(() => {
          drawFitted(canvas, image, message.width, message.height);
          setTimeout(resolve);
        });
      } else resolve();
    });
  });
}

/**
 * Draws an image so that all of it is visible.
 * @param {HTMLCanvasElement} canvas
 * @param {ImageBitmap} image
 * @param {number} width of the finished image, which has the same shape
 * @param {number} height
 */
function drawFitted(canvas, image, width, height) {
  const ratio = devicePixelRatio || 1;
  const space = canvas.getBoundingClientRect();
  canvas.width = Math.max(1, Math.round(space.width * ratio));
  canvas.height = Math.max(1, Math.round(space.height * ratio));
  const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d", { alpha: false }));
  const zoom = Math.min(space.width / width, space.height / height) * ratio;
  const [left, top] = [(canvas.width - zoom * width) / 2, (canvas.height - zoom * height) / 2];
  context.fillStyle = getComputedStyle(canvas).backgroundColor;
  context.fillRect(0, 0, canvas.width, canvas.height);
  context.imageSmoothingQuality = "high";
  context.drawImage(image, Math.round(left), Math.round(top), zoom * width, zoom * height);
}
