// Exercises of chapters 10 to 16: light, sampling, paths, and materials.

import { areClose } from "./answers.js";

/** @type {import("./answers.js").Exercise[]} */
export const LIGHT_EXERCISES = [
  {
    id: "bulb",
    title: "A bulb is 3 m away from a point on a surface. The angle θ between the normal and the direction to the bulb is 60°. What is the irradiance E?",
    asked: ["E (W/m²)"],
    given: () => ["I = 18 W/sr, d = 3 m, cos 60° = 0.5"],
    answer: () => [1],
    hint: ([value]) => {
      if (areClose([value], [2])) return "The factor cos θ is missing.";
      if (areClose([value], [6])) return "Divide by the square of the distance, and multiply by cos θ.";
      if (areClose([value], [3])) return "Divide by the square of the distance, not by the distance.";
      return "E = I cos θ / d².";
    },
  },
  {
    id: "radiance",
    title: "A sun with S = 4 W/m² in red shines on a diffuse surface with k = 0.5 in red, at 60° from the normal. Which radiance L does the pixel show in red? Give three digits",
    asked: ["L"],
    given: () => ["S = 4, k = 0.5, θ = 60°"],
    answer: () => [1 / Math.PI],
    hint: ([value]) => {
      if (areClose([value], [1])) return "The camera receives the light of one direction only: divide by π.";
      if (areClose([value], [Math.PI])) return "Divide by π: the reflectance of a diffuse surface is k / π.";
      if (areClose([value], [2 / Math.PI])) return "The factor cos θ is missing: the irradiance is E = S cos θ.";
      if (areClose([value], [(2 * Math.cos(60)) / Math.PI])) return "Your calculator uses radians: 60° is 1.0472.";
      if (areClose([value], [(2 * Math.sin(Math.PI / 3)) / Math.PI])) return "This contains sin 60°. The irradiance is E = S cos θ.";
      return "First E = S cos θ, then L = k / π · E.";
    },
  },
  {
    id: "blocker",
    title: "The second ray is f(t) + s (bulb − f(t)). It meets triangles at s = −0.4, s = 0.6 and s = 1.3. Which of these triangles casts a shadow on the point? Enter its s",
    asked: ["s"],
    given: () => ["the bulb is at s = 1"],
    answer: () => [0.6],
    hint: ([value]) => {
      if (areClose([value], [-0.4])) return "A negative s lies behind the point, away from the bulb.";
      if (areClose([value], [1.3])) return "This triangle is farther away than the bulb, so it blocks nothing.";
      return "A blocker lies between the point (s = 0) and the bulb (s = 1).";
    },
  },
  {
    id: "noise",
    title: "A picture with 16 samples has the noise 0.08. How many samples reduce it to 0.02?",
    asked: ["samples"],
    given: () => ["noise ~ 1/√N"],
    answer: () => [256],
    hint: ([value]) => {
      if (areClose([value], [64])) return "Four times the samples halve the noise. A quarter of the noise requires more.";
      if (areClose([value], [4])) return "Fewer samples mean more noise.";
      return "The noise must fall by a factor of 4, so N must grow by a factor of 4².";
    },
  },
  {
    id: "throughput",
    title: "A path bounces from diffuse surfaces whose colours are k = 0.9, 0.5 and 0.2 in red. What is its throughput in red?",
    asked: ["throughput"],
    given: () => ["0.9, 0.5, 0.2"],
    answer: () => [0.09],
    hint: ([value]) => {
      if (areClose([value], [1.6])) return "This is the sum. Each surface multiplies the throughput.";
      if (areClose([value], [1.6 / 3])) return "This is the mean. Each surface multiplies the throughput.";
      return "Multiply the three colours.";
    },
  },
  {
    id: "estimator",
    title: "One uniform direction of the hemisphere has cos θ = 0.7. Its density is p = 1/(2π). Which estimate of ∫ cos θ dω does this direction give?",
    asked: ["estimate"],
    given: () => ["cos θ / p"],
    answer: () => [1.4 * Math.PI],
    hint: ([value]) => {
      if (areClose([value], [0.7])) return "Divide by the density p.";
      if (areClose([value], [0.7 / (2 * Math.PI)])) return "This is cos θ · p. Divide by p.";
      if (areClose([value], [Math.PI])) return "This is the expected value, not the estimate of this direction.";
      return "Divide cos θ by p: multiply by 2π.";
    },
  },
  {
    id: "snell",
    title: "Light enters glass with the index 1.5 at sin θ = 0.6. What is the sine of the angle inside? (Snell: sin θ = 1.5 sin θ′)",
    asked: ["sin θ′"],
    given: () => ["sin θ = 0.6, index 1.5"],
    answer: () => [0.4],
    hint: ([value]) => {
      if (areClose([value], [0.9])) return "Inside, the light is closer to the normal: divide by 1.5.";
      return "Divide sin θ by the index.";
    },
  },
];
