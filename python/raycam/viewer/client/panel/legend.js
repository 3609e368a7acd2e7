// The legend of a channel: an explanation of its colours, the bar of the colour map, and the most frequent ids.

import { howToRead, isMiss, styleOf } from "../image/channels.js";
import { idColor, mapTable } from "../image/colormap.js";
import { element } from "../dom.js";
import { grouped, sixDigits } from "../image/numbers.js";
import { longest, rangeOf } from "../image/paint.js";

/** @typedef {import("../image/planes.js").Plane} Plane */

const IDS_SHOWN = 12;

/**
 * Fills the legend of a plane.
 * @param {HTMLElement} box
 * @param {Plane} plane
 * @param {import("../image/paint.js").Display} display
 * @param {Record<string, string>} names of ids
 */
export function fillLegend(box, plane, display, names) {
  const style = styleOf(plane);
  box.replaceChildren(element("p", howToRead(style, plane.components)));
  if (style.kind === "scalar" || style.kind === "share") box.append(...barOf(plane, display, style.kind === "share"));
  if (style.kind === "flow") box.append(element("p", `The full colour means at least ${sixDigits(longest(plane), "float64")}${style.unit ? ` ${style.unit}` : ""}.`));
  if (style.kind === "ids") box.append(listOfIds(plane, names));
}

/**
 * Shows the scale of a plane's colours over the image, with its unit; nothing for channels without a colour map.
 * @param {HTMLElement} box
 * @param {Plane | null} plane
 * @param {import("../image/paint.js").Display} display
 */
export function fillScale(box, plane, display) {
  const style = plane && styleOf(plane);
  box.hidden = !plane || !style || (style.kind !== "scalar" && style.kind !== "share");
  if (box.hidden || !plane || !style) return;
  box.replaceChildren(element("span", `${plane.name}${style.unit ? `, ${style.unit}` : ""}`), ...barOf(plane, display, style.kind === "share"));
}

/**
 * @param {Plane} plane
 * @param {import("../image/paint.js").Display} display
 * @param {boolean} isShare
 * @returns {HTMLElement[]}
 */
function barOf(plane, display, isShare) {
  const bar = document.createElement("canvas");
  bar.width = 256;
  bar.height = 1;
  bar.className = "bar-of-map";
  bar.setAttribute("aria-hidden", "true");
  const image = new ImageData(256, 1);
  const table = mapTable(isShare ? "gray" : display.map);
  for (let i = 0; i < 256; i++) image.data.set([table[12 * i], table[12 * i + 1], table[12 * i + 2], 255], 4 * i);
  /** @type {CanvasRenderingContext2D} */ (bar.getContext("2d")).putImageData(image, 0, 0);
  const { low, high, log } = rangeOf(plane, display);
  const ticks = element("div", "", { class: "ticks" });
  for (const share of [0, 0.25, 0.5, 0.75, 1]) {
    const value = log ? low * (high / low) ** share : (1 - share) * low + share * high;
    ticks.append(element("span", String(Number(value.toPrecision(3)))));
  }
  return [bar, ticks];
}

/**
 * @param {Plane} plane
 * @param {Record<string, string>} names
 * @returns {HTMLElement}
 */
function listOfIds(plane, names) {
  /** @type {Map<number, number>} */
  const counts = new Map();
  let misses = 0;
  plane.values.forEach((id, pixel) => {
    if (isMiss(plane, { kind: "ids" }, pixel)) misses++;
    else counts.set(id, (counts.get(id) || 0) + 1);
  });
  const list = element("ul", "", { class: "ids" });
  const commonest = [...counts].sort((a, b) => b[1] - a[1] || a[0] - b[0]);
  for (const [id, count] of commonest.slice(0, IDS_SHOWN)) {
    const item = element("li");
    const swatch = element("span", "", { class: "swatch", "aria-hidden": "true" });
    swatch.style.backgroundColor = `rgb(${idColor(id).join(" ")})`;
    item.append(swatch, element("span", `${id} ${names[id] || ""}`), element("span", grouped(count), { class: "count" }));
    list.append(item);
  }
  const rest = commonest.length - IDS_SHOWN;
  const sentence = `${rest > 0 ? `${grouped(rest)} more ids; ` : ""}${grouped(misses)} pixels without an id.`;
  list.append(element("li", sentence, { class: "rest" }));
  return list;
}
