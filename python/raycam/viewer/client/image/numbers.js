// Numbers as text: the shortest decimal that reads back as the same float, as NumPy prints it.

/** @typedef {"float16" | "float32" | "float64" | "int32"} NumberType */

/**
 * The shortest decimal of a value. `value` is exactly representable in `dtype`.
 * @param {number} value
 * @param {NumberType} dtype
 * @returns {string}
 */
export function shortest(value, dtype) {
  if (!Number.isFinite(value)) return nonFinite(value);
  if (Object.is(value, -0)) return "-0";
  const rounded = dtype === "float32" ? Math.fround : dtype === "float16" ? halfOf : null;
  if (!rounded) return String(value);
  for (let digits = 1; digits < 9; digits++) {
    const text = value.toPrecision(digits);
    if (rounded(Number(text)) === value) return String(Number(text));
  }
  return String(Number(value.toPrecision(9)));
}

/** The nearest float16 of a value within its range, ties to even. @param {number} value @returns {number} */
function halfOf(value) {
  const exponent = Math.max(Math.floor(Math.log2(Math.abs(value))), -14);
  const step = 2 ** (exponent - 10);
  const steps = Math.round(value / step);
  return step * (Math.abs(value / step - steps) === 0.5 && steps % 2 ? steps - 1 : steps);
}

const NARROW = 9; // characters of a narrow column

/**
 * A value with six significant digits, or fewer if they would not fit into a narrow column.
 * @param {number} value
 * @param {NumberType} dtype
 * @returns {string}
 */
export function sixDigits(value, dtype) {
  if (!Number.isFinite(value)) return nonFinite(value);
  const full = shortest(value, dtype);
  if (dtype === "int32" || full.length < NARROW) return full;
  for (let digits = 6; digits > 3; digits--) {
    const text = String(Number(value.toPrecision(digits)));
    if (text.length <= NARROW) return text;
  }
  return value.toExponential(2);
}

/**
 * @param {number} value
 * @returns {string} "nan", "inf" or "-inf", as NumPy prints them
 */
function nonFinite(value) {
  return Number.isNaN(value) ? "nan" : value > 0 ? "inf" : "-inf";
}

/**
 * A count as text, with separators between the thousands.
 * @param {number} count
 * @returns {string}
 */
export function grouped(count) {
  return String(Math.round(count)).replace(/\B(?=(\d{3})+$)/g, ",");
}
