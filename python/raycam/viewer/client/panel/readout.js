// The numbers of a pixel: as a table, as a sentence for screen readers, and as text for the clipboard.

import { element } from "../dom.js";
import { unitOf } from "../image/channels.js";
import { shortest, sixDigits } from "../image/numbers.js";

/** @typedef {import("../image/numbers.js").NumberType} NumberType */
/** @typedef {{ dtype: NumberType, numbers: number[], name?: string, other?: { dtype: NumberType, numbers: number[] } }} ChannelValue */
/** @typedef {Record<string, ChannelValue>} PixelValues */

/**
 * Fills the table of values, with the values of B where they differ. Hovering over a number shows all of its digits.
 * @param {HTMLTableSectionElement} body
 * @param {PixelValues} values
 * @param {string} shown the channel of the image
 */
export function fillReadout(body, values, shown) {
  body.replaceChildren();
  for (const [channel, value] of Object.entries(values)) {
    const row = element("tr", "", channel === shown ? { "aria-current": "true" } : {});
    row.append(nameOf(channel), cellOf(value));
    body.append(row);
    if (value.other && !value.other.numbers.every((number, i) => Object.is(number, value.numbers[i]))) {
      const other = element("tr", "", { class: "other" });
      other.append(element("th", "B", { scope: "row", "aria-label": `${channel} of B` }), cellOf(value.other));
      body.append(other);
    }
  }
}

/**
 * @param {string} channel
 * @returns {HTMLElement} its name, which may break after an underscore
 */
function nameOf(channel) {
  const cell = element("th", "", { scope: "row" });
  channel.split(/(?<=_)/).forEach((part, i) => cell.append(i ? element("wbr") : "", part));
  const unit = unitOf(channel);
  if (unit) cell.dataset.unit = unit === "pixels" ? "px" : unit;
  return cell;
}

/**
 * @param {ChannelValue} value
 * @returns {HTMLElement}
 */
function cellOf({ dtype, numbers, name }) {
  const cell = element("td");
  for (const number of numbers) {
    cell.append(element("span", sixDigits(number, dtype), { class: "number", title: shortest(number, dtype) }), " ");
  }
  if (name) cell.append(element("span", name, { class: "name" }));
  return cell;
}

/**
 * The values as lines of text, with all digits.
 * @param {{ column: number, row: number }} pixel
 * @param {PixelValues} values
 * @returns {string}
 */
export function readoutText({ column, row }, values) {
  const lines = Object.entries(values).flatMap(([channel, { dtype, numbers, name, other }]) => [
    `${channel} ${numbers.map((v) => shortest(v, dtype)).join(" ")}${name ? ` ${name}` : ""}`,
    ...(other ? [`${channel} of B ${other.numbers.map((v) => shortest(v, other.dtype)).join(" ")}`] : []),
  ]);
  return [`pixel ${column} ${row}`, ...lines].join("\n");
}
