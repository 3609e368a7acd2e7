// Planes: the arrays of a frame. wire.py packs planes, and this file unpacks them to the same bits.
//
// A plane is packed by a filter over its values as whole numbers, then by raw deflate. The filters store the components
// one after the other, and of each component first the lowest byte of all values, then the next byte. "left" stores the
// difference from the value on the left. "left_up" stores this difference minus the same difference in the row above.
// Both filters wrap around.

/** @typedef {import("./numbers.js").NumberType} NumberType */
/**
 * @typedef {object} PlaneHeader
 * @property {string} name
 * @property {NumberType} dtype
 * @property {number} width
 * @property {number} height
 * @property {number} components
 * @property {"plain" | "apart" | "left" | "left_up"} filter
 * @property {boolean} deflated
 */
/**
 * @typedef {object} Plane
 * @property {string} name
 * @property {NumberType} dtype
 * @property {number} width
 * @property {number} height
 * @property {number} components
 * @property {Float32Array | Float64Array | Int32Array} values rows from the top, components of a pixel side by side
 */

/**
 * @param {string} text base64
 * @returns {Uint8Array<ArrayBuffer>}
 */
export function bytesOfBase64(text) {
  const native = /** @type {any} */ (Uint8Array).fromBase64;
  if (native) return native.call(Uint8Array, text);
  const binary = atob(text.trim());
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < binary.length; i++) bytes[i] = binary.charCodeAt(i);
  return bytes;
}

/**
 * The plane of packed bytes.
 * @param {PlaneHeader} header
 * @param {Uint8Array<ArrayBuffer>} packed
 * @returns {Promise<Plane>}
 */
export async function unpackPlane(header, packed) {
  const bytes = header.deflated ? await inflate(packed) : packed;
  const { name, dtype, width, height, components } = header;
  return { name, dtype, width, height, components, values: valuesOf(header, bytes) };
}

/**
 * Raw deflate.
 * @param {Uint8Array<ArrayBuffer>} bytes
 * @returns {Promise<Uint8Array<ArrayBuffer>>}
 */
export async function deflate(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new CompressionStream("deflate-raw"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/**
 * The bytes of raw deflate. Throws if there are more than `most`, without unpacking the rest.
 * @param {Uint8Array<ArrayBuffer>} packed
 * @param {number} [most]
 * @returns {Promise<Uint8Array<ArrayBuffer>>}
 */
export async function inflate(packed, most = Infinity) {
  let length = 0;
  const limit = new TransformStream({
    transform(chunk, controller) {
      length += chunk.length;
      if (length > most) throw new RangeError(`more than ${most} bytes`);
      controller.enqueue(chunk);
    },
  });
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate-raw")).pipeThrough(limit);
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/**
 * @param {PlaneHeader} header
 * @param {Uint8Array<ArrayBuffer>} bytes
 * @returns {Float32Array | Float64Array | Int32Array}
 */
function valuesOf(header, bytes) {
  const count = header.width * header.height * header.components;
  const size = { float16: 2, float32: 4, float64: 8, int32: 4 }[header.dtype];
  if (bytes.length !== count * size) {
    throw new Error(`${header.name}: ${bytes.length} bytes, expected ${count * size}`);
  }
  const plain = header.filter === "plain" ? bytes.slice().buffer : unfilter(header, bytes, size);
  if (header.dtype === "float64") return new Float64Array(plain);
  if (header.dtype === "int32") return new Int32Array(plain);
  if (header.dtype === "float32") return new Float32Array(plain);
  return Float32Array.from(new Uint16Array(plain), floatOfHalf);
}

/**
 * Undoes a filter. Words of 8 bytes are pairs of 4 bytes with a carry.
 * @param {PlaneHeader} header
 * @param {Uint8Array<ArrayBuffer>} bytes
 * @param {number} size bytes of a value
 * @returns {ArrayBuffer}
 */
function unfilter({ width, height, components, filter }, bytes, size) {
  const pixels = width * height;
  const out = new Uint8Array(pixels * components * size);
  for (let component = 0; component < components; component++) {
    const low = wordsOf(bytes, component * size * pixels, pixels, Math.min(size, 4));
    const high = size === 8 ? wordsOf(bytes, (component * 8 + 4) * pixels, pixels, 4) : null;
    if (filter === "left_up") sumDown(low, high, width);
    if (filter !== "apart") sumRight(low, high, width);
    const view = new DataView(out.buffer);
    for (let i = 0, at = component * size; i < pixels; i++, at += components * size) {
      if (size === 2) view.setUint16(at, low[i] & 0xffff, true);
      else view.setUint32(at, low[i], true);
      if (high) view.setUint32(at + 4, high[i], true);
    }
  }
  return out.buffer;
}

/**
 * @param {Uint8Array} bytes
 * @param {number} start
 * @param {number} pixels
 * @param {number} size bytes of a word, 2 or 4
 * @returns {Uint32Array}
 */
function wordsOf(bytes, start, pixels, size) {
  const words = new Uint32Array(pixels);
  for (let byte = 0; byte < size; byte++) {
    const shift = 8 * byte;
    const from = start + byte * pixels;
    for (let i = 0; i < pixels; i++) words[i] |= bytes[from + i] << shift;
  }
  return words;
}

/**
 * @param {Uint32Array} low
 * @param {Uint32Array | null} high
 * @param {number} width
 */
function sumDown(low, high, width) {
  for (let i = width; i < low.length; i++) addWord(low, high, i, i - width);
}

/**
 * @param {Uint32Array} low
 * @param {Uint32Array | null} high
 * @param {number} width
 */
function sumRight(low, high, width) {
  for (let row = 0; row < low.length; row += width) {
    for (let i = row + 1; i < row + width; i++) addWord(low, high, i, i - 1);
  }
}

/**
 * Adds word `from` to word `at`.
 * @param {Uint32Array} low
 * @param {Uint32Array | null} high
 * @param {number} at
 * @param {number} from
 */
function addWord(low, high, at, from) {
  const sum = low[at] + low[from];
  low[at] = sum;
  if (high) high[at] += high[from] + (sum > 0xffffffff ? 1 : 0);
}

/**
 * @param {number} bits of an IEEE 754 binary16
 * @returns {number}
 */
function floatOfHalf(bits) {
  const sign = bits & 0x8000 ? -1 : 1;
  const exponent = (bits >> 10) & 31;
  const fraction = bits & 1023;
  if (exponent === 31) return fraction ? NaN : sign * Infinity;
  return exponent ? sign * 2 ** (exponent - 15) * (1 + fraction / 1024) : sign * 2 ** -24 * fraction;
}
