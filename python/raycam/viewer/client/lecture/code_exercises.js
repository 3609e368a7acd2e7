// The functions that a student writes: each has first lines, test cases with the results of steps.js, and hints on
// common mistakes.

import { lengthOf } from "../core/vectors.js";
import { rayOfPixel, stepsOf, triangleSteps } from "../core/steps.js";
import { cameraOf } from "./camera.js";
import { cornersOf, firstNumbers } from "./world.js";

/**
 * @typedef {object} CodeExercise
 * @property {string} id also the function's name
 * @property {string} task
 * @property {string} start
 * @property {() => { given: any[], expected: any }[]} cases
 * @property {(got: any, expected: any, given: any[]) => string} hint
 */

/** Functions that every cell has. */
export const HELPERS = `const dot = (p, q) => p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
 const cross = (p, q) => [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
 const add = (p, q) => p.map((value, i) => value + q[i]);
 const sub = (p, q) => p.map((value, i) => value - q[i]);
 const scale = (s, p) => p.map((value) => s * value);
`;

const PIXELS = [[170, 165], [60, 120], [100, 30], [250, 200], [185, 170], [210, 90], [30, 230], [140, 110]];

/** The world of the code cells: the page's initial world. */
function codeWorld() {
  const numbers = firstNumbers();
  return { corners: cornersOf(numbers), camera: cameraOf(numbers) };
}

/** The triangles of the code cells with the rays of some pixels. */
function candidates() {
  const { corners, camera } = codeWorld();
  return PIXELS.flatMap(([u, v]) => {
    const ray = rayOfPixel(camera.P, u, v);
    return [0, 1, 3, 5, 9, 14, 15].map((index) => ({ ray, found: triangleSteps(corners, index, ray) }));
  });
}

/** True for equal values, numbers within rounding. @param {any} got @param {any} expected @returns {boolean} */
export function isSame(got, expected) {
  if (Array.isArray(expected)) return Array.isArray(got) && got.length === expected.length && expected.every((each, i) => isSame(got[i], each));
  if (typeof expected === "number") return typeof got === "number" && (Object.is(got, expected) || Math.abs(got - expected) <= 1e-9 * Math.max(1, Math.abs(expected)));
  return got === expected;
}

const turned = (/** @type {number[]} */ values) => values.map((value) => -value);

/** @type {CodeExercise[]} */
export const CODE_EXERCISES = [
  {
    id: "pointForward",
    task: "Return r: X′ − C, or C − X′ if X′ lies behind the camera. v is the third row of R.",
    start: "function pointForward(X, C, v) {\n  // X is X′\n  return sub(X, C);\n}\n",
    cases: () => [0, 90, 118, 200, 290].flatMap((yaw) => PIXELS.slice(0, 4).map(([u, v]) => {
      const ray = rayOfPixel(cameraOf({ ...firstNumbers(), yaw }).P, u, v);
      return { given: [ray.XPrime, ray.C, ray.forward], expected: ray.r };
    })),
    hint: (got, expected) => (Array.isArray(got) && isSame(got, turned(expected)) ? "This ray points backward. Test the sign of dot(v, sub(X, C))." : "The result must be X′ − C or C − X′."),
  },
  {
    id: "normal",
    task: "Return the triangle's normal n = (c − a) × (b − a).",
    start: "function normal(a, b, c) {\n  return [0, 0, 1];\n}\n",
    cases: () => candidates().slice(0, 7).map(({ found }) => ({ given: found.corners, expected: found.n })),
    hint: (got, expected) => {
      if (Array.isArray(got) && isSame(got, turned(expected))) return "This is (b − a) × (c − a). The other order changes the sign.";
      if (Array.isArray(got) && isSame(got.map((value) => value * lengthOf(expected)), expected)) return "The direction is right. Do not divide by the length: n is the cross product itself.";
      return "Use cross(sub(c, a), sub(b, a)).";
    },
  },
  {
    id: "planeT",
    task: "Return t = n · (a − C) / (n · r).",
    start: "function planeT(n, a, C, r) {\n  return 1;\n}\n",
    cases: () => candidates().map(({ ray, found }) => ({ given: [found.n, found.corners[0], ray.C, ray.r], expected: found.t })),
    hint: (got, expected) => {
      if (isSame(got, -expected)) return "The sign is wrong: the numerator is n · (a − C), not n · (C − a).";
      return isSame(got, 1 / expected) ? "The fraction is upside down." : "Divide dot(n, sub(a, C)) by dot(n, r).";
    },
  },
  {
    id: "isInside",
    task: "Return true if f lies inside the triangle: u = g − f crosses an odd number of edges. n is the normal. In the code, start and end are the ends of an edge, measured from f. If one of them lies to the left of u and the other does not, the edge meets the line of the walk at m = start + q (end − start). The side dot(left, ·) changes linearly from sideStart to sideEnd along the edge, so it is 0 at q = sideStart / (sideStart − sideEnd). The point m, too, is measured from f, so m = s u and s = (m · u) / (u · u).",
    start: `function isInside(a, b, c, n, f) {
  const g = add(a, sub(a, c)); // a + v3
  const u = sub(g, f);
  // dot(left, x) > 0: the point f + x is on the left of u
  const left = cross(n, u);
  const corners = [a, b, c];
  let crossings = 0;
  for (let i = 0; i < 3; i++) {
    const start = sub(corners[i], f), end = sub(corners[(i + 1) % 3], f);
    const sideStart = dot(left, start), sideEnd = dot(left, end);
    // Add 1 if one end lies to the left of u, the other
    // does not, and s lies between 0 and 1.
  }
  return crossings % 2 === 1;
}
`,
    cases: () => candidates().filter(({ found }) => found.t > 0).map(({ found }) => ({ given: [...found.corners, found.n, found.f], expected: found.inside })),
    hint: (got, expected) => {
      if (typeof got !== "boolean") return "Return true or false.";
      return expected ? "A point inside was reported as outside: is its one crossing counted?" : "A point outside was reported as inside: count only intersections between f and g, with s from 0 to 1.";
    },
  },
  {
    id: "closest",
    task: "Return the index of the closest triangle that the ray hits, or −1. triangles is a list of [a, b, c]. Use your functions normal, planeT and isInside.",
    start: "function closest(triangles, C, r) {\n  let best = -1, bestT = Infinity;\n  for (let i = 0; i < triangles.length; i++) {\n    const [a, b, c] = triangles[i];\n    // normal, planeT, isInside\n  }\n  return best;\n}\n",
    cases: () => {
      const { corners, camera } = codeWorld();
      const triangles = Array.from({ length: corners.length / 9 }, (_, i) => [0, 3, 6].map((k) => corners.slice(9 * i + k, 9 * i + k + 3)));
      return PIXELS.map(([u, v]) => {
        const ray = rayOfPixel(camera.P, u, v);
        return { given: [triangles, ray.C, ray.r], expected: stepsOf(ray, corners).winner?.index ?? -1 };
      });
    },
    hint: (got, expected) => {
      if (got === -1) return "A triangle was hit, but the result is −1.";
      return typeof got === "number" && expected >= 0 ? `Triangle ${got} was returned, but triangle ${expected} is closer. Compare t, and skip negative t.` : "Return a number, and −1 if no triangle is hit.";
    },
  },
];
