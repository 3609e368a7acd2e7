// The lecture as one page: figures that share one world and one pixel, exercises, and code cells. In a worker of the page
// the same text renders.

import { byId } from "../dom.js";
import { buildAngles, buildBackProject, buildMatrix, buildNormal, buildPlane, buildProject, buildSign } from "./chapter_camera.js";
import { buildLights, buildReflection, buildShadow } from "./chapter_light.js";
import { buildDistortion, buildFocus, buildMaterial, buildShutter, buildVideo } from "./chapter_optics.js";
import { buildCalibration, buildExact, buildFloor } from "./chapter_pairs.js";
import { buildAliasing, buildMean, buildNoise, buildPath } from "./chapter_paths.js";
import { buildClosest, buildCrossings, buildTreeFigure } from "./chapter_inside.js";
import { buildBox, buildColor, buildHero, buildOrigin, buildRefine } from "./chapter_world.js";
import { buildCodeCell } from "./code_cell.js";
import { Figure, isStill } from "./figure.js";
import { Pictures } from "./pictures.js";
import { buildQuiz } from "./quiz.js";
import { Shared } from "./state.js";
import { buildEpipolar, buildTriangulate } from "./triangulation.js";
import { serveLecture } from "./worker.js";

/** What fills each figure of the page. @type {Record<string, (fig: Figure) => void>} */
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

/** Marks the chapter on screen and the chapters whose exercises are solved. @param {Shared} shared */
function bindNavigation(shared) {
  const links = [...document.querySelectorAll("nav a")].map((link) => ({ link, section: byId((link.getAttribute("href") || "#").slice(1), HTMLElement) }));
  const observer = new IntersectionObserver((entries) => {
    for (const { target, isIntersecting } of entries) {
      const found = links.find(({ section }) => section === target);
      if (!found || !isIntersecting) continue;
      for (const { link } of links) link.toggleAttribute("aria-current", link === found.link);
      const { parentElement: item } = found.link;
      item?.parentElement?.scrollTo({ left: item.offsetLeft - item.parentElement.clientWidth / 2, behavior: isStill() ? "auto" : "smooth" });
    }
  }, { rootMargin: "-30% 0px -60% 0px" });
  for (const { section } of links) observer.observe(section);
  let last = -1;
  const show = () => {
    const solved = document.querySelectorAll(".solved").length;
    if (solved === last) return;
    last = solved;
    for (const { link, section } of links) {
      const tasks = [...section.querySelectorAll("[data-exercise], [data-code]")];
      link.classList.toggle("done", tasks.length > 0 && tasks.every((task) => task.classList.contains("solved")));
    }
    const all = document.querySelectorAll("[data-exercise], [data-code]").length;
    byId("progress", HTMLElement).textContent = `${solved} of ${all} exercises solved`;
  };
  shared.listeners.push(show);
  show();
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
