// The lecture as one page: figures that share one world and one pixel, exercises, and code cells. If this script runs
// in a worker, it renders the images.

import { byId } from "../dom.js";
import { buildAngles, buildBackProject, buildMatrix, buildNormal, buildPlane, buildProject, buildSign } from "./chapter_camera.js";
import { buildLights, buildReflection, buildShadow } from "./chapter_light.js";
import { buildDistortion, buildFocus, buildMaterial, buildShutter, buildVideo } from "./chapter_optics.js";
import { buildCalibration, buildExact, buildFloor } from "./chapter_pairs.js";
import { buildAliasing, buildMean, buildNoise, buildPath } from "./chapter_paths.js";
import { buildClosest, buildCrossings, buildTreeFigure } from "./chapter_inside.js";
import { buildBox, buildColor, buildHero, buildOrigin, buildRefine } from "./chapter_world.js";
import { buildCodeCell } from "./code_cell.js";
import { Figure } from "./figure.js";
import { bindNavigation } from "./chapters.js";
import { Pictures } from "./pictures.js";
import { buildQuiz } from "./quiz.js";
import { Shared } from "./state.js";
import { buildEpipolar, buildTriangulate } from "./triangulation.js";
import { serveLecture } from "./worker.js";

/** The function that fills each figure of the page, by the figure's id. @type {Record<string, (fig: Figure) => void>} */
const FIGURES = {
  hero: buildHero, origin: buildOrigin, box: buildBox, refine: buildRefine, color: buildColor, project: buildProject, matrix: buildMatrix, angles: buildAngles,
  "back-project": buildBackProject, sign: buildSign, normal: buildNormal, plane: buildPlane, crossings: buildCrossings, closest: buildClosest, tree: buildTreeFigure,
  lights: buildLights, reflection: buildReflection, shadow: buildShadow, aliasing: buildAliasing, noise: buildNoise, path: buildPath, mean: buildMean,
  material: buildMaterial, distortion: buildDistortion, focus: buildFocus, shutter: buildShutter, video: buildVideo, epipolar: buildEpipolar, triangulate: buildTriangulate, floor: buildFloor, calibration: buildCalibration, exact: buildExact,
};
const SYMBOLS = ["K", "R", "C", "P", "x", "X", "X′", "r", "t", "f(t)", "n", "a", "b", "c", "u", "g", "v", "L", "C′", "r′", "M"];

/** Symbols in the text highlight their arrows and numbers. @param {Shared} shared */
function bindSymbols(shared) {
  for (const each of document.querySelectorAll("var")) {
    const text = each.textContent || "";
    if (SYMBOLS.includes(text)) each.setAttribute("data-symbol", text);
  }
  const symbolAt = (/** @type {Event} */ { target }) => (target instanceof Element ? target.closest("[data-symbol]")?.getAttribute("data-symbol") || "" : "");
  document.addEventListener("pointerover", (event) => shared.point(symbolAt(event)));
  document.addEventListener("pointerdown", (event) => shared.point(symbolAt(event)));
}

function openLecture() {
  const shared = new Shared();
  const message = byId("message", HTMLElement);
  const pictures = new Pictures((text) => {
    message.textContent = text;
    message.hidden = false;
  });
  shared.listeners.push(() => (message.hidden = true));
  for (const host of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll("[data-figure]"))) FIGURES[host.dataset.figure || ""](new Figure(host, shared, pictures));
  for (const host of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll("[data-exercise]"))) buildQuiz(host, shared);
  for (const host of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll("[data-code]"))) buildCodeCell(host, shared, pictures);
  document.addEventListener("input", () => pictures.hold());
  document.addEventListener("pointermove", ({ buttons }) => buttons && pictures.hold());
  bindSymbols(shared);
  bindNavigation(shared);
  byId("reset", HTMLButtonElement).addEventListener("click", () => shared.reset());
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => shared.redraw());
  pictures.open();
}

if (typeof document === "undefined") serveLecture(globalThis);
else openLecture();
