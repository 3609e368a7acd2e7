// Finds elements of the page by their ids, and creates new elements.

/**
 * The element of an id.
 * @template {HTMLElement} T
 * @param {string} id
 * @param {new () => T} type
 * @returns {T}
 */
export function byId(id, type) {
  const element = document.getElementById(id);
  if (!(element instanceof type)) throw new Error(`the page has no ${type.name} #${id}`);
  return element;
}

/**
 * A new element with a text, and attributes. Texts are never markup.
 * @param {string} tag
 * @param {string} [text]
 * @param {Record<string, string>} [attributes]
 * @returns {HTMLElement}
 */
export function element(tag, text = "", attributes = {}) {
  const made = document.createElement(tag);
  made.textContent = text;
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  return made;
}

/**
 * A new SVG element. Its namespace is copied from the SVG element that each page contains.
 * @param {string} tag
 * @param {Record<string, string | number>} [attributes]
 * @param {string} [text]
 * @returns {SVGElement}
 */
export function svgElement(tag, attributes = {}, text = "") {
  const made = /** @type {SVGElement} */ (document.createElementNS(document.querySelector("svg")?.namespaceURI || null, tag));
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, String(value));
  if (text) made.textContent = text;
  return made;
}

/**
 * An icon of 16 x 16 units.
 * @param {string} path
 * @returns {SVGElement}
 */
export function icon(path) {
  const svg = svgElement("svg", { viewBox: "0 0 16 16", "aria-hidden": "true" });
  svg.append(svgElement("path", { d: path }));
  return svg;
}

/**
 * Fills a select with options.
 * @param {HTMLSelectElement} select
 * @param {[value: string, text: string][]} options
 */
export function fillSelect(select, options) {
  select.replaceChildren(...options.map(([value, text]) => element("option", text, { value })));
}

/**
 * The numbers in fields. Reports the first field without a number, or with a number outside the field's `min` and `max`.
 * @param {HTMLInputElement[]} inputs with labels around them
 * @param {(text: string) => void} wrong
 * @returns {number[] | null} null if a field is invalid
 */
export function numbersOf(inputs, wrong) {
  for (const { value, min, max, validity, labels } of inputs) {
    if (value && Number.isFinite(Number(value)) && !validity.rangeUnderflow && !validity.rangeOverflow) continue;
    const name = labels?.[0]?.textContent?.trim() || "the field";
    wrong(`${name}: expected a number from ${Number(min)} to ${Number(max)}${value ? `, got ${value}` : ""}.`);
    return null;
  }
  return inputs.map(({ value }) => Number(value));
}

/**
 * Saves bytes as a file, as the browser saves downloads; returns a report for the user.
 * @param {string} name
 * @param {string} type
 * @param {BlobPart} bytes
 * @returns {string}
 */
export function saveFile(name, type, bytes) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([bytes], { type }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
  return `Saved ${name} as a browser download.`;
}
