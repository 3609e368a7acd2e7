// Decodes the messages of a server or kernel for the client.

import { unpackPlane } from "../image/planes.js";

/** @typedef {Record<string, any> & { type: string }} Message */

/**
 * Puts the buffers of a message in their places: images, planes, files.
 * @param {Message} message
 * @param {Uint8Array<ArrayBuffer>[]} buffers
 * @returns {Promise<Message>}
 */
export async function completed(message, buffers) {
  if (message.type === "values") revive(message.values);
  if (message.type === "file") message.bytes = buffers[0];
  if (message.type === "tile") message.plane = await unpackPlane(message.plane, buffers[0]);
  if (!["picture", "pane", "photograph"].includes(message.type)) return message;
  if (message.encoding === "jpeg" || message.type === "photograph") message.bitmap = await createImageBitmap(new Blob([buffers[0]], { type: "image/jpeg" }));
  else message.plane = await unpackPlane(message.plane, buffers[0]);
  return message;
}

/**
 * Turns texts into numbers: JSON has no infinities and no NaN, so they arrive as text.
 * @param {import("../panel/readout.js").PixelValues} values
 */
function revive(values) {
  for (const value of Object.values(values)) value.numbers = value.numbers.map(Number);
}
