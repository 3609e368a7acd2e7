// The explanation of a pixel as text: the lecture's formulas, each followed by its numbers, as raycam.explain prints them.

import { matrixAt, rangesOf, rayOfPixel, rayThroughLens, stepsOf } from "./steps.js";

const EDGES = [["v1", "a"], ["v2", "b"], ["v3", "c"]];

/** A number with six significant digits, as C's %g. @param {number} value */
export const general = (value) => digitsOf(value, 6);

/** A number with `count` significant digits. @param {number} value @param {number} count */
function digitsOf(value, count) {
  if (!Number.isFinite(value)) return Number.isNaN(value) ? "nan" : value > 0 ? "inf" : "-inf";
  if (value === 0) return "0";
  const rounded = toEven(value, count);
  const [digits, power] = rounded.split("e");
  const exponent = Number(power);
  const trimmed = (/** @type {string} */ text) => (text.includes(".") ? text.replace(/\.?0+$/, "") : text);
  if (exponent >= -4 && exponent < count) return trimmed(Number(rounded).toFixed(count - 1 - exponent));
  return `${trimmed(digits)}e${exponent < 0 ? "-" : "+"}${String(Math.abs(exponent)).padStart(2, "0")}`;
}

/**
 * The nearest decimal with `count` digits. A tie goes to the even digit, as in C but not in JavaScript's own functions.
 * @param {number} value
 * @param {number} count
 */
function toEven(value, count) {
  const [all, power] = value.toExponential(100).split("e"); // enough digits to recognise a tie
  const end = all.indexOf(".") + count; // index after the last digit that is kept
  const isTie = /^50*$/.test(all.slice(end)) && Number(all[end - 1]) % 2 === 0;
  return isTie ? `${all.slice(0, end)}e${power}` : value.toExponential(count - 1);
}

/** A vector as (x, y, z); components that are only rounding noise become 0. @param {number[]} values @param {number} [count] */
export function vectorText(values, count = 6) {
  const noise = 1e-14 * Math.max(...values.map(Math.abs));
  return `(${values.map((value) => digitsOf(Math.abs(value) < noise ? 0 : value, count)).join(", ")})`;
}

/** @param {number[]} P row by row */
function matrixLines(P) {
  const rows = [0, 1, 2].map((i) => P.slice(4 * i, 4 * i + 4).map(general));
  const widths = [0, 1, 2, 3].map((k) => Math.max(...rows.map((row) => row[k].length)));
  return rows.map((row) => `      [ ${row.map((cell, k) => cell.padStart(widths[k])).join("  ")} ]`);
}

/** @param {number} linear */
const byteOf = (linear) => Math.round(255 * Math.min(Math.max(linear <= 0.0031308 ? 12.92 * linear : 1.055 * linear ** (1 / 2.4) - 0.055, 0), 1));

/**
 * The text of all steps, the ray, and the triangle that the text describes first. Throws an error for a pixel without a ray.
 * @param {{ K: number[], lensRay: import("./steps.js").LensRay, size: number[], offset: number, column: number, row: number,
 *   names: string[], corners: ArrayLike<number>, ids: ArrayLike<number>, colors: ArrayLike<number> }} asked
 */
