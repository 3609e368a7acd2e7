// The axes widget: the directions of x, y and z in the image. A click on an axis end shows the world from that side. A button below it sets the up axis.

import { byId, element, svgElement } from "../dom.js";

const LENGTH = 28;
const NAMES = ["x", "y", "z"];
/** For each up axis: the names of the sides on the positive and the negative end of the x, y and z axes. */
const SIDES_OF_UP = /** @type {Record<string, [string, string][]>} */ ({
  z: [["right", "left"], ["back", "front"], ["top", "bottom"]],
  y: [["right", "left"], ["top", "bottom"], ["front", "back"]],
});
const PRESETS = /** @type {[string, string][]} */ ([["front", "Front"], ["right", "Right"], ["top", "Top"], ["iso", "Iso"], ["default", "Default"]]);

export class Axes {
  /**
   * @param {(side: string) => void} viewFrom
   * @param {(axis: "y" | "z") => void} setUp
   */
  constructor(viewFrom, setUp) {
    this.viewFrom = viewFrom;
    /** The world's up axis. @type {"y" | "z"} */
    this.axis = "z";
    this.up = byId("up-axis", HTMLButtonElement);
    this.up.addEventListener("click", () => setUp(this.axis === "z" ? "y" : "z"));
    this.svg = /** @type {SVGElement} */ (/** @type {any} */ (document.getElementById("axes")));
    byId("sides", HTMLElement).append(...PRESETS.map(([side, text]) => {
      const button = element("button", text, { type: "button", title: `View from the ${side === "iso" ? "corner" : side} side`.replace("default side", "default direction") });
      button.addEventListener("click", () => viewFrom(side));
      return button;
    }));
  }

  /** @param {{ R: number[], up: number[], up_assumed?: boolean }} camera rotation camera_from_world by rows; `up_assumed` is true if neither the file nor the user has chosen the up axis */
  show({ R, up, up_assumed: isAssumed }) {
    this.axis = up[2] ? "z" : "y";
    this.up.textContent = `Up: ${this.axis.toUpperCase()}${isAssumed ? " (assumed)" : ""}`;
    this.up.title = `${isAssumed ? "The file does not specify its up axis. " : ""}The ${this.axis} axis points up. If the model lies on its side, click to use the ${this.axis === "z" ? "y" : "z"} axis`;
    const sides = SIDES_OF_UP[this.axis];
    const ends = NAMES.flatMap((name, axis) => [1, -1].map((sign, i) => ({
      name, sign, side: sides[axis][i], color: `var(--axis-${name})`,
      x: sign * R[axis] * LENGTH, y: sign * R[3 + axis] * LENGTH, depth: sign * R[6 + axis],
    })));
    ends.sort((a, b) => b.depth - a.depth);
    this.svg.replaceChildren(...ends.flatMap((end) => this.drawn(end)));
  }

  /**
   * @param {{ name: string, sign: number, side: string, color: string, x: number, y: number }} end
   * @returns {SVGElement[]}
   */
  drawn({ name, sign, side, color, x, y }) {
    const end = svgElement("circle", { cx: x, cy: y, r: sign > 0 ? 9 : 6, class: "end" });
    end.style.fill = sign > 0 ? color : "var(--glass)";
    end.style.stroke = color;
    end.append(svgElement("title", {}, `View from ${sign > 0 ? "+" : "-"}${name} (${side})`));
    end.addEventListener("click", () => this.viewFrom(side));
    if (sign < 0) return [end];
    const line = svgElement("line", { x1: 0, y1: 0, x2: x, y2: y });
    line.style.stroke = color;
    return [line, end, svgElement("text", { x, y }, name.toUpperCase())];
  }
}
