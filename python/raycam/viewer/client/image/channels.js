// Channels: the conversion of each channel's numbers to colours, and the legend that explains the colours.

/** @typedef {import("./planes.js").Plane} Plane */
/** @typedef {"light" | "scalar" | "share" | "ids" | "direction" | "weights" | "place" | "flow"} ChannelKind */
/**
 * @typedef {object} ChannelStyle
 * @property {ChannelKind} kind
 * @property {number} [of] numbers per pixel (default: 1)
 * @property {string} [unit]
 * @property {boolean} [zeroIsMiss] a zero vector is the background
 * @property {boolean} [log]
 */

/** @type {Record<string, ChannelStyle>} */
const STYLES = {
  color: { kind: "light", of: 3 },
  albedo: { kind: "light", of: 3 },
  depth: { kind: "scalar", unit: "m" },
  distance: { kind: "scalar", unit: "m" },
  position: { kind: "place", of: 3, unit: "m" },
  normal: { kind: "direction", of: 3, zeroIsMiss: true },
  normal_camera: { kind: "direction", of: 3, zeroIsMiss: true },
  shading_normal: { kind: "direction", of: 3, zeroIsMiss: true },
  shading_normal_camera: { kind: "direction", of: 3, zeroIsMiss: true },
  instance: { kind: "ids" },
  category: { kind: "ids" },
  triangle: { kind: "ids" },
  material: { kind: "ids" },
  barycentric: { kind: "weights", of: 3, zeroIsMiss: true },
  uv: { kind: "weights", of: 2 },
  coverage: { kind: "share" },
  alpha: { kind: "share" },
  shadow: { kind: "light", of: 3 },
  transmittance: { kind: "light", of: 3 },
  emission: { kind: "light", of: 3 },
  direct: { kind: "light", of: 3 },
  indirect: { kind: "light", of: 3 },
  diffuse: { kind: "light", of: 3 },
  specular: { kind: "light", of: 3 },
  volume: { kind: "light", of: 3 },
  roughness: { kind: "share" },
  metallic: { kind: "share" },
  projector_uv: { kind: "place", of: 2, unit: "pixels" },
  nocs: { kind: "weights", of: 3 },
  error: { kind: "scalar" },
  flow: { kind: "flow", of: 2, unit: "pixels" },
};

/**
 * The style of a channel. An array with an unknown name gets the style that fits its type.
 * @param {{ name: string, dtype: string, components: number }} channel
 * @returns {ChannelStyle}
 */
export function styleOf({ name, dtype, components }) {
  const known = Object.hasOwn(STYLES, name) ? STYLES[name] : null;
  if (known && (known.of || 1) === components && (known.kind === "ids") === (dtype === "int32")) return known;
  if (dtype === "int32" && components === 1) return { kind: "ids" };
  // The channel contains the light of one source, or is a layer of another program's EXR file.
  if (/^light:|\.rgb$/i.test(name) && components === 3) return { kind: "light" };
  return components === 2 ? { kind: "flow", of: 2 } : components === 3 ? { kind: "place", of: 3 } : { kind: "scalar" };
}

/** The unit of a channel's values; "" for values without a unit. @param {string} name @returns {string} */
export function unitOf(name) {
  return (Object.hasOwn(STYLES, name) && STYLES[name].unit) || "";
}

/**
 * The sentence that explains the colours of a channel.
 * @param {ChannelStyle} style
 * @param {number} components
 * @returns {string}
 */
export function howToRead({ kind, unit }, components) {
  const inUnit = unit ? ` in ${unit}` : "";
  const sentences = {
    light: "Linear Rec. 709 radiance, shown as sRGB.",
    scalar: `${components > 1 ? `The first of ${components} values` : `Values${inUnit}`} by the colour map below; pixels without a value are hatched.`,
    share: "A fraction: 0 is black, 1 is white.",
    ids: "One colour for each id; pixels without an id (-1) are hatched.",
    direction: "Unit vectors: red is x, green is y, blue is z; from -1 (dark) to 1 (bright).",
    weights:
      components === 2
        ? "Red is u, green is v; both start again at black at each whole number."
        : "Weights of the three corners: red, green, blue.",
    place: `Red is x, green is y, blue is z${inUnit}; each from its lowest (dark) to its highest value.`,
    flow: `Motion${inUnit}: the hue is its direction, and a stronger colour means a longer motion; white means no motion.`,
  };
  return sentences[kind];
}

/**
 * Returns whether a pixel of a plane shows the background.
 * @param {Plane} plane
 * @param {ChannelStyle} style
 * @param {number} pixel
 * @returns {boolean}
 */
export function isMiss(plane, style, pixel) {
  const at = pixel * plane.components;
  const first = plane.values[at];
  if (style.kind === "ids") return first < 0;
  if (style.kind === "light" || style.kind === "share") return false;
  for (let i = at; i < at + (style.of || 1); i++) if (!Number.isFinite(plane.values[i])) return true;
  return Boolean(style.zeroIsMiss) && first === 0 && !plane.values[at + 1] && !plane.values[at + 2];
}
