// Runs a student's functions in a worker of their own, and ends the worker if the functions take too long.

import { HELPERS } from "./code_exercises.js";

const PATIENCE_MS = 20000;
const SERVE = `
onmessage = ({ data: { calls, picture } }) => {
  if (!picture) {
    postMessage({ results: calls.map((given) => CALLED(...given)) });
    return;
  }
  const { width, height, Xs, C, v, triangles } = picture;
  const found = new Int32Array(width * height);
  for (let i = 0; i < found.length; i++) found[i] = closest(triangles, C, pointForward(Xs[i], C, v));
  postMessage({ results: found });
};
`;

/**
 * The results of calls, or the indices of an image.
 * @param {string} code
 * @param {any} message
 * @returns {Promise<any>} rejected with a text that names the line
 */
export function runCode(code, message) {
  const before = HELPERS.split("\n").length;
  const serve = SERVE.replace("CALLED", message.name || "closest");
  const url = URL.createObjectURL(new Blob([`${HELPERS}\n${code}\n${serve}`], { type: "text/javascript" }));
  const worker = new Worker(url);
  return new Promise((resolve, reject) => {
    const timer = setTimeout(() => reject(new Error(`no result after ${PATIENCE_MS / 1000} s; check your code for an endless loop`)), PATIENCE_MS);
    worker.onmessage = ({ data }) => {
      clearTimeout(timer);
      resolve(data.results);
    };
    worker.onerror = (event) => {
      event.preventDefault();
      clearTimeout(timer);
      reject(new Error(`line ${event.lineno - before}: ${event.message.replace("Uncaught ", "")}`));
    };
    worker.postMessage(message);
  }).finally(() => {
    worker.terminate();
    URL.revokeObjectURL(url);
  });
}
