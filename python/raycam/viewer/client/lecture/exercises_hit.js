// Exercises of chapters 6 to 9: the plane, inside or outside, the closest hit, and the tree.

import { general, vectorText } from "../core/explanation.js";
import { rangesOf } from "../core/steps.js";
import { dot, lengthOf, plusTimes } from "../core/vectors.js";
import { areClose, earlier, negated, triple } from "./answers.js";

const cornersText = (/** @type {Pick<import("./answers.js").Facts, "found">} */ { found }) => found.corners.map((corner, i) => `${"abc"[i]} = ${vectorText(corner)}`);

/** The axis along which a normal is longest. @param {number[]} n */
const mainAxis = (n) => n.map(Math.abs).indexOf(Math.max(...n.map(Math.abs)));

/** A ray; PLANES has t and the number of crossings for each plane that the ray meets. */
const OTHER_RAY = { C: [0, -2, 1], r: [1, 4, -0.5] };
const PLANES = [[0.9, 1], [-0.3, 1], [0.4, 1], [0.2, 2]];
const onOtherRay = (/** @type {number} */ t) => plusTimes(OTHER_RAY.C, t, OTHER_RAY.r);

/** @type {import("./answers.js").Exercise[]} */
export const HIT_EXERCISES = [
  {
    id: "normal",
    title: "The normal of a triangle's plane: n = (c - a) x (b - a)",
    asked: triple("n"),
    given: cornersText,
    answer: ({ found }) => found.n,
    hint: (values, { found }) => {
      if (areClose(values, negated(found.n))) return "This is (b - a) x (c - a): the other order changes the sign.";
      const [length, own] = [lengthOf(values), lengthOf(found.n)];
      const cosine = dot(values, found.n) / (length * own || 1);
      if (Math.abs(cosine) > 1 - 1e-5) return `The direction is right, the length is not: ${general(length)}, not ${general(own)}. n is the cross product as it is.`;
      const off = [found.edges[0], found.edges[2]].map((edge) => Math.abs(dot(values, edge)) / (length * lengthOf(edge) || 1));
      return `n must be perpendicular to both edges. Your n gives n·(b - a) = ${general(dot(values, found.edges[0]))}, ${off[0] > 1e-3 ? "but it must be 0" : "which is right, but n·(c - a) is not 0"}.`;
    },
  },
  {
    id: "distance",
    title: "The ray from the chapter “The ray of a pixel” meets this plane: t = n·(a - C) / n·r",
    asked: ["t"],
    given: ({ ray, found }, isSolved) => [
      `C = ${vectorText(ray.C)}`,
      earlier(isSolved("forward"), "r", vectorText(ray.r), "The ray of a pixel"),
      `a = ${vectorText(found.corners[0])}`,
      earlier(isSolved("normal"), "n", vectorText(found.n), "The plane of a triangle"),
    ],
    answer: ({ found }) => [found.t],
    hint: ([t], { ray, found }) => {
      if (areClose([t], [-found.t])) return "The absolute value is right, but the sign is wrong: the numerator is n·(a - C), not n·(C - a).";
      if (areClose([t], [1 / found.t])) return "This is n·r / n·(a - C): upside down.";
      if (areClose([t], [found.above])) return "This is n·(a - C): divide it by n·r.";
      if (areClose([t], [rangesOf(ray, found.t).distance])) return "This is the distance t |r|: t is measured in lengths of r.";
      if (areClose([t], [rangesOf(ray, found.t).depth])) return "This is the depth t (v·r), the distance along the principal axis. But t is measured in lengths of r.";
      return `n·(a - C) = ${general(found.above)}. Divide it by n·r.`;
    },
  },
  {
    id: "crossings",
    title: "The ray meets the triangle's plane at f(t). How many edges does u = g - f(t) cross, with g = a + v₃?",
    asked: ["crossings"],
    given: (facts) => [
      ...cornersText(facts),
      `f(t) = ${vectorText(facts.found.f)}`,
      `Leave out ${"xyz"[mainAxis(facts.found.n)]} and draw the other two coordinates: the crossings are the same, because this coordinate of n is not 0: the triangle does not become a line.`,
    ],
    answer: ({ found }) => [found.crossings],
    hint: ([count], { found }) => {
      if (![0, 1, 2, 3].includes(count)) return "There are three edges: count those that u crosses, 0 to 3.";
      const i = found.crossed.findIndex((crossed) => (count < found.crossings ? crossed : !crossed));
      const numbers = Number.isNaN(found.alongU[i]) ? "it is parallel to u" : `s = ${general(found.alongU[i])} along u and q = ${general(found.alongEdge[i])} along the edge`;
      return `Look at v${i + 1} again: ${numbers}. It is crossed if both lie between 0 and 1.`;
    },
  },
  {
    id: "hit",
    title: "Another ray f(t) = C + t r meets the planes of four triangles. For each, the walk's crossings are counted. Which point does the pixel show?",
    asked: triple("f"),
    given: () => [`C = ${vectorText(OTHER_RAY.C)}`, `r = ${vectorText(OTHER_RAY.r)}`, ...PLANES.map(([t, count]) => `t = ${general(t)}: ${count} ${count === 1 ? "crossing" : "crossings"}`)],
    answer: () => onOtherRay(0.4),
    hint: (values) => {
      const met = PLANES.find(([t]) => areClose(values, onOtherRay(t)));
      if (met && met[1] % 2 === 0) return "The number of crossings is even there: this point lies outside its triangle.";
      if (met && met[0] < 0) return "A negative t lies behind the camera.";
      if (met) return "This is a hit, but another one is closer.";
      if (areClose(values, OTHER_RAY.r.map((value) => 0.4 * value))) return "This is t r. Add C, where the ray begins.";
      return "Find the smallest positive t with an odd number of crossings. Multiply r by it and add C.";
    },
  },
  {
    id: "halving",
    title: "A tree halves 1024 triangles until each leaf holds one. How many levels of boxes are below the root, the box around all triangles?",
    asked: ["levels"],
    given: () => ["1024 = 2 · 2 · … · 2"],
    answer: () => [10],
    hint: ([levels]) => {
      if (levels === 512) return "This is the number of triangles after one halving.";
      if (levels === 9 || levels === 11) return "Count the halvings, one for each of these results: 512, 256, 128, 64, 32, 16, 8, 4, 2, 1.";
      return "How often can you halve 1024 until 1 is left?";
    },
  },
];
