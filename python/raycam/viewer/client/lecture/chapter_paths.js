// Chapters 13 to 15: sampling, a path of light, and the mean of paths.

import { cross, lengthOf, plusTimes } from "../core/vectors.js";
import { stepsOf } from "../core/steps.js";
import { linearOfSrgb } from "../image/tone.js";
import { facingNormal, litPicture } from "./chapter_light.js";
import { fixed } from "../figure/numbers.js";
import { drawDot, drawLine } from "../figure/shapes.js";
import { addOutside, worldContent } from "./views.js";
import { SIZE, worldText } from "./world.js";

/** @typedef {import("./figure.js").Figure} Figure */

const COUNTS = [1, 4, 16, 64], SMALL = [120, 90], SKY = [0.3, 0.36, 0.46];

/** A sequence of numbers in 0..1 that a seed determines (mulberry32). @param {number} seed @returns {() => number} */
export function randomOf(seed) {
  let state = seed >>> 0;
  return () => {
    state = (state + 0x6d2b79f5) >>> 0;
    let z = Math.imul(state ^ (state >>> 15), 1 | state);
    z = (z + Math.imul(z ^ (z >>> 7), 61 | z)) ^ z;
    return ((z ^ (z >>> 14)) >>> 0) / 4294967296;
  };
}

/** Edges under a magnifier, with more and more rays for each pixel. @param {Figure} fig */
export function buildAliasing(fig) {
  let choice = 0;
  const picture = litPicture(fig, () => ({ text: worldText(fig.shared.numbers), size: SIZE, integrator: "flat", samples: COUNTS[choice] }));
  fig.canvas({
    ratio: 0.5, label: "A magnified part of the picture around the selected pixel",
    draw: (pen) => {
      const { canvas } = picture();
      pen.ctx.imageSmoothingEnabled = false;
      const [w, h] = [48, 24];
      const [u, v] = fig.shared.numbers.pixel;
      if (canvas) pen.ctx.drawImage(canvas, Math.max(0, Math.min(SIZE[0] - w, u - w / 2)), Math.max(0, Math.min(SIZE[1] - h, v - 40 - h / 2)), w, h, 0, 0, pen.width, pen.height);
    },
  });
  fig.choice({ name: "Rays per pixel", options: COUNTS.map((count) => `${count} ${count === 1 ? "ray" : "rays"} per pixel`), get: () => choice, set: (i) => { choice = i; } });
}

/** Noise against the number of samples. @param {Figure} fig */
export function buildNoise(fig) {
  let shown = 1;
  /** @type {Map<string, { canvas: HTMLCanvasElement, color: Float32Array }>} */
  const pictures = new Map();
  const wanted = (/** @type {number} */ seed) => ({ text: worldText(fig.shared.numbers, { lights: ["sky"], size: SMALL }), width: SMALL[0], height: SMALL[1], integrator: "path", samples: 64, seed });
  let text = "";
  const request = () => {
    if (wanted(1).text !== text) pictures.clear();
    text = wanted(1).text;
    for (const seed of [1, 2]) fig.pictures.request(`${fig.id}${seed}`, wanted(seed), { onPicture: (picture) => {
      pictures.set(`${seed} ${picture.samples}`, picture);
      fig.shared.redraw();
    } });
  };
  const measured = () => COUNTS.map((count) => {
    const [a, b] = [1, 2].map((seed) => pictures.get(`${seed} ${count}`)?.color);
    return a && b ? noiseOf(a, b) : NaN;
  });
  fig.canvas({
    ratio: SMALL[1] / SMALL[0], label: "The picture, from random rays",
    draw: (pen) => {
      request();
      const found = pictures.get(`1 ${COUNTS[shown]}`);
      pen.ctx.imageSmoothingEnabled = false;
      if (found) pen.ctx.drawImage(found.canvas, 0, 0, pen.width, pen.height);
    },
  });
  fig.canvas({
    ratio: SMALL[1] / SMALL[0], label: "The measured noise by the number of samples, with the line 1/√N; both axes are logarithmic",
    draw: (pen) => {
      const values = measured();
      const place = (/** @type {number} */ n, /** @type {number} */ noise) => [60 + (Math.log(n) / Math.log(64)) * (pen.width - 110), 30 - (Math.log(noise / (values[0] || 1)) / Math.log(8)) * (pen.height - 80)];
      drawLine(pen, [place(1, values[0] || 1), place(64, (values[0] || 1) / 8)], { color: "soft-ink", dash: [5, 5] });
      pen.label({ at: place(2, (values[0] || 1) / Math.SQRT2), text: "1/√N", color: pen.color("soft-ink") });
      values.forEach((noise, i) => {
        if (!noise) return;
        drawDot(pen, place(COUNTS[i], noise), i === shown ? "r" : "P", 7);
        pen.label({ at: place(COUNTS[i], noise), text: `N = ${COUNTS[i]}: ${fixed(noise, 4)}` });
      });
    },
  });
  fig.host.classList.add("double", "even");
  fig.choice({ name: "Samples", options: COUNTS.map((count) => `${count}`), get: () => shown, set: (i) => { shown = i; } });
}

/** The noise of an image, from two images with different random numbers: the standard deviation of their difference, divided by √2. @param {ArrayLike<number>} a @param {ArrayLike<number>} b */
export function noiseOf(a, b) {
  let sum = 0;
  for (let i = 0; i < a.length; i++) sum += (a[i] - b[i]) ** 2;
  return Math.sqrt(sum / a.length / 2);
}

