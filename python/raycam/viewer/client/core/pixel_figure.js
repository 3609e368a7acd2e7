// The data from which the figures of a pixel's explanation are drawn, in pages that render without a server.

import { srgb8 } from "../image/tone.js";

/** The number of triangles around a hit that figures show. */
export const FIGURE_TRIANGLES = 300;

/**
 * The triangles whose middles are closest to a point, and their sRGB colours.
 * @param {ArrayLike<number>} corners nine numbers each
 * @param {ArrayLike<number>} colors linear, three numbers each
 * @param {number[]} point
 */
export function trianglesAround(corners, colors, point) {
  const distances = Float64Array.from({ length: corners.length / 9 }, (_, i) => {
    const off = [0, 1, 2].map((k) => (corners[9 * i + k] + corners[9 * i + 3 + k] + corners[9 * i + 6 + k]) / 3 - point[k]);
    return off[0] ** 2 + off[1] ** 2 + off[2] ** 2;
  });
  const order = [...distances.keys()].sort((a, b) => distances[a] - distances[b] || a - b).slice(0, FIGURE_TRIANGLES);
  return {
    corners: order.flatMap((i) => Array.from({ length: 9 }, (_, k) => corners[9 * i + k])),
    colors: order.map((i) => [0, 1, 2].map((k) => srgb8(colors[3 * i + k]))),
  };
}

/**
 * @param {{ rayAt: (u: number, v: number) => number[], size: number[], offset: number, up: number[], isFlat: boolean,
 *   ray: import("./steps.js").Ray, found: import("./steps.js").Candidate | null, corners: ArrayLike<number>, colors: ArrayLike<number> }} asked
 * @returns {import("../figure/pixel.js").PixelFigure}
 */
export function pixelFigureOf({ rayAt, size, offset, up, isFlat, ray, found, corners, colors }) {
  const low = offset - 0.5;
  const [right, bottom] = size.map((extent) => extent + low);
  const rays = [[low, low], [right, low], [right, bottom], [low, bottom]].map(([u, v]) => rayAt(u, v));
  const end = found && found.f.every(Number.isFinite) ? found.f : ray.C;
  return { up, size, C: ray.C, r: ray.r, v: ray.forward, rays, isFlat, triangle: found ? found.corners.flat() : null, ...trianglesAround(corners, colors, end) };
}
