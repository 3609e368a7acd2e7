// What the page tells of a pixel in numbers, and its exercises.

import { general, vectorText } from "../core/explanation.js";
import { rangesOf } from "../core/steps.js";
import { byId, element } from "../dom.js";
import { EXERCISES, TOLERANCE, verdictOn } from "./exercises.js";

/** @param {string} id @param {number[]} m row by row @param {number} columns */
export function showMatrix(id, m, columns) {
  const rows = Array.from({ length: m.length / columns }, (_, i) => {
    const row = element("tr");
    row.append(...m.slice(columns * i, columns * (i + 1)).map((value) => element("td", general(value), { title: String(value) })));
    return row;
  });
  byId(id, HTMLTableElement).replaceChildren(...rows);
}

/**
 * The steps of the pixel, formula beside number.
 * @param {{ column: number, row: number, names: string[], ids: ArrayLike<number> }} world
 * @param {{ ray: import("../core/steps.js").PixelRay } & ReturnType<typeof import("../core/steps.js").stepsOf>} steps
 * @param {import("../core/steps.js").Candidate | null} found
 */
export function showSteps({ column, row, names, ids }, { ray, counts, winner }, found) {
  /** @type {[string, [string, string][]][]} */
  const groups = [
    [
      `The line through pixel (${column}, ${row})`,
      [
        ["x", vectorText(ray.x)],
        ["X' = P⁺ x", ray.XPrime ? vectorText(ray.XPrime) : "at infinity"],
        ["C", vectorText(ray.C)],
        ["v = r3", vectorText(ray.forward)],
        ["v·(X' - C)", `${general(ray.along)}: X' is ${ray.along > 0 ? "in front" : "behind"}`],
        [ray.along > 0 ? "r = X' - C" : "r = C - X'", vectorText(ray.r)],
      ],
    ],
  ];
  if (found) {
    const name = `${names[ids[2 * found.index]]}, triangle ${ids[2 * found.index + 1]}`;
    groups.push([
      `The plane: ${name}`,
      [
        ["a", vectorText(found.corners[0])],
        ["n = (c-a) x (b-a)", vectorText(found.n)],
        ["n·(a - C)", general(found.above)],
        ["n·r", general(found.below)],
        ["t", general(found.t)],
        ["f(t) = C + t r", vectorText(found.f)],
      ],
    ]);
    groups.push([
      "Inside or outside",
      [
        ["g = a + v3", vectorText(found.g)],
        ...found.edges.map((_, i) => /** @type {[string, string]} */ ([`u and v${i + 1}`, edgeText(found, i)])),
        ["crossings", `${found.crossings}: ${found.inside ? "inside" : "outside"}`],
      ],
    ]);
  }
  const depth = winner ? `t = ${general(winner.t)}, depth ${general(rangesOf(ray, winner.t).depth)}` : "none: the background";
  const missed = `${counts.inside} hit, ${counts.outside} missed, ${counts.behind} behind, ${counts.parallel + counts.withoutArea} edge-on`;
  groups.push(["The closest one wins", [["triangles", missed], ["the closest", depth]]]);
  const list = groups.flatMap(([title, rows]) => {
    const table = element("dl");
    table.append(...rows.flatMap(([term, text]) => [element("dt", term), element("dd", text)]));
    return [element("h3", title), table];
  });
  byId("steps", HTMLElement).replaceChildren(...list);
}

/** @param {import("../core/steps.js").Candidate} found @param {number} i */
function edgeText(found, i) {
  if (Number.isNaN(found.alongU[i])) return "parallel";
  return `s = ${general(found.alongU[i])}, q = ${general(found.alongEdge[i])}${found.crossed[i] ? ": crossed" : ""}`;
}

/** The exercises of the page. */
export class Exercises {
  constructor() {
    /** @type {import("./exercises.js").Facts | null} */
    this.facts = null;
    this.solved = new Set();
    byId("tolerance", HTMLElement).textContent = `An answer is right if it is off by at most ${100 * TOLERANCE} % of its largest number; a count is exact.`;
    this.parts = EXERCISES.map((exercise) => {
      const group = element("fieldset", "", { id: `exercise-${exercise.id}` });
      const given = element("pre", "", { tabindex: "0", "aria-label": "Given" });
      const verdict = element("p", "", { role: "status", class: "verdict" });
      const fields = exercise.asked.map((name) => {
        const label = element("label", name);
        const field = /** @type {HTMLInputElement} */ (element("input", "", { type: "text", inputmode: "decimal", autocomplete: "off", size: "10" }));
        label.append(field);
        return { label, field };
      });
      const button = element("button", "Check", { type: "button" });
      const check = () => this.check(exercise.id);
      button.addEventListener("click", check);
      for (const { field } of fields) field.addEventListener("keydown", (event) => event.key === "Enter" && check());
      const line = element("div", "", { class: "answers" });
      line.append(...fields.map(({ label }) => label), button);
      group.append(element("legend", exercise.title), given, line, verdict);
      byId("exercise-list", HTMLElement).append(group);
      return { exercise, given, fields: fields.map(({ field }) => field), verdict };
    });
  }

  /** @param {import("./exercises.js").Facts | null} facts of the pixel; null where it has no triangle to ask about */
  show(facts) {
    this.facts = facts;
    this.solved.clear();
    byId("exercise-list", HTMLElement).hidden = !facts;
    for (const { exercise, given, verdict } of this.parts) {
      given.textContent = facts ? exercise.given(facts).join("\n") : "";
      verdict.textContent = "";
    }
    this.count(facts ? "" : "This pixel's ray meets no triangle's plane in front of the camera: choose another pixel.");
  }

  /** @param {string} id */
  check(id) {
    const part = this.parts.find(({ exercise }) => exercise.id === id);
    if (!part || !this.facts) return;
    const { right, text } = verdictOn(id, part.fields.map(({ value }) => value), this.facts);
    part.verdict.textContent = text;
    part.verdict.className = right ? "verdict right" : "verdict wrong";
    if (right) this.solved.add(id);
    else this.solved.delete(id);
    this.count();
  }

  count(text = `${this.solved.size} of ${EXERCISES.length} solved.`) {
    byId("solved", HTMLElement).textContent = text || `${this.solved.size} of ${EXERCISES.length} solved.`;
  }
}
