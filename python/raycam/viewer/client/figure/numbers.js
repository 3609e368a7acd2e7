// Formats numbers and vectors as text.

/** A number with `digits` decimals and a true minus sign. @param {number} value @param {number} [digits] */
export function fixed(value, digits = 2) {
  if (!Number.isFinite(value)) return Number.isNaN(value) ? "none" : value < 0 ? "−∞" : "∞";
  const text = value.toFixed(digits);
  return (Number(text) === 0 ? text.replace("-", "") : text).replace("-", "−");
}

/** A vector as text. @param {number[]} values @param {number} [digits] */
export const tuple = (values, digits = 2) => `(${values.map((value) => fixed(value, digits)).join(", ")})`;
