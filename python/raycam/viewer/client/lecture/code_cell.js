// A cell in which the student writes a function of the ray tracer. The last cell renders an image with all functions.

import { element } from "../dom.js";
import { rayOfPixel } from "../core/steps.js";
import { cameraOf } from "./camera.js";
import { CODE_EXERCISES, isSame } from "./code_exercises.js";
import { runCode } from "./code_runner.js";
import { BACKGROUND, colorsOf, cornersOf, firstNumbers, SIZE, worldText } from "./world.js";

/** @typedef {import("./figure.js").Shared} Shared */
/** @typedef {import("./pictures.js").Pictures} Pictures */

/** The code of all cells up to the cell `id`. @param {Shared} shared @param {string} id */
function codeUntil(shared, id) {
  const last = CODE_EXERCISES.findIndex((each) => each.id === id);
  return CODE_EXERCISES.slice(0, last + 1).map((each) => shared.progress[`code-${each.id}`] || each.start).join("\n");
}

/** @param {HTMLElement} host @param {Shared} shared @param {Pictures} pictures */
export function buildCodeCell(host, shared, pictures) {
  const exercise = CODE_EXERCISES.find(({ id }) => id === host.dataset.code);
  if (!exercise) throw new Error(`the lecture has no code cell ${host.dataset.code}`);
  const { id, task, start } = exercise;
  const editor = /** @type {HTMLTextAreaElement} */ (element("textarea", "", { spellcheck: "false", autocapitalize: "off", "aria-label": `Code of ${id}`, rows: String(start.split("\n").length + 2) }));
  editor.value = shared.progress[`code-${id}`] || start;
  const verdict = element("p", "", { class: "verdict", role: "status" });
  const run = element("button", "Run", { type: "button" });
  const again = element("button", "Start again", { type: "button" });
  const buttons = element("div", "", { class: "choice" });
  buttons.append(run, again);
  host.append(element("h3", "Write it yourself"), element("p", task), editor, buttons, verdict);
  host.classList.toggle("solved", Boolean(shared.progress[id]));
  editor.addEventListener("input", () => shared.remember(`code-${id}`, editor.value));
  again.addEventListener("click", () => {
    editor.value = start;
    shared.remember(`code-${id}`, start);
  });
  const say = (/** @type {boolean} */ right, /** @type {string} */ text) => {
    verdict.textContent = text;
    verdict.className = `verdict ${right ? "right" : "wrong"}`;
    if (right) shared.remember(id, true);
    host.classList.toggle("solved", Boolean(shared.progress[id]));
    shared.redraw();
  };
  run.addEventListener("click", async () => {
    verdict.textContent = "Running …";
    try {
      const cases = exercise.cases();
      const code = codeUntil(shared, id);
      const results = await runCode(code, { name: id, calls: cases.map(({ given }) => given) });
      const wrong = cases.findIndex(({ expected }, i) => !isSame(results[i], expected));
      if (wrong >= 0) say(false, `Case ${wrong + 1} of ${cases.length}: ${exercise.hint(results[wrong], cases[wrong].expected, cases[wrong].given)}`);
      else if (id === "closest") await comparePictures(code, pictures, host, say);
      else say(true, `Right in all ${cases.length} cases.`);
    } catch (error) {
      say(false, error instanceof Error ? error.message : String(error));
    }
  });
}

/** Renders with the student's code and compares each byte with the core. @param {string} code @param {Pictures} pictures @param {HTMLElement} host @param {(right: boolean, text: string) => void} say */
async function comparePictures(code, pictures, host, say) {
  const numbers = firstNumbers();
  const [width, height] = SIZE;
  const { P } = cameraOf(numbers);
  const rays = Array.from({ length: width * height }, (_, i) => rayOfPixel(P, i % width, Math.floor(i / width)));
  const corners = cornersOf(numbers);
  const triangles = Array.from({ length: corners.length / 9 }, (_, i) => [0, 3, 6].map((k) => corners.slice(9 * i + k, 9 * i + k + 3)));
  const found = await runCode(code, { picture: { width, height, Xs: rays.map(({ XPrime }) => XPrime), C: numbers.C, v: rays[0].forward, triangles } });
  const colors = colorsOf(numbers);
  const image = new ImageData(width, height);
  found.forEach((/** @type {number} */ index, /** @type {number} */ i) => image.data.set([...(colors[index] || BACKGROUND), 255], 4 * i));
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = SIZE;
  canvas.className = "result";
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", "Your picture");
  canvas.getContext("2d")?.putImageData(image, 0, 0);
  host.querySelector(".result")?.remove();
  host.append(canvas);
  pictures.request("code", { text: worldText(numbers), width, height, integrator: "flat", samples: 1, seed: Date.now() % 1e6 }, {
    onPicture: (picture) => {
      const theirs = picture.canvas.getContext("2d")?.getImageData(0, 0, width, height).data || [];
      const different = image.data.reduce((sum, byte, i) => sum + Number(byte !== theirs[i]), 0);
      const total = 3 * width * height;
      say(different === 0, different ? `${different} of ${total} bytes differ from raycam's picture.` : `All ${total} bytes of your picture equal raycam's.`);
    },
  });
}
