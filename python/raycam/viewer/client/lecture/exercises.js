// The verdict on a typed answer. The correct answers are computed from the core's steps.

import { general } from "../core/explanation.js";
import { areClose } from "./answers.js";
import { CAMERA_EXERCISES } from "./exercises_camera.js";
import { HIT_EXERCISES } from "./exercises_hit.js";
import { LIGHT_EXERCISES } from "./exercises_light.js";
import { OPTICS_EXERCISES } from "./exercises_optics.js";

export const EXERCISES = [...CAMERA_EXERCISES, ...HIT_EXERCISES, ...LIGHT_EXERCISES, ...OPTICS_EXERCISES];

/**
 * The verdict on a student's texts, with a hint if one is wrong.
 * @param {string} id of the exercise
 * @param {string[]} texts
 * @param {import("./answers.js").Facts} facts
 * @returns {import("./answers.js").Verdict}
 */
export function verdictOn(id, texts, facts) {
  const exercise = /** @type {import("./answers.js").Exercise} */ (EXERCISES.find((each) => each.id === id));
  const values = texts.map((text) => (text.trim() ? Number(text.trim().replace(/^[−–]/, "-")) : NaN));
  const missing = values.findIndex((value) => !Number.isFinite(value));
  if (missing >= 0) {
    const comma = texts[missing].includes(",") ? "; use a decimal point" : "";
    return { right: false, text: `${exercise.asked[missing]}: write a number, such as -0.25${comma}.` };
  }
  const answer = exercise.answer(facts);
  if (id === "crossings" ? values[0] === answer[0] : areEachClose(id, values, answer)) {
    const { inside, onEdge } = facts.found;
    const on = onEdge.some(Boolean) ? ", and f(t) lies on an edge" : "";
    const more = id === "crossings" ? ` ${values[0] % 2 ? "Odd" : "Even"}${on}: f(t) is ${inside ? "inside" : "outside"}.` : "";
    return { right: true, text: `Right: ${answer.map(general).join(", ")}.${more}` };
  }
  const other = exercise.other?.(values, facts);
  return other ? { right: true, text: `Right. ${other}` } : { right: false, text: exercise.hint(values, facts) };
}

/** @param {string} id @param {number[]} values @param {number[]} answer */
function areEachClose(id, values, answer) {
  if (id !== "forward") return areClose(values, answer);
  return areClose(values.slice(0, 1), answer.slice(0, 1)) && areClose(values.slice(1), answer.slice(1));
}
