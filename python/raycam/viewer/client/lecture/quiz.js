// The form of a typed exercise: given numbers, fields, a verdict with a hint, and remembered success.

import { element } from "../dom.js";
import { EXERCISES, verdictOn } from "./exercises.js";

/** @typedef {import("./figure.js").Shared} Shared */

/** @param {HTMLElement} host @param {Shared} shared */
export function buildQuiz(host, shared) {
  const exercise = EXERCISES.find(({ id }) => id === host.dataset.exercise);
  if (!exercise) throw new Error(`the lecture has no exercise ${host.dataset.exercise}`);
  const { id, title, asked, given } = exercise;
  host.append(element("h3", "Exercise"), element("p", title));
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
  /** @returns {import("./answers.js").Facts | null} */
  const factsNow = () => {
    const { ray, found, camera, numbers: all } = shared;
    return found && ray.XPrime && Number.isFinite(found.t) ? { P: camera.P, R: camera.R, pixel: all.pixel, ray, found, numbers: all } : null;
  };
  const show = () => {
    const facts = factsNow();
    numbers.textContent = facts ? given(facts).join("\n") : "Select a pixel that shows a triangle.";
  };
  const mark = () => host.classList.toggle("solved", Boolean(shared.progress[id]));
  let isVisible = false;
  new IntersectionObserver(([entry]) => {
    isVisible = entry.isIntersecting;
    if (isVisible) show();
  }, { rootMargin: "200px" }).observe(host);
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    const facts = factsNow();
    if (!facts) return;
    const { right, text } = verdictOn(id, fields.map(({ value }) => value), facts);
    verdict.textContent = text;
    verdict.className = `verdict ${right ? "right" : "wrong"}`;
    if (right) shared.remember(id, true);
    shared.redraw();
  });
  shared.listeners.push(() => (mark(), isVisible && show()));
  mark();
  show();
}
