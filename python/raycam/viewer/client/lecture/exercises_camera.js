// Exercises of chapters 1 to 5: points, edges, the camera matrix, and the ray of a pixel.

import { general, vectorText } from "../core/explanation.js";
import { pixelOf, rayOfPixel } from "../core/steps.js";
import { dot, lengthOf, minus, rowOf } from "../core/vectors.js";
import { areClose, rowsOf, triple } from "./answers.js";
import { rotationOf } from "./camera.js";

/** @type {import("./answers.js").Exercise[]} */
export const CAMERA_EXERCISES = [
  {
    id: "walk",
    title: "A vertex c is moved by 0.5 along x and by −0.2 along z. Where is it now?",
    asked: triple("c"),
    given: ({ corners }) => [`c = ${vectorText(corners[2])}`],
    answer: ({ corners }) => corners[2].map((value, i) => value + [0.5, 0, -0.2][i]),
    hint: (values, { corners: [, , c] }) => {
      if (areClose(values, c.map((value, i) => value + [0.5, -0.2, 0][i]))) return "The second number is y. The walk of −0.2 is along z, the third number.";
      if (areClose(values, c.map((value, i) => value + [0.5, 0, 0.2][i]))) return "The walk along z is negative: downward.";
      return "Add 0.5 to the first number, and −0.2 to the third.";
    },
  },
  {
    id: "edges",
    title: "The edge vector v₁ = b − a of a triangle",
    asked: triple("v₁"),
    given: ({ corners }) => corners.slice(0, 2).map((corner, i) => `${"ab"[i]} = ${vectorText(corner)}`),
    answer: ({ corners }) => minus(corners[1], corners[0]),
    hint: (values, { corners: [a, b] }) => {
      if (areClose(values, minus(a, b))) return "This is a − b, from b to a. The edge vector points from a to b.";
      if (areClose(values, a.map((value, i) => value + b[i]))) return "This is a + b. An edge vector is a difference.";
      return "Subtract each coordinate of a from the same coordinate of b.";
    },
  },
  {
    id: "refined",
    title: "A mesh of 20 triangles is refined 3 times. How many triangles does it have?",
    asked: ["triangles"],
    given: () => ["Each refinement splits a triangle into four."],
    answer: () => [1280],
    hint: ([count]) => {
      if (count === 240) return "This is 20 · 4 · 3. Each refinement multiplies by four: 20 · 4 · 4 · 4.";
      if (count === 320) return "This is the number after two refinements.";
      return "Multiply 20 by four, three times.";
    },
  },
  {
    id: "project",
    title: "The pixel (column, row) of a vertex: x = P X, with 1 appended to X",
    asked: ["column", "row"],
    given: ({ P, corners }) => ["P =", ...rowsOf(P, 4), `X = c = ${vectorText(corners[2])}`],
    answer: ({ P, corners }) => {
      const { u, v } = pixelOf(P, corners[2]);
      return [u, v];
    },
    hint: (values, { P, corners: [, , X] }) => {
      const { u, v } = pixelOf(P, X);
      if (areClose(values, [v, u])) return "These are the row and the column: the column comes first.";
      const x = [0, 1].map((i) => P[4 * i] * X[0] + P[4 * i + 1] * X[1] + P[4 * i + 2] * X[2] + P[4 * i + 3]);
      if (areClose(values, x)) return "These are the first two numbers of P (X, 1). Divide them by the third.";
      return "Append 1 to X, multiply by the three rows of P, and divide the first two numbers by the third.";
    },
  },
  {
    id: "principal",
    title: "A camera has the yaw 120°, the pitch 30° and the roll 45°. Compute the third row of R, the vector v",
    asked: triple("v"),
    given: () => ["cos 120° = −0.5, sin 120° = 0.8660, cos 30° = 0.8660, sin 30° = 0.5"],
    answer: () => rowOf(rotationOf(45, 30, 120), 2),
    hint: (values) => {
      const [x, y, z] = rowOf(rotationOf(45, 30, 120), 2);
      if (areClose(values, [x, y, -z])) return "A positive pitch turns the camera down: the third number is −sin pitch.";
      if (areClose(values, [y, x, z])) return "The first two numbers are in the wrong order: x contains the cosine of the yaw.";
      if (areClose(values, [-0.5, Math.sqrt(0.75), -0.5])) return "Multiply cos yaw and sin yaw by cos pitch.";
      return "v = (cos yaw · cos pitch, sin yaw · cos pitch, −sin pitch). The roll does not matter.";
    },
  },
  {
    id: "line",
    title: "A point of the pixel's line: X' = P⁺ x. Every point of the line except C is accepted. On paper, choose z = 0: (first number of P (X', 1)) = column · (third number) and (second number) = row · (third number) are two linear equations for the first two coordinates of X'",
    asked: triple("X'"),
    given: ({ P, pixel }) => ["P =", ...rowsOf(P, 4), `x = (${general(pixel[0])}, ${general(pixel[1])}, 1)`],
    answer: ({ ray }) => /** @type {number[]} */ (ray.XPrime),
    other: (values, { P, pixel, ray }) => {
      const { u, v } = pixelOf(P, values);
      const isThere = Math.hypot(u - pixel[0], v - pixel[1]) < 0.05 && lengthOf(minus(values, ray.C)) > 1e-3 * lengthOf(ray.C);
      return isThere ? "Your point differs from P⁺ x, but it is visible at the same pixel, so it is also correct." : "";
    },
    hint: (values, { P, pixel, ray }) => {
      if (areClose(values, ray.X.slice(0, 3))) return "These are the first three of four homogeneous numbers: divide them by the fourth.";
      if (areClose(values, ray.C)) return "This is C, the camera's centre: it lies on the line, but a second point is needed.";
      if (areClose(values, rayOfPixel(P, pixel[1], pixel[0]).XPrime || [])) return "This is the line of the pixel (row, column): the column comes first.";
      const { u, v } = pixelOf(P, values);
      return `The image of your point is (${general(u)}, ${general(v)}). P⁺ = Pᵀ (P Pᵀ)⁻¹; divide P⁺ x by its fourth number.`;
    },
  },
  {
    id: "forward",
    title: "Somebody chose the point X' below on the line of the last exercise. Is it in front of the camera? Enter the dot product v·(X' - C) and the direction r",
    asked: ["v·(X' - C)", ...triple("r")],
    given: ({ R, ray, behind }) => ["R =", ...rowsOf(R, 3), `X' = ${vectorText(behind)}`, `C = ${vectorText(ray.C)}`],
    answer: ({ ray, behind }) => [dot(ray.forward, minus(behind, ray.C)), ...ray.r],
    hint: (values, { R, ray, behind }) => {
      const line = minus(behind, ray.C);
      const along = dot(ray.forward, line);
      if (areClose(values.slice(0, 1), [along])) return "The dot product is right. It is negative, so X' is behind the camera, and r = C - X'.";
      if (areClose(values.slice(0, 1), [-along])) return "The sign is wrong: take X' - C, not C - X'.";
      if ([0, 1].some((i) => areClose(values.slice(0, 1), [dot(rowOf(R, i), line)]))) return "This is the product with another row of R. The vector v is the third row.";
      return "v is the third row of R, and v·(X' - C) is the sum of the products of the components.";
    },
  },
];
