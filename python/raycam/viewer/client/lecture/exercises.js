// Typed exercises: given and requested numbers, and hints that recognize common mistakes. Answers come from steps.js.

import { vectorText, general } from "../core/explanation.js";
import { dot, lengthOf, minus, rowOf } from "../core/vectors.js";
import { pixelOf, rangesOf, rayOfPixel } from "../core/steps.js";

/**
 * @typedef {object} Facts what the page knows of the pixel
 * @property {number[]} P
 * @property {number[]} R
 * @property {number[]} pixel u, v in pixel coordinates
 * @property {import("../core/steps.js").PixelRay} ray
 * @property {import("../core/steps.js").Candidate} found
 * @property {import("./world.js").Numbers} numbers
 */
/** @typedef {{ right: boolean, text: string }} Verdict */
/**
 * @typedef {object} Exercise
 * @property {string} id
 * @property {string} title
 * @property {string[]} asked the names of the numbers
 * @property {(facts: Facts) => string[]} given lines
 * @property {(facts: Facts) => number[]} answer
 * @property {(values: number[], facts: Facts) => string} hint to a wrong answer
 * @property {((values: number[], facts: Facts) => string)} [other] why another answer is right too; empty where it is not
 */

/** The share of the largest number that an answer may be off. */
export const TOLERANCE = 1e-3;

/** True if numbers are the same within the tolerance. @param {number[]} values @param {number[]} right */
const areClose = (values, right) => {
  const off = TOLERANCE * Math.max(...right.map(Math.abs), 1e-9);
  return values.length === right.length && values.every((value, i) => Math.abs(value - right[i]) <= off);
};
const negated = (/** @type {number[]} */ values) => values.map((value) => -value);
const triple = (/** @type {string} */ name) => ["x", "y", "z"].map((axis) => `${name} ${axis}`);
const rowsOf = (/** @type {number[]} */ m, /** @type {number} */ columns) =>
  Array.from({ length: m.length / columns }, (_, i) => `  [${m.slice(columns * i, columns * (i + 1)).map(general).join(", ")}]`);
const cornersText = (/** @type {Facts} */ { found }) => found.corners.map((corner, i) => `${"abc"[i]} = ${vectorText(corner)}`);

