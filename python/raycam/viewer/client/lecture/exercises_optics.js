// Exercises of chapters 17 to 21: lenses, videos, two cameras, calibration, and exactness.

import { areClose, triple } from "./answers.js";

/** @type {import("./answers.js").Exercise[]} */
export const OPTICS_EXERCISES = [
  {
    id: "distortion",
    title: "k₁ = −0.3. Without distortion, a point would appear at the distance 0.8 from the principal point. At which distance does it appear?",
    asked: ["distance"],
    given: () => ["d = 0.8, k₁ = −0.3"],
    answer: () => [0.6464],
    hint: ([value]) => {
      if (areClose([value], [0.9536])) return "The sign of k₁ is negative.";
      if (areClose([value], [0.608])) return "Square the distance: k₁ d².";
      if (areClose([value], [0.808])) return "This is 1 + k₁ d². Multiply it by d.";
      return "Put d = 0.8 and k₁ = −0.3 into d (1 + k₁ d²).";
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
    title: "Two cameras stand side by side: f = 300 pixels, B = 0.6 m, and the disparity δ is 45 pixels. What is the depth?",
    asked: ["depth (m)"],
    given: () => ["f = 300, B = 0.6, δ = 45"],
    answer: () => [4],
    hint: ([value]) => {
      if (areClose([value], [45 / 180])) return "The fraction is upside down.";
      if (areClose([value], [500])) return "Multiply f by B, do not divide.";
      return "Solve δ = f B / depth for the depth.";
    },
  },
  {
    id: "triangulate",
    title: "Two rays C + t r and C′ + t′ r′ pass each other. Solve the two equations for t and t′. What is the midpoint of the two closest points?",
    asked: triple("X"),
    given: () => [`C  = (0, 0, 0)      r  = (2, 1, 0)`, `C′ = (3, 0, 0.4)    r′ = (1, 2, 0)`],
    answer: () => [4, 2, 0.2],
    hint: (values) => {
      if (areClose(values, [4, 2, 0])) return "This is the closest point of the first ray, for t = 2. Take the mean with that of the second ray.";
      if (areClose(values, [4, 2, 0.4])) return "This is the closest point of the second ray, for t′ = 1. Take the mean with that of the first ray.";
      if (areClose(values, [8, 4, 0.4])) return "This is the sum of both points. Halve it.";
      return "The equations are 5 t − 4 t′ = 6 and 4 t − 5 t′ = 3.";
    },
  },
  {
    id: "points",
    title: "Eight points and their pixels are known. By how many does the number of equations exceed the number of unknowns of P?",
    asked: ["difference"],
    given: () => ["8 points"],
    answer: () => [5],
    hint: ([value]) => {
      if (areClose([value], [16])) return "This is the number of equations. Subtract the unknowns.";
      if (areClose([value], [4])) return "P has twelve numbers, but a common factor does not matter: eleven are unknown.";
      if (areClose([value], [-3])) return "Each point gives two equations, one for the column and one for the row.";
      return "Each point gives two equations, and P has eleven free numbers.";
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
