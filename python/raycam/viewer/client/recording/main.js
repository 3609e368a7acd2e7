// The page of a recording: plays the images at their times.

import { byId } from "../dom.js";

/** Shows the first image, and plays from the start or from the chosen time. */
function openRecording() {
  /** @type {{ times: number[], seconds: number }} */
  const { times, seconds } = JSON.parse(byId("recording", HTMLElement).textContent || "");
  const picture = byId("picture", HTMLImageElement);
  const slider = byId("time", HTMLInputElement);
  const button = byId("play", HTMLButtonElement);
  const text = byId("time-text", HTMLOutputElement);
  let number = -1;
  let playing = false;
  let began = 0;

  /** @param {number} time seconds */
  const show = (time) => {
    const next = Math.max(times.findLastIndex((/** @type {number} */ each) => each <= time), 0);
    if (next !== number) picture.src = `data:image/jpeg;base64,${byId(`image-${next}`, HTMLElement).textContent}`;
    number = next;
    slider.value = String(time);
    text.textContent = `${time.toFixed(1)} s of ${seconds.toFixed(1)} s`;
  };
  const step = () => {
    if (!playing) return;
    const time = Math.min((performance.now() - began) / 1000, seconds);
    show(time);
    if (time < seconds) requestAnimationFrame(step);
    else play(false);
  };
  /** @param {boolean} plays */
  const play = (plays) => {
    playing = plays;
    button.textContent = plays ? "Pause" : "Play";
    if (!plays) return;
    const start = Number(slider.value) < seconds ? Number(slider.value) : 0;
    began = performance.now() - 1000 * start;
    step();
  };
  slider.max = String(seconds);
  slider.addEventListener("input", () => {
    play(false);
    show(Number(slider.value));
  });
  button.addEventListener("click", () => play(!playing));
  document.addEventListener("keydown", (event) => {
    if (event.key !== " " || event.target === button) return;
    event.preventDefault();
    play(!playing);
  });
  show(0);
}

openRecording();