/** A direction around a normal with density cos θ / π. @param {number[]} n @param {() => number} random */
export function cosineDirection(n, random) {
  const [radius, angle] = [Math.sqrt(random()), 2 * Math.PI * random()];
  const s = cross(n, Math.abs(n[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0]).map((value, _, all) => value / lengthOf(all));
  const [x, y, z] = [radius * Math.cos(angle), radius * Math.sin(angle), Math.sqrt(Math.max(0, 1 - radius ** 2))];
  return plusTimes(plusTimes(s.map((value) => x * value), y, cross(n, s)), z, n);
}

/** A path of light from the camera: its hits, until it leaves the world. @param {import("./state.js").Shared} shared @param {number} seed */
export function lightPath({ ray, corners, colors }, seed) {
  const random = randomOf(seed);
  /** @type {{ f: number[], index: number, throughput: number[] }[]} */
  const hits = [];
  let now = { C: ray.C, r: ray.r, forward: ray.forward };
  let throughput = [1, 1, 1];
  for (let bounce = 0; bounce < 8; bounce++) {
    const { winner } = stepsOf(now, corners);
    if (!winner) return { hits, escape: now.r, light: throughput.map((value, i) => value * SKY[i]) };
    const n = facingNormal(winner, now.r);
    throughput = throughput.map((value, i) => value * linearOfSrgb(colors[winner.index][i] / 255));
    hits.push({ f: winner.f, index: winner.index, throughput });
    now = { C: plusTimes(winner.f, 1e-6, n), r: cosineDirection(n, random), forward: now.forward };
  }
  return { hits, escape: null, light: [0, 0, 0] };
}

/** One path, bounce by bounce. @param {Figure} fig */
export function buildPath(fig) {
  const { shared } = fig;
  let [seed, step] = [3, 9];
  const path = () => lightPath(shared, seed);
  addOutside(fig, {
    label: "A path of light from the camera, bounce by bounce", picksPixel: true,
    content: () => {
      const { hits, escape } = path();
      const points = [shared.numbers.C, ...hits.map(({ f }) => f)];
      if (escape) points.push(plusTimes(points[points.length - 1], 2.5 / lengthOf(escape), escape));
      const strokes = points.slice(1, step + 1).map((to, i) => ({ from: points[i], to, color: i ? "L" : "r", width: 3, arrow: true }));
      return { ...worldContent(fig), faded: 0.7, strokes, spots: hits.slice(0, step).map(({ f }, i) => ({ at: f, color: "t", text: String(i + 1) })) };
    },
  });
  const last = () => path().hits.length + (path().escape ? 1 : 0);
  fig.stepper({ last, get: () => Math.min(step, last()), set: (i) => { step = i; } });
  fig.button("Another path", () => {
    seed += 1;
    step = 9;
  });
  fig.readout(() => {
    const { hits, escape, light } = path();
    const lines = hits.slice(0, step).map(({ index, throughput }, i) => [`${i + 1}. ${shared.names[index]}: throughput ${throughput.map((value) => fixed(value, 3)).join(", ")}`]);
    return [...lines, step > hits.length ? [escape ? `The path reaches the sky (${SKY.map((value) => fixed(value)).join(", ")}). Throughput times sky: ${light.map((value) => fixed(value, 3)).join(", ")}` : "After 8 bounces the path is ended."] : [" "]];
  });
}

/** Running means of 2π cos θ for uniform directions: the irradiance of a sky with radiance 1, which is π. @param {number} seed @param {number} count */
export function runningMeans(seed, count) {
  const random = randomOf(seed);
  let sum = 0;
  return Array.from({ length: count }, (_, i) => {
    sum += 2 * Math.PI * random(); // cos θ of a uniform direction is uniform in 0..1
    return sum / (i + 1);
  });
}

/** The mean of random samples approaches the integral. @param {Figure} fig */
export function buildMean(fig) {
  let [count, seed] = [300, 1];
  fig.canvas({
    ratio: 0.5, label: "The mean of N samples approaches π",
    draw: (pen) => {
      const means = runningMeans(seed, count);
      const place = (/** @type {number} */ i, /** @type {number} */ value) => [40 + (i / (count - 1)) * (pen.width - 60), pen.height / 2 - (value - Math.PI) * (pen.height / 4)];
      const band = [1, -1].map((sign) => means.map((_, i) => place(i, Math.PI + (sign * Math.PI) / Math.sqrt(3 * (i + 1)))));
      drawLine(pen, [...band[0], ...band[1].reverse()], { color: "plane", width: 0, fill: "plane", close: true });
      drawLine(pen, [place(0, Math.PI), place(count - 1, Math.PI)], { color: "soft-ink", dash: [5, 5] });
      pen.label({ at: band[0][Math.floor(count / 3)], text: "expected error", color: pen.color("n") });
      pen.label({ at: place(0, Math.PI), text: "π", color: pen.color("soft-ink") });
      drawLine(pen, means.map((value, i) => place(i, Math.max(1, Math.min(5, value)))), { color: "r", width: 2 });
    },
  });
  fig.slider({ name: "samples N", min: 10, max: 3000, step: 10, digits: 0, get: () => count, set: (value) => { count = value; } });
  fig.button("Other random numbers", () => { seed += 1; });
  fig.readout(() => {
    const mean = runningMeans(seed, count)[count - 1];
    return [[["r", `mean of ${count} samples = ${fixed(mean, 6)}`], `    error ${fixed(mean - Math.PI, 4)}    expected error ${fixed(Math.PI / Math.sqrt(3 * count), 4)}`]];
  });
}
