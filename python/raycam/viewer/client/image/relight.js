// Relighting: computes the colour of a frame for other strengths of the lights, from each light's part of the colour.

/** @typedef {import("./planes.js").Plane} Plane */

/** Start of the names of channels that contain the light of one source. */
export const LIGHT_PREFIX = "light:";

/**
 * The colour with each light multiplied by a factor. Light is additive, so lights without a part are unchanged.
 * @param {Plane} color
 * @param {[part: Plane, factor: number][]} lights parts of the colour
 * @returns {Plane}
 */
export function relitColor(color, lights) {
  const values = Float32Array.from(color.values);
  for (const [part, factor] of lights) {
    if (factor === 1) continue;
    for (let i = 0; i < values.length; i++) values[i] += (factor - 1) * part.values[i];
  }
  // The subtraction of a light leaves rounding errors, which may be negative.
  if (lights.some(([, factor]) => factor < 1)) for (let i = 0; i < values.length; i++) values[i] = Math.max(values[i], 0);
  return { ...color, values };
}