/** @type {Exercise[]} */
export const EXERCISES = [
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
    title: "The pixel of a vertex: x = P X",
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
    title: "A point of the pixel's line: X' = P⁺ x",
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
      return `Your point is seen at (${general(u)}, ${general(v)}). P⁺ = Pᵀ (P Pᵀ)⁻¹; divide P⁺ x by its fourth number.`;
    },
  },
  {
    id: "forward",
    title: "Is X' in front of the camera? Enter v, the third row of R, and the dot product v·(X' - C)",
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
  {
    id: "normal",
    title: "The plane of the triangle: n = (c - a) x (b - a)",
    asked: triple("n"),
    given: cornersText,
    answer: ({ found }) => found.n,
    hint: (values, { found }) => {
      if (areClose(values, negated(found.n))) return "This is (b - a) x (c - a): the order turns the sign.";
      const [length, own] = [lengthOf(values), lengthOf(found.n)];
      const cosine = dot(values, found.n) / (length * own || 1);
      if (Math.abs(cosine) > 1 - 1e-5) return `The direction is right, the length is not: ${general(length)}, not ${general(own)}. n is the cross product as it is.`;
      const off = [found.edges[0], found.edges[2]].map((edge) => Math.abs(dot(values, edge)) / (length * lengthOf(edge) || 1));
      return `n must be perpendicular to both edges. Your n gives n·(b - a) = ${general(dot(values, found.edges[0]))}, ${off[0] > 1e-3 ? "but it must be 0" : "which is right, but n·(c - a) is not 0"}.`;
    },
  },
  {
    id: "distance",
    title: "The ray meets the plane: t = n·(a - C) / n·r",
    asked: ["t"],
    given: ({ ray, found }) => [`C = ${vectorText(ray.C)}`, `r = ${vectorText(ray.r)}`, `a = ${vectorText(found.corners[0])}`, `n = ${vectorText(found.n)}`],
    answer: ({ found }) => [found.t],
    hint: ([t], { ray, found }) => {
      if (areClose([t], [-found.t])) return "The absolute value is right, but the sign is wrong: the numerator is n·(a - C), not n·(C - a).";
      if (areClose([t], [1 / found.t])) return "This is n·r / n·(a - C): upside down.";
      if (areClose([t], [found.above])) return "This is n·(a - C): divide it by n·r.";
      if (areClose([t], [rangesOf(ray, found.t).distance])) return "This is the distance t |r|: t counts lengths of r.";
      if (areClose([t], [rangesOf(ray, found.t).depth])) return "This is the depth t (v·r): t counts lengths of r.";
      return `n·(a - C) = ${general(found.above)}. Divide it by n·r.`;
    },
  },
  {
    id: "crossings",
    title: "Inside or outside: how many edges does u cross?",
    asked: ["crossings"],
    given: (facts) => [
      ...cornersText(facts),
      `f(t) = ${vectorText(facts.found.f)}`,
      `g = a + v3 = ${vectorText(facts.found.g)}`,
      `u = g - f(t) = ${vectorText(facts.found.u)}`,
    ],
    answer: ({ found }) => [found.crossings],
    hint: ([count], { found }) => {
      if (![0, 1, 2, 3].includes(count)) return "There are three edges: count those that u crosses, 0 to 3.";
      const i = found.crossed.findIndex((crossed) => (count < found.crossings ? crossed : !crossed));
      const numbers = Number.isNaN(found.alongU[i]) ? "it is parallel to u" : `s = ${general(found.alongU[i])} along u and q = ${general(found.alongEdge[i])} along the edge`;
      return `Look at v${i + 1} again: ${numbers}. It is crossed when both lie between 0 and 1.`;
    },
  },
  {
    id: "hit",
    title: "The point that the pixel shows: f(t) = C + t r",
    asked: triple("f"),
    given: ({ ray, found }) => [`C = ${vectorText(ray.C)}`, `r = ${vectorText(ray.r)}`, `t = ${general(found.t)}`],
    answer: ({ found }) => found.f,
    hint: (values, { ray, found }) => {
      if (areClose(values, ray.r.map((value) => value * found.t))) return "This is t r. Add C, where the ray begins.";
      if (areClose(values, ray.C.map((value, i) => value - found.t * ray.r[i]))) return "This is C − t r, a point behind the camera.";
      return "Multiply each coordinate of r by t and add the coordinate of C.";
    },
  },
  {
    id: "halving",
    title: "A tree halves 1024 triangles until each leaf holds one. How many levels of boxes lie below the root?",
    asked: ["levels"],
    given: () => ["1024 = 2 · 2 · … · 2"],
    answer: () => [10],
    hint: ([levels]) => {
      if (levels === 512) return "This is the number of triangles after one halving.";
      if (levels === 9 || levels === 11) return "Count the halvings: 1024, 512, 256, 128, 64, 32, 16, 8, 4, 2, 1.";
      return "How often can you halve 1024 until 1 is left?";
    },
  },
  {
    id: "bulb",
    title: "A bulb is 2 m away from a point on a surface. The angle θ between the normal and the direction to the bulb is 60°. What is the irradiance E?",
    asked: ["E (W/m²)"],
    given: () => ["I = 14 W/sr, d = 2, cos 60° = 0.5"],
    answer: () => [1.75],
    hint: ([value]) => {
      if (areClose([value], [3.5])) return "The factor cos θ is missing.";
      if (areClose([value], [3.5 * 2])) return "Divide by the square of the distance, and multiply by cos θ.";
      if (areClose([value], [14 * 0.5 / 2])) return "Divide by the square of the distance, not by the distance.";
      return "E = I cos θ / d².";
    },
  },
  {
    id: "cosine",
    title: "How much of the light does a diffuse surface receive if the light arrives at 60° from the normal? Write the share",
    asked: ["share"],
    given: () => ["cos 60°"],
    answer: () => [0.5],
    hint: ([value]) => {
      if (areClose([value], [Math.cos(60)])) return "Your calculator uses radians: 60° is 1.0472.";
      if (areClose([value], [Math.sin(Math.PI / 3)])) return "This is sin 60°. The share is the cosine of the angle from the normal.";
      return "The share is cos θ.";
    },
  },
  {
    id: "noise",
    title: "A picture with 16 samples has the noise 0.08. How many samples reduce it to 0.02?",
    asked: ["samples"],
    given: () => ["noise ~ 1/√n"],
    answer: () => [256],
    hint: ([value]) => {
      if (areClose([value], [64])) return "Four times the samples halve the noise. A quarter of the noise requires more.";
      if (areClose([value], [4])) return "Fewer samples mean more noise.";
      return "The noise must fall by a factor of 4, so n must grow by 4².";
    },
  },
  {
    id: "throughput",
    title: "A path bounces from surfaces with the red reflectances 0.9, 0.5 and 0.2. What is its throughput in red?",
    asked: ["throughput"],
    given: () => ["0.9, 0.5, 0.2"],
    answer: () => [0.09],
    hint: ([value]) => {
      if (areClose([value], [1.6])) return "This is the sum. Each surface multiplies the throughput.";
      if (areClose([value], [1.6 / 3])) return "This is the mean. Each surface multiplies the throughput.";
      return "Multiply the three reflectances.";
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
    id: "distortion",
    title: "k₁ = −0.3. At which distance does the image of a point at distance 0.5 from the axis appear?",
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
    title: "f = 300 pixels, b = 0.6, and the disparity is 45 pixels. What is the depth?",
    asked: ["depth"],
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
    title: "float32 has 24 bits. How large is the gap between 1 and the next larger number, as a power of two? Write the exponent",
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
  {
    id: "walk",
    title: "The vertex c of the green triangle is moved by 0.5 along x and by −0.2 along z. Where is it now?",
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
    id: "blocker",
    title: "The second ray is f(t) + s (bulb − f(t)). It meets triangles at s = −0.4, s = 0.6 and s = 1.3. Which s puts the point in the shadow?",
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

/**
 * The verdict on a student's texts, with a hint to a wrong one.
 * @param {string} id of the exercise
 * @param {string[]} texts
 * @param {Facts} facts
 * @returns {Verdict}
 */
export function verdictOn(id, texts, facts) {
  const exercise = /** @type {Exercise} */ (EXERCISES.find((each) => each.id === id));
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
  return areClose(values.slice(0, 3), answer.slice(0, 3)) && areClose(values.slice(3), answer.slice(3));
}
