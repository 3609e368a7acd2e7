// Chapters 1 and 2: the world and its origin, a box from triangles, refined faces, colours.

import { addPicture } from "./picture_view.js";
import { addOutside, axisStrokes, bulbHandle, cameraHandles, cornerHandles, sunHandle, sunStrokes, vertexHandle, worldContent } from "./views.js";
import { fixed, tuple } from "../figure/numbers.js";
import { OutsideView } from "../figure/outside.js";

/** @typedef {import("./figure.js").Figure} Figure */

const CUBE = { first: 2, count: 12 };

/** The whole world, with its camera and image. @param {Figure} fig */
export function buildHero(fig) {
  const { shared } = fig;
  addOutside(fig, {
    label: "The world, its lights, the camera, and the picture on its image plane", ratio: 0.6, picksPixel: true,
    content: () => {
      const { ray, steps, numbers } = shared;
      const t = steps.winner?.t ?? 3 / Math.hypot(...ray.r);
      const end = ray.C.map((value, i) => value + t * ray.r[i]);
      return {
        ...worldContent(fig), chosen: steps.winner?.index,
        strokes: [...sunStrokes(fig), { from: numbers.C, to: end, color: "r", symbol: "r", width: 2.5 }],
        spots: steps.winner ? [{ at: end, color: "r", symbol: "f(t)", text: "hit" }] : [],
      };
    },
    handles: () => [...cornerHandles(fig), ...cameraHandles(fig), bulbHandle(fig), sunHandle(fig)],
  });
  addPicture(fig, { handles: () => [...cornerHandles(fig), bulbHandle(fig), sunHandle(fig)] });
  fig.host.classList.add("double");
}

/** A vertex and its three coordinates. @param {Figure} fig */
export function buildOrigin(fig) {
  const { shared } = fig;
  const corner = () => shared.numbers.triangles[0].corners[2];
  addOutside(fig, {
    label: "A vertex and its coordinates along the three axes", view: new OutsideView({ azimuth: -35, center: [0.55, -0.45, 0.45], radius: 1.55 }),
    content: () => {
      const [x, y, z] = corner();
      return {
        ...worldContent(fig, false), faded: 0.75,
        strokes: [
          ...axisStrokes(),
          { from: [0, 0, 0], to: [x, 0, 0], color: "x", symbol: "walk x", text: "x", width: 3.5 }, { from: [x, 0, 0], to: [x, y, 0], color: "R", symbol: "walk y", text: "y", width: 3.5 }, { from: [x, y, 0], to: [x, y, z], color: "P", symbol: "walk z", text: "z", width: 3.5 },
        ],
        spots: [{ at: [0, 0, 0], color: "ink", text: "origin" }],
      };
    },
    handles: () => [vertexHandle(fig, 2, { text: tuple(corner()) })],
  });
  ["x", "y", "z"].forEach((name, i) =>
    fig.slider({ name, symbol: `walk ${name}`, min: i === 2 ? 0 : -2, max: 2.5, step: 0.05, get: () => corner()[i], set: (value) => { corner()[i] = value; } }),
  );
}

/** A box that is built one triangle after the other. @param {Figure} fig */
export function buildBox(fig) {
  let count = 12;
  const { shared } = fig;
  addOutside(fig, {
    label: "A box made of triangles", hasPoints: false, view: new OutsideView({ azimuth: -32, center: [-0.8, 0.3, 0.48], radius: 0.98 }),
    content: () => ({ corners: shared.corners.slice(9 * CUBE.first, 9 * (CUBE.first + count)), colors: shared.colors.slice(CUBE.first), chosen: count - 1 }),
  });
  fig.stepper({ last: () => CUBE.count, get: () => count, set: (i) => { count = i; }, ms: 450 });
  fig.readout(() => {
    if (!count) return [["No triangle yet."]];
    const at = 9 * (CUBE.first + count - 1);
    const corners = [0, 3, 6].map((k) => tuple(shared.corners.slice(at + k, at + k + 3)));
    return [[`Triangle ${count} of 12`], [["a", `a = ${corners[0]}`], "    ", ["b", `b = ${corners[1]}`], "    ", ["c", `c = ${corners[2]}`]]];
  });
}

/** A coarse mesh, refined by the core. @param {Figure} fig */
export function buildRefine(fig) {
  let level = 2;
  /** @type {number[]} */
  let corners = [];
  const [p, q] = [0.35, 1];
  // A coarse head: a box with a nose.
  const vertices = [[-q, -q, 0], [q, -q, 0], [q, q, 0], [-q, q, 0], [-0.8, -q, 2], [0.8, -q, 2], [0.8, q, 2], [-0.8, q, 2], [0, -2, p + 0.5]];
  const triangles = [[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7], [1, 2, 6], [1, 6, 5], [2, 3, 7], [2, 7, 6], [3, 0, 4], [3, 4, 7], [0, 1, 8], [1, 5, 8], [5, 4, 8], [4, 0, 8]];
  addOutside(fig, {
    label: "A coarse mesh and its refinement", hasPoints: false, view: new OutsideView({ azimuth: -25, elevation: 14, center: [0, -0.3, 1], radius: 1.45 }),
    content: () => {
      const text = `[[object]]\nname = "head"\nvertices = ${JSON.stringify(vertices)}\ntriangles = ${JSON.stringify(triangles)}\nrefine = ${level}\n`;
      fig.pictures.request(fig.id, { text, width: 1, height: 1, integrator: "flat", samples: 0 }, {
        onWorld: (world) => {
          corners = [...world.corners];
          fig.shared.redraw();
        },
      });
      return { corners, colors: [[224, 172, 138]] };
    },
  });
  fig.slider({ name: "refined", min: 0, max: 4, step: 1, digits: 0, unit: " times", get: () => level, set: (value) => { level = value; } });
  fig.readout(() => [[`${corners.length / 9} triangles = 14 · 4${"⁰¹²³⁴"[level]}`]]);
}

/** The colour of one triangle. @param {Figure} fig */
export function buildColor(fig) {
  const triangle = () => fig.shared.numbers.triangles[0];
  const channels = () => [1, 3, 5].map((i) => parseInt(triangle().color.slice(i, i + 2), 16));
  addPicture(fig, { label: "The picture, with one triangle whose colour changes", handles: () => cornerHandles(fig) });
  ["red", "green", "blue"].forEach((name, i) =>
    fig.slider({
      name, min: 0, max: 255, step: 1, digits: 0, get: () => channels()[i],
      set: (value) => { triangle().color = `#${channels().map((old, k) => (k === i ? value : old).toString(16).padStart(2, "0")).join("")}`; },
    }),
  );
  fig.readout(() => [[`RGB of the green triangle: ${triangle().color}   linear: ${channels().map((v) => fixed(v / 255 <= 0.04045 ? v / 255 / 12.92 : ((v / 255 + 0.055) / 1.055) ** 2.4, 3)).join(", ")}`]]);
}