export function explanationOf({ K, lensRay, size, offset, column, row, names, corners, ids, colors }) {
  const { model, direction } = lensRay;
  const isPinhole = model === "pinhole";
  if (!direction.every(Number.isFinite)) throw new Error(`Pixel (${column}, ${row}) has no ray: it lies outside of the image of the lens (${model}).`);
  const [u, v] = [column + offset, row + offset];
  const P = matrixAt(K, lensRay);
  const ray = isPinhole ? rayOfPixel(P, u, v) : rayThroughLens(K, u, v, lensRay);
  const steps = stepsOf(ray, corners);
  const { counts, candidates, winner } = steps;
  const name = (/** @type {import("./steps.js").Candidate} */ { index }) =>
    `triangle ${ids[2 * index + 1]} of object ${ids[2 * index]} "${names[ids[2 * index]]}"`;
  const lines = [
    `Pixel (${column}, ${row}) of a ${size[0]} x ${size[1]} image, by the steps of the lecture`,
    "",
    "Vectors are (x, y, z); · is the dot product, x between vectors the cross product.",
    "6 digits are printed, 16 were used: by hand, the last printed digits may differ.",
    ...("lens" in ray ? lensLines(ray) : rayLines(P, ray)),
    "",
    `2. FOR EACH OF ${steps.triangles} TRIANGLES: THE PLANE, AND INSIDE OR OUTSIDE`,
    "",
    ...[
      [counts.withoutArea, "have no area, n = 0: never hit"],
      [counts.parallel, "are edge-on, n·r = 0: never hit"],
      [counts.behind, "are behind the camera, t < 0: discarded"],
      [counts.outside, "are missed: the ray meets their planes outside of the triangles"],
      [counts.inside, "are hit"],
    ].map(([count, meaning]) => `   ${String(count).padStart(9)} ${meaning}`),
  ];
  if (candidates.length) {
    const width = Math.max(...candidates.map((found) => name(found).length));
    lines.push("", "   The nearest hits and the closest misses, with all steps below:", "");
    lines.push(`   ${"t".padStart(12)}  ${"triangle".padEnd(width)}  crossings`);
    for (const found of candidates) {
      const said = found === winner ? "inside, and the closest: it colours the pixel" : found.inside ? "inside, but farther away" : "outside";
      lines.push(`   ${general(found.t).padStart(12)}  ${name(found).padEnd(width)}  ${found.crossings}: ${said}`);
    }
    for (const found of candidates) lines.push("", ...triangleLines(found, name(found)));
  }
  lines.push("", "3. COLOUR THE PIXEL WITH THE COLOUR OF THE CLOSEST TRIANGLE", "");
  if (!winner && steps.triangles === 0) lines.push("   There are no triangles in this world: the pixel shows the background.");
  else if (!winner && counts.outside === 0) {
    lines.push("   The ray meets no triangle's plane in front of the camera: the pixel shows the background.");
  } else if (!winner) {
    lines.push(
      "   The ray meets no triangle: it meets every plane in front of the camera outside of the",
      "   triangle. The pixel shows the background.",
    );
  }
  if (winner) {
    const color = [0, 1, 2].map((i) => colors[3 * winner.index + i]);
    const { distance, depth } = rangesOf(ray, winner.t);
    lines.push(
      `   The smallest t            ${general(winner.t)}, ${name(winner)}`,
      `   Its colour                ${vectorText(color)}, linear RGB; as sRGB bytes ${color.map(byteOf).join(", ")}`,
      `   distance = t |r|          ${general(distance)}, from C to f(t)`,
      `   depth = t (v·r)           ${general(depth)}, along the principal axis${isPinhole ? "" : ` v = ${vectorText(ray.forward)}`}`,
    );
  }
  return { text: lines.join("\n"), ray, found: winner || candidates[0] || null };
}

/** @param {number[]} P @param {import("./steps.js").PixelRay} ray */
function rayLines(P, ray) {
  return [
    "",
    "1. A LINE THROUGH THE PIXEL AND THE CAMERA CENTRE",
    "",
    `   x  = (u, v, 1)                ${vectorText(ray.x)}, the centre of the pixel`,
    "   P, the camera matrix, x = P X",
    ...matrixLines(P),
    `   X' = P⁺ x = Pᵀ (P Pᵀ)⁻¹ x      ${vectorText(ray.X)}, homogeneous`,
    ...(ray.XPrime
      ? [`      = divided by the fourth    ${vectorText(ray.XPrime)}, some point on the line`]
      : [
          "   The fourth coordinate is 0: X' is at infinity. The first three are then the direction of",
          "   the line itself, and replace X' - C.",
        ]),
    `   C, where P (C, 1) = 0         ${vectorText(ray.C)}, the camera centre, another point on the line`,
    `   X' - C                        ${vectorText(ray.line)}`,
    "",
    "   ORIENT THE LINE FORWARD",
    "",
    "   M, the left 3 x 3 of P, is K R times a scale. The third row of K is (0, 0, 1), so the third row",
    "   of M, M3, is that of R times the scale, and the sign of the scale is that of det M.",
    `   det M                         ${general(ray.detM)}`,
    `   ${(ray.detM > 0 ? "v  = M3 / |M3|" : "v  = -M3 / |M3|").padEnd(30)}${vectorText(ray.forward)}, the third row of R: forward`,
    `   v·(X' - C)                    ${general(ray.along)}`,
    ray.along > 0
      ? `   Positive, X' is in front:     r = X' - C = ${vectorText(ray.r)}`
      : `   Negative, X' is behind:       r = C - X' = ${vectorText(ray.r)}`,
    "   The ray is f(t) = C + t r, and t > 0 is in front of the camera.",
  ];
}

