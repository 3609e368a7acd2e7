// A world's text in the link of a playground, as deflated bytes in URL-safe base64.

import { bytesOfBase64, deflate, inflate } from "../image/planes.js";

export const LONGEST_LINK = 32 * 1024; // maximum characters of a link
const LONGEST_TEXT = 2 ** 20; // maximum bytes of a world in a link

/** Packs a world's text. @param {string} text @returns {Promise<string>} */
export async function linkOfText(text) {
  const packed = await deflate(new TextEncoder().encode(text));
  let binary = "";
  for (const byte of packed) binary += String.fromCharCode(byte);
  return btoa(binary).replace(/\+/g, "-").replace(/\//g, "_").replace(/=+$/, "");
}

/** Unpacks a link. Throws if the link or its text is too long. @param {string} link @returns {Promise<string>} */
export async function textOfLink(link) {
  if (link.length > LONGEST_LINK) throw new Error("too long");
  return new TextDecoder().decode(await inflate(bytesOfBase64(link.replace(/-/g, "+").replace(/_/g, "/").padEnd(Math.ceil(link.length / 4) * 4, "=")), LONGEST_TEXT));
}
