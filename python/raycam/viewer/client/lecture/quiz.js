// The form of a typed exercise: given numbers, input fields, and a verdict with a hint. Solved
// exercises are remembered.

import { element } from "../dom.js";
import { factsOf } from "./exercise_world.js";
import { EXERCISES, verdictOn } from "./exercises.js";

/** @typedef {import("./figure.js").Shared} Shared */

/** A text in which the page's symbols replace plain characters. @param {string} text */
const inSymbols = (text) => text.replaceAll("X'", "X′").replaceAll(" - ", " − ").replaceAll(") x (", ") × (");

/** @param {HTMLElement} host @param {Shared} shared */
export function buildQuiz(host, shared) {
  const exercise = EXERCISES.find(({ id }) => id === host.dataset.exercise);
  if (!exercise) throw new Error(`the lecture has no exercise ${host.dataset.exercise}`);
  const { id, given } = exercise;
  const [title, ...asked] = [exercise.title, ...exercise.asked].map(inSymbols);
  host.append(element("h3", "Exercise"), element("p", /[.?]$/.test(title) ? title : `${title}.`));
  const numbers = element("pre", "", { tabindex: "0", "aria-label": "Given numbers" });
  const form = element("form");
  const fields = asked.map((name) => /** @type {HTMLInputElement} */ (element("input", "", { type: "text", inputmode: "text", autocomplete: "off", "aria-label": name })));
  fields.forEach((field, i) => {
    const label = element("label", `${asked[i]} `);
    label.append(field);
    form.append(label);
  });
  const verdict = element("p", "", { class: "verdict", role: "status" });
  form.append(element("button", "Check", { type: "submit" }));
  host.append(numbers, form, verdict);
  const facts = factsOf();
  const show = () => {
    host.classList.toggle("solved", Boolean(shared.progress[id]));
    numbers.textContent = inSymbols(given(facts, (other) => Boolean(shared.progress[other])).join("\n"));
  };
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    const { right, text } = verdictOn(id, fields.map(({ value }) => value), facts);
    verdict.textContent = inSymbols(text);
    verdict.className = `verdict ${right ? "right" : "wrong"}`;
    if (right) shared.remember(id, true);
    shared.redraw();
  });
  shared.listeners.push(show);
  show();
}