/** The lines about the ray of a camera that no camera matrix describes (with a lens or parallel rays). @param {import("./steps.js").BentRay} ray */
function lensLines({ x, C, r, imagePoint, undistorted, inCamera, lens: { model, coefficients, back } }) {
  const isParallel = model === "parallel";
  const angle = (Math.acos(Math.max(-1, Math.min(1, inCamera[2]))) * 180) / Math.PI;
  const bent = [
    `1. THE RAY OF THE PIXEL, THROUGH THE LENS (${model})`,
    "",
    "   A lens bends rays, so no camera matrix P describes them. Each step is inverted instead:",
    "   from the pixel to the distorted point, to the direction without the lens, to the world.",
  ];
  const steps = [
    `   m' = K⁻¹ x                    ${vectorText(imagePoint)}, the distorted point of the image plane`,
    `   coefficients                  ${coefficients.map(general).join(", ")}`,
    ...(undistorted ? [`   m, whose distortion is m'     ${vectorText(undistorted)}, the undistorted point, at z = 1`] : []),
    `   d, its direction              ${vectorText(inCamera)}, ${general(angle)} degrees off the axis`,
  ];
  return [
    "",
    ...(isParallel ? ["1. THE RAY OF THE PIXEL: ALL RAYS OF THIS CAMERA ARE PARALLEL"] : bent),
    "",
    `   x  = (u, v, 1)                ${vectorText(x)}, the centre of the pixel`,
    ...(isParallel ? [`   d                             ${vectorText(inCamera)}, the same for every pixel`] : steps),
    `   r  = Rᵀ d                     ${vectorText(r)}, in the world, of length 1`,
    `   C                             ${vectorText(C)}, ${isParallel ? "the origin of the ray" : "the camera centre"}`,
    `   C + r, projected again        ${vectorText(back, 9)}: the same pixel`,
    "   The ray is f(t) = C + t r, and t, the distance, is greater than 0 in front of the camera.",
  ];
}

/** @param {import("./steps.js").Candidate} found @param {string} name */
function triangleLines(found, name) {
  const [a, b, c] = found.corners;
  const [v1, v2, v3] = found.edges;
  const on = EDGES.filter((_, i) => found.onEdge[i]).map(([edge]) => edge).join(" and ");
  const count = `   ${found.crossings} ${found.crossings === 1 ? "crossing" : "crossings"}, ${found.crossings % 2 ? "odd" : "even"}: `;
  return [
    `   ${name.toUpperCase()}`,
    `   a                   ${vectorText(a)}`,
    `   b                   ${vectorText(b)}`,
    `   c                   ${vectorText(c)}`,
    `   n = (c-a) x (b-a)   ${vectorText(found.n)}`,
    `   n·(a - C)           ${general(found.above)}`,
    `   n·r                 ${general(found.below)}`,
    `   t = n·(a-C) / n·r   ${general(found.t)}`,
    `   f(t) = C + t r      ${vectorText(found.f)}`,
    `   v1 = b - a          ${vectorText(v1)}`,
    `   v2 = c - b          ${vectorText(v2)}`,
    `   v3 = a - c          ${vectorText(v3)}`,
    `   g = a + v3          ${vectorText(found.g)}, outside`,
    `   u = g - f(t)        ${vectorText(found.u)}`,
    "   f(t) + s u meets the line of each edge; crossed when 0 <= s <= 1 and 0 <= q <= 1:",
    ...EDGES.map(([edge, start], i) => {
      if (Number.isNaN(found.alongU[i])) return `      ${start} + q ${edge}         parallel to u, not crossed`;
      const numbers = `s = ${general(found.alongU[i]).padEnd(12)} q = ${general(found.alongEdge[i]).padEnd(12)}`;
      return `      ${start} + q ${edge}         ${numbers} ${found.crossed[i] ? "crossed" : "-"}`;
    }),
    on ? `${count}but f(t) lies on ${on}, and points on an edge count as inside.` : `${count}f(t) is ${found.inside ? "inside" : "outside"}.`,
  ];
}
