// The world that all figures share: the numbers that a reader sets, and the world file with these numbers.

import { linearOfSrgb, srgb8 } from "../image/tone.js";

/** @typedef {{ name: string, corners: number[][], color: string }} FreeTriangle a triangle whose corners are dragged */
/**
 * @typedef {object} Numbers all that a reader can change
 * @property {number} fx focal lengths in pixels
 * @property {number} fy
 * @property {number} skew
 * @property {number} cx
 * @property {number} cy
 * @property {number} roll in degrees, as pitch and yaw
 * @property {number} pitch
 * @property {number} yaw
 * @property {number[]} C
 * @property {FreeTriangle[]} triangles
 * @property {number[]} pixel column, row
 * @property {number} sun azimuth of the sun in degrees
 * @property {number} height of the sun in degrees
 * @property {number[]} bulb position of the bulb
 */

/** Columns and rows of the image. */
export const SIZE = [320, 240];
/** Radiant intensity of the bulb, W/sr, and irradiance of the sun, W/m², in red, green and blue. */
export const BULB = [14, 11, 7], SUN = [2.4, 2.2, 1.9];

const BOX = [-0.5, 0.5].flatMap((x) => [-0.5, 0.5].flatMap((y) => [-0.5, 0.5].map((z) => [x, y, z])));
const SIDES = [
  [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
];
const FACE_COLORS = [
  [0.68, 0.02, 0.05], [0.9, 0.16, 0.06], [0.02, 0.13, 0.4], [0.17, 0.4, 0.73], [0.01, 0.33, 0.26], [0.1, 0.63, 0.51],
  [0.2, 0.04, 0.27], [0.46, 0.2, 0.64], [0.03, 0.02, 0.07], [0.1, 0.07, 0.25], [0.76, 0.54, 0.05], [0.92, 0.79, 0.26],
];
/** Half the side of the floor. */
export const FLOOR = 3.5;
/** sRGB of the background of flat images. */
export const BACKGROUND = [205, 221, 236];
const BOX_PLACE = [-0.8, 0.3, 0.5], BOX_YAW = 25;

/** @returns {Numbers} the numbers at the start */
export function firstNumbers() {
  return {
    fx: 300, fy: 300, skew: 0, cx: 159.5, cy: 119.5, roll: 0, pitch: 20, yaw: 118, C: [2.4, -4.4, 2.4],
    triangles: [
      { name: "green", corners: [[0.2, -1.5, 0.1], [1.5, -0.7, 0.1], [0.8, -0.9, 1.1]], color: "#2ca25f" },
      { name: "blue", corners: [[0.4, 0.9, 0.1], [2, 0.3, 0.2], [1.1, 0.6, 1.5]], color: "#2b6cb0" },
    ],
    pixel: [170, 165], sun: -35, height: 42, bulb: [0.9, -0.4, 2.2],
  };
}

/** The direction to the sun, a unit vector. @param {{ sun: number, height: number }} numbers */
export function toSun({ sun, height }) {
  const [a, h] = [sun, height].map((degrees) => (degrees * Math.PI) / 180);
  return [Math.cos(h) * Math.cos(a), Math.cos(h) * Math.sin(a), Math.sin(h)];
}

/** The corners of all triangles, nine numbers each, in the core's order: the floor, the box, the free triangles. @param {Numbers} numbers */
export function cornersOf({ triangles }) {
  const [c, s] = [Math.cos((BOX_YAW * Math.PI) / 180), Math.sin((BOX_YAW * Math.PI) / 180)];
  const box = BOX.map(([x, y, z]) => [c * x - s * y + BOX_PLACE[0], s * x + c * y + BOX_PLACE[1], z + BOX_PLACE[2]]);
  const [p, q] = [-FLOOR, FLOOR];
  const floor = [[p, p, 0], [q, p, 0], [q, q, 0], [p, p, 0], [q, q, 0], [p, q, 0]];
  return [...floor, ...SIDES.flatMap((side) => side.map((i) => box[i])), ...triangles.flatMap(({ corners }) => corners)].flat();
}

/** The name of each triangle. @param {Numbers} numbers */
export function namesOf({ triangles }) {
  const floor = ["floor 0", "floor 1"];
  return [...floor, ...SIDES.map((_, i) => `box ${i}`), ...triangles.map(({ name }) => name)];
}

/** The sRGB colour of each triangle. @param {Numbers} numbers @returns {number[][]} */
export function colorsOf({ triangles }) {
  const free = triangles.map(({ color }) => [1, 3, 5].map((i) => parseInt(color.slice(i, i + 2), 16)));
  return [[217, 212, 199], [217, 212, 199], ...FACE_COLORS.map((color) => color.map((value) => srgb8(Math.fround(value)))), ...free];
}

/** @param {number[][]} rows */
const table = (rows) => `[${rows.map((row) => `[${row.join(", ")}]`).join(", ")}]`;

/**
 * The world file. `lights`: any of "sun", "bulb", "sky", and "backdrop", which is a sky for flat images. `box` and `camera`: further keys of the box and of the camera.
 * @param {Numbers} numbers
 * @param {{ lights?: string[], box?: string, camera?: string, size?: number[], more?: string }} [options]
 */
export function worldText(numbers, { lights = ["backdrop"], box = "", camera = "", size = SIZE, more = "" } = {}) {
  const { fx, fy, skew, cx, cy, roll, pitch, yaw, C, triangles, bulb } = numbers;
  const scale = size[0] / SIZE[0];
  const K = [[fx * scale, skew * scale, (cx + 0.5) * scale - 0.5], [0, fy * scale, (cy + 0.5) * scale - 0.5], [0, 0, 1]];
  const lines = {
    sun: `type = "sun"\ndirection = [${toSun(numbers).map((value) => -value).join(", ")}]\nirradiance = [${SUN.join(", ")}]`,
    bulb: `type = "point"\nposition = [${bulb.join(", ")}]\nintensity = [${BULB.join(", ")}]`,
    backdrop: `type = "sky"\nradiance = [${BACKGROUND.map((value) => linearOfSrgb(value / 255)).join(", ")}]`,
    sky: `type = "sky"\nradiance = [0.3, 0.36, 0.46]`,
  };
  return `${[
    `# The world of the lecture\n\n[camera]\nsize = [${size.join(", ")}]\nK = ${table(K)}`,
    `location = [${C.join(", ")}]\nroll = ${roll}\npitch = ${pitch}\nyaw = ${yaw}\n${camera}`,
    `\n[[object]]\nname = "floor"\nplane = { size = [${2 * FLOOR}, ${2 * FLOOR}] }\ncolor = "#d9d4c7"`,
    `\n[[object]]\nname = "box"\nvertices = ${table(BOX)}\ntriangles = ${table(SIDES)}`,
    box || `face_colors = ${table(FACE_COLORS)}`,
    `location = [${BOX_PLACE.join(", ")}]\nyaw = ${BOX_YAW}`,
    ...triangles.map(({ name, corners, color }) => `\n[[object]]\nname = "${name}"\nvertices = ${table(corners)}\ntriangles = [[0, 1, 2]]\ncolor = "${color}"`),
    more,
    ...lights.map((name) => `\n[[light]]\n${/** @type {Record<string, string>} */ (lines)[name]}`),
  ].join("\n")}\n`;
}
