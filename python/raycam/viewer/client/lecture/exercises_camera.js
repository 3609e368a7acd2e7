// Exercises of chapters 1 to 5: points, edges, the camera matrix, and the ray of a pixel.

import { general, vectorText } from "../core/explanation.js";
import { pixelOf, rayOfPixel } from "../core/steps.js";
import { lengthOf, minus, rowOf } from "../core/vectors.js";
import { areClose, negated, rowsOf, triple } from "./answers.js";

/** @type {import("./answers.js").Exercise[]} */
export const CAMERA_EXERCISES = [
  {
    id: "walk",
    title: "The corner c of the green triangle is moved by 0.5 along x and by −0.2 along z. Where is it now?",
    asked: triple("c"),
    given: ({ numbers }) => [`c = ${vectorText(numbers.triangles[0].corners[2])}`],
    answer: ({ numbers }) => numbers.triangles[0].corners[2].map((value, i) => value + [0.5, 0, -0.2][i]),
    hint: (values, { numbers }) => {
      const c = numbers.triangles[0].corners[2];
      if (areClose(values, c.map((value, i) => value + [0.5, -0.2, 0][i]))) return "The second number is y. The walk of −0.2 is along z, the third number.";
      if (areClose(values, c.map((value, i) => value + [0.5, 0, 0.2][i]))) return "The walk along z is negative: downward.";
      return "Add 0.5 to the first number, and −0.2 to the third.";
    },
  },
  {
    id: "edges",
    title: "The edge vector v₁ = b − a of the green triangle",
    asked: triple("v₁"),
    given: ({ numbers }) => numbers.triangles[0].corners.slice(0, 2).map((corner, i) => `${"ab"[i]} = ${vectorText(corner)}`),
    answer: ({ numbers }) => minus(numbers.triangles[0].corners[1], numbers.triangles[0].corners[0]),
    hint: (values, { numbers }) => {
      const [a, b] = numbers.triangles[0].corners;
      if (areClose(values, minus(a, b))) return "This is a − b, from b to a. The edge vector points from a to b.";
      if (areClose(values, a.map((value, i) => value + b[i]))) return "This is a + b. An edge vector is a difference.";
      return "Subtract each coordinate of a from the same coordinate of b.";
    },
  },
  {
    id: "refined",
    title: "A mesh of 14 triangles is refined 3 times. How many triangles does it have?",
    asked: ["triangles"],
    given: () => ["Each refinement splits a triangle into four."],
    answer: () => [896],
    hint: ([count]) => {
      if (count === 168) return "This is 14 · 4 · 3. Each refinement multiplies by four: 14 · 4 · 4 · 4.";
      if (count === 224) return "This is the number after two refinements.";
      return "Multiply 14 by four, three times.";
    },
  },
  {
    id: "project",
    title: "The pixel (column u, row v) of a vertex: x = P X, with 1 appended to X",
    asked: ["u", "v"],
    given: ({ P, numbers }) => ["P =", ...rowsOf(P, 4), `X = c = ${vectorText(numbers.triangles[0].corners[2])}`],
    answer: ({ P, numbers }) => {
      const { u, v } = pixelOf(P, numbers.triangles[0].corners[2]);
      return [u, v];
    },
    hint: (values, { P, numbers }) => {
      const X = numbers.triangles[0].corners[2];
      const { u, v } = pixelOf(P, X);
      if (areClose(values, [v, u])) return "These are v and u: the column u comes first.";
      const x = [0, 1].map((i) => P[4 * i] * X[0] + P[4 * i + 1] * X[1] + P[4 * i + 2] * X[2] + P[4 * i + 3]);
      if (areClose(values, x)) return "These are the first two numbers of P (X, 1). Divide them by the third.";
      return "Append 1 to X, multiply by the three rows of P, and divide the first two numbers by the third.";
    },
  },
  {
    id: "principal",
    title: "Which row of R does the roll leave unchanged? Enter the three numbers of this row, the vector v",
    asked: triple("v"),
    given: ({ R }) => ["R =", ...rowsOf(R, 3)],
    answer: ({ ray }) => ray.forward,
    hint: (values, { R }) => {
      const row = [0, 1].find((i) => areClose(values, rowOf(R, i)));
      if (row !== undefined) return `This is row ${row + 1}, the ${["right", "down"][row]} axis. A roll turns it.`;
      if (areClose(values, [R[2], R[5], R[8]])) return "This is the third column. The camera's axes are the rows of R.";
      return "The principal axis is the third row of R.";
    },
  },
  {
    id: "line",
    title: "A point of the pixel's line: X' = P⁺ x. Every point of the line except C is accepted. On paper, choose z = 0: (first number of P (X', 1)) = u · (third number) and (second number) = v · (third number) are two linear equations for the first two coordinates of X'",
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
      if (areClose(values, rayOfPixel(P, pixel[1], pixel[0]).XPrime || [])) return "This is the line of the pixel (v, u): x is (u, v, 1), the column first.";
      const { u, v } = pixelOf(P, values);
      return `Your point is visible at (${general(u)}, ${general(v)}). P⁺ = Pᵀ (P Pᵀ)⁻¹; divide P⁺ x by its fourth number.`;
    },
  },
  {
    id: "forward",
    title: "Compute whether X' is in front of the camera: enter v, the third row of R, and the dot product v·(X' - C)",
    asked: [...triple("v"), "v·(X' - C)"],
    given: ({ R, ray }) => ["R =", ...rowsOf(R, 3), `X' = ${vectorText(/** @type {number[]} */ (ray.XPrime))}`, `C = ${vectorText(ray.C)}`],
    answer: ({ ray }) => [...ray.forward, ray.along],
    hint: (values, { R, ray }) => {
      const v = values.slice(0, 3);
      if (areClose(v, negated(ray.forward))) return "Your v points backward. Use the third row of R without changing its sign.";
      const row = [0, 1].find((i) => areClose(v, rowOf(R, i)));
      if (row !== undefined) return `This is row ${row + 1} of R. The principal axis is the third row.`;
      if (areClose(v, [R[2], R[5], R[8]])) return "This is the third column of R. The principal axis is the third row.";
      if (!areClose(v, ray.forward)) return "v is the third row of R.";
      if (areClose([values[3]], [-ray.along])) return "v is right; the sign is not: take X' - C, not C - X'.";
      return "v is right. v·(X' - C) is the sum of the products of their components.";
    },
  },
];
