// Exercises of chapters 17 to 21: lenses, videos, two cameras, calibration, and exactness.

import { areClose } from "./answers.js";

/** @type {import("./answers.js").Exercise[]} */
export const OPTICS_EXERCISES = [
  {
    id: "distortion",
    title: "k₁ = −0.3. Without distortion, a point would appear at the distance 0.5 from the principal point. At which distance does it appear?",
    asked: ["distance"],
    given: () => ["r (1 + k₁ r²)"],
    answer: () => [0.4625],
    hint: ([value]) => {
      if (areClose([value], [0.5375])) return "The sign of k₁ is negative.";
      if (areClose([value], [0.425])) return "Square the distance: k₁ r².";
      return "Put r = 0.5 and k₁ = −0.3 into r (1 + k₁ r²).";
    },
  },
  {
    id: "rolling",
    title: "A camera moves sideways at 5 m/s. Its readout takes 0.03 s from the first row to the last, and f = 300 pixels. A pole that is 3 m away fills the height of the picture. By how many pixels is its lower end shifted relative to its upper end?",
    asked: ["shift"],
    given: () => ["speed 5 m/s, readout 0.03 s, f = 300 pixels, depth 3 m"],
    answer: () => [15],
    hint: ([value]) => {
      if (areClose([value], [0.15])) return "This is the movement m of the camera in metres. Multiply it by f and divide it by the depth.";
      if (areClose([value], [45])) return "This is f m. Divide it by the depth.";
      if (areClose([value], [500])) return "The camera moves during the readout only: multiply the speed by 0.03 s.";
      return "The camera moves by m = 5 · 0.03 during the readout. The shift is f m / depth.";
    },
  },
  {
    id: "frames",
    title: "How many frames does a video of one minute have at 24 frames per second?",
    asked: ["frames"],
    given: () => ["60 s, 24 frames per second"],
    answer: () => [1440],
    hint: ([value]) => {
      if (areClose([value], [2.5])) return "This is 60 / 24. Each second has 24 frames.";
      return "Multiply the seconds by the frames per second.";
    },
  },
  {
    id: "depth",
    title: "Two cameras stand side by side: f = 300 pixels, b = 0.6 m, and the disparity is 45 pixels. What is the depth?",
    asked: ["depth (m)"],
    given: () => ["d = f b / depth"],
    answer: () => [4],
    hint: ([value]) => {
      if (areClose([value], [45 / 180])) return "The fraction is upside down.";
      if (areClose([value], [500])) return "Multiply f by b, do not divide.";
      return "Solve d = f b / depth for the depth.";
    },
  },
  {
    id: "points",
    title: "How many equations do eight points give for the numbers of P?",
    asked: ["equations"],
    given: () => ["two equations for each point"],
    answer: () => [16],
    hint: ([value]) => {
      if (areClose([value], [8])) return "Each point gives an equation for u and one for v.";
      if (areClose([value], [24])) return "A pixel has two coordinates, u and v.";
      return "Each point gives two equations.";
    },
  },
  {
    id: "rounding",
    title: "A float32 number has 32 bits. They hold 24 binary digits, because the first digit is always 1 and is not stored. How large is the gap between 1 and the next larger number, as a power of two? Write the exponent",
    asked: ["exponent"],
    given: () => ["1 = 1.000…0 with 23 binary digits after the point"],
    answer: () => [-23],
    hint: ([value]) => {
      if (areClose([value], [23])) return "The gap is smaller than 1, so the exponent is negative.";
      if (areClose([value], [-24])) return "The first of the 24 bits stands before the point.";
      if (areClose([value], [-32])) return "Eight of the 32 bits hold the exponent and one holds the sign.";
      return "The last of the 23 digits after the point has the value 2 to the power of the exponent.";
    },
  },
];
