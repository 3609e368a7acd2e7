// The figure of a pixel as elements of the page.

import { figureOf } from "../core/figure.js";
import { svgElement } from "../dom.js";

/** @param {import("../core/figure.js").Shape} shape @returns {SVGElement[]} */
function elementsOf({ kind, at, text, textAt: [x, y] }) {
  const label = text ? [svgElement("text", { x: x.toFixed(1), y: y.toFixed(1), class: kind === "title" ? kind : "" }, text)] : [];
  if (kind === "title") return label;
  if (kind.startsWith("dot")) return [svgElement("circle", { cx: at[0][0], cy: at[0][1], r: 4, class: kind }), ...label];
  const points = at.map((point) => point.map((value) => value.toFixed(2)).join(",")).join(" ");
  const made = svgElement(kind.startsWith("area") ? "polygon" : "polyline", { points, class: kind });
  if (kind.startsWith("arrow")) made.setAttribute("marker-end", "url(#head)");
  return [made, ...label];
}

/**
 * Fills an SVG element with the figure of a pixel.
 * @param {SVGElement} svg
 * @param {ReturnType<typeof figureOf>} figure
 */
export function showFigure(svg, { width, height, shapes, label }) {
  const head = svgElement("marker", { id: "head", viewBox: "0 0 8 8", refX: 7, refY: 4, markerWidth: 7, markerHeight: 7, orient: "auto-start-reverse" });
  head.append(svgElement("path", { d: "M0,0 L8,4 L0,8 z", fill: "context-stroke" }));
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  svg.setAttribute("aria-label", label);
  svg.replaceChildren(head, ...shapes.flatMap(elementsOf));
}
