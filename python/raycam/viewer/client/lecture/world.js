// The world of the lecture: numbers that a student turns, and the world file that they make.

/** @typedef {{ name: string, corners: number[][], color: string }} FreeTriangle a triangle moved by hand */
/**
 * @typedef {object} Numbers all that a student can change
 * @property {number} f focal length in pixels
 * @property {number} skew
 * @property {number} cx
 * @property {number} cy
 * @property {number} roll in degrees, as pitch and yaw
 * @property {number} pitch
 * @property {number} yaw
 * @property {number[]} C
 * @property {FreeTriangle[]} triangles
 * @property {number} lights how many of `LIGHTS`
 * @property {number} strength of all lights, 1 as they are
 * @property {string} integrator
 * @property {number[]} pixel u, v
 */

/** Columns and rows of the picture. */
export const SIZE = [320, 240];

/** The lights in their order: their names, and their tables with `S` for the strength. @type {[name: string, table: (strength: number) => string][]} */
export const LIGHTS = [
  ["the sun", (s) => `type = "sun"\ndirection = [-0.6, 1, -1.2]\nirradiance = [${2.2 * s}, ${2 * s}, ${1.7 * s}]`],
  ["a bulb that is a point", (s) => `type = "point"\nposition = [-1.6, -1.4, 2.2]\nintensity = [${14 * s}, ${9 * s}, ${5 * s}]`],
  ["a bulb with a radius", (s) => `type = "point"\nposition = [2.4, -0.6, 2]\nradius = 0.35\nintensity = [${4 * s}, ${7 * s}, ${12 * s}]`],
  ["the sky", (s) => `type = "sky"\nradiance = [${0.3 * s}, ${0.36 * s}, ${0.46 * s}]`],
];

const BOX = [-0.5, 0.5].flatMap((x) => [-0.5, 0.5].flatMap((y) => [-0.5, 0.5].map((z) => [x, y, z])));
const SIDES = [
  [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
];
const FACE_COLORS = [
  [0.68, 0.02, 0.05], [0.9, 0.16, 0.06], [0.02, 0.13, 0.4], [0.17, 0.4, 0.73], [0.01, 0.33, 0.26], [0.1, 0.63, 0.51],
  [0.2, 0.04, 0.27], [0.46, 0.2, 0.64], [0.03, 0.02, 0.07], [0.1, 0.07, 0.25], [0.76, 0.54, 0.05], [0.92, 0.79, 0.26],
];

/** @returns {Numbers} the numbers at the start */
export function firstNumbers() {
  return {
    f: 300, skew: 0, cx: 159.5, cy: 119.5, roll: 0, pitch: 20, yaw: 118, C: [2.4, -4.4, 2.4],
    triangles: [
      { name: "green", corners: [[0.2, -1.5, 0.1], [1.5, -0.7, 0.1], [0.8, -0.9, 1.1]], color: "#2ca25f" },
      { name: "blue", corners: [[0.4, 0.9, 0.1], [2, 0.3, 0.2], [1.1, 0.6, 1.5]], color: "#2b6cb0" },
    ],
    lights: 1, strength: 1, integrator: "flat", pixel: [170, 165],
  };
}

/** @param {number[][]} rows */
const table = (rows) => `[${rows.map((row) => `[${row.join(", ")}]`).join(", ")}]`;

/** @param {Numbers} numbers @returns {string} the world file */
export function worldText({ f, skew, cx, cy, roll, pitch, yaw, C, triangles, lights, strength }) {
  const parts = [
    `# The world of the lecture\n\n[camera]\nsize = [${SIZE.join(", ")}]\nK = ${table([[f, skew, cx], [0, f, cy], [0, 0, 1]])}`,
    `location = [${C.join(", ")}]\nroll = ${roll}\npitch = ${pitch}\nyaw = ${yaw}`,
    `\n[[object]]\nname = "floor"\nplane = { size = [7, 7] }\ncolor = "#d9d4c7"`,
    `\n[[object]]\nname = "box"\nvertices = ${table(BOX)}\ntriangles = ${table(SIDES)}\nface_colors = ${table(FACE_COLORS)}`,
    "location = [-0.8, 0.3, 0.5]\nyaw = 25",
    ...triangles.map(({ name, corners, color }) => `\n[[object]]\nname = "${name}"\nvertices = ${table(corners)}\ntriangles = [[0, 1, 2]]\ncolor = "${color}"`),
    ...LIGHTS.slice(0, lights).map(([, tableOf]) => `\n[[light]]\n${tableOf(strength)}`),
  ];
  return `${parts.join("\n")}\n`;
}
