// A tree of boxes around triangles, which are divided at the median. It is built to the depth that a figure shows.

import { triangleSteps } from "../core/steps.js";

/** @typedef {{ low: number[], high: number[], depth: number, children: Node[], items: number[] }} Node */

const LEAF_SIZE = 3;

/** The tree over triangles. @param {number[]} corners nine numbers each @returns {Node} */
export function buildTree(corners) {
  const build = (/** @type {number[]} */ items, /** @type {number} */ depth) => {
    const points = items.flatMap((i) => [0, 3, 6].map((k) => corners.slice(9 * i + k, 9 * i + k + 3)));
    const [low, high] = [Math.min, Math.max].map((pick) => [0, 1, 2].map((axis) => pick(...points.map((point) => point[axis]))));
    /** @type {Node} */
    const node = { low, high, depth, children: [], items };
    if (items.length <= LEAF_SIZE) return node;
    const axis = high[0] - low[0] > high[1] - low[1] ? 0 : 1;
    const sorted = [...items].sort((a, b) => corners[9 * a + axis] + corners[9 * a + 3 + axis] + corners[9 * a + 6 + axis] - corners[9 * b + axis] - corners[9 * b + 3 + axis] - corners[9 * b + 6 + axis]);
    const half = sorted.length >> 1;
    node.children = [build(sorted.slice(0, half), depth + 1), build(sorted.slice(half), depth + 1)];
    return node;
  };
  return build(Array.from({ length: corners.length / 9 }, (_, i) => i), 0);
}

/** The t at which a ray enters a box; infinity for a miss. @param {Node} node @param {number[]} C @param {number[]} r */
export function entryOf({ low, high }, C, r) {
  let [enter, leave] = [0, Infinity];
  for (let axis = 0; axis < 3; axis++) {
    if (r[axis] === 0) {
      if (C[axis] < low[axis] || C[axis] > high[axis]) return Infinity;
      continue;
    }
    const ends = [(low[axis] - C[axis]) / r[axis], (high[axis] - C[axis]) / r[axis]];
    enter = Math.max(enter, Math.min(...ends));
    leave = Math.min(leave, Math.max(...ends));
  }
  return enter <= leave ? enter : Infinity;
}

/** The closest hit, with the boxes that the ray enters and the triangles that are tried. @param {Node} root @param {number[]} corners @param {import("../core/steps.js").Ray} ray */
export function traverse(root, corners, ray) {
  /** @type {Node[]} */
  const visited = [];
  /** @type {number[]} */
  const tested = [];
  /** @type {import("../core/steps.js").Candidate | null} */
  let hit = null;
  const stack = [root];
  while (stack.length) {
    const node = /** @type {Node} */ (stack.pop());
    if (entryOf(node, ray.C, ray.r) >= (hit?.t ?? Infinity)) continue;
    visited.push(node);
    for (const i of node.children.length ? [] : node.items) {
      tested.push(i);
      const found = triangleSteps(corners, i, ray);
      if (found.inside && found.t < (hit?.t ?? Infinity)) hit = found;
    }
    stack.push(...[...node.children].sort((a, b) => entryOf(b, ray.C, ray.r) - entryOf(a, ray.C, ray.r)));
  }
  return { visited, tested, hit };
}
