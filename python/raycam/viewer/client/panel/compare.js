// The panel that compares A and B: the mode, the statistics, and the range of a difference.

import { byId, element, fillSelect } from "../dom.js";
import { COMPARE_MODES } from "../image/compare.js";
import { grouped, sixDigits } from "../image/numbers.js";
import { percentiles } from "../image/paint.js";
import { psnrOf, ssimOf } from "../image/similarity.js";

/** @typedef {import("../image/compare.js").Difference} Difference */
/** @typedef {import("../image/paint.js").Range} Range */

export class ComparePanel {
  /** @param {() => void} changed called when the range changes */
  constructor(changed) {
    /** The upper end of the range of a difference; null for the 98th percentile. @type {number | null} */
    this.most = null;
    this.input = byId("difference-most", HTMLInputElement);
    fillSelect(byId("compare-mode", HTMLSelectElement), COMPARE_MODES);
    this.input.addEventListener("change", () => {
      this.most = Number(this.input.value) > 0 ? Number(this.input.value) : null;
      changed();
    });
    byId("difference-auto", HTMLButtonElement).addEventListener("click", () => {
      this.most = null;
      changed();
    });
  }

  /**
   * The colour map and the range of a difference.
   * @param {Difference} difference
   * @returns {{ map: string, range: Range }}
   */
  displayOf({ plane, kind }) {
    const lengths = { ...plane, values: plane.values.map(Math.abs) };
    const most = this.most ?? (kind === "perceptual" ? 1 : percentiles(/** @type {any} */ (lengths), 0).high);
    this.input.value = String(Number(most.toPrecision(4)));
    return kind === "signed"
      ? { map: "diverging", range: { low: -most, high: most, log: false } }
      : { map: "viridis", range: { low: 0, high: most, log: false } };
  }

  /**
   * Shows the comparison with B, which is the second "frame", an image that was "kept", or missing ("").
   * @param {{ b: string, names: string[], mode: string, difference: Difference | null, layers: (HTMLCanvasElement | null)[] }} shown names of the files of A and B, and A and B as displayed
   */
  show({ b, names, mode, difference, layers }) {
    const nothing = "To compare, keep the current image as B, then change something.";
    const second = names[1] ? `A is ${names[0]}, B is ${names[1]}.` : "B is the second frame.";
    const text = b === "frame" ? second : b ? "B is the image that was kept." : nothing;
    byId("compare-button", HTMLButtonElement).setAttribute("aria-pressed", String(mode !== "off" && b !== ""));
    const select = byId("compare-mode", HTMLSelectElement);
    select.disabled = !b;
    select.value = mode;
    for (const option of select.options) option.disabled = ["difference", "signed", "relative"].includes(option.value) && !difference;
    byId("compare-text", HTMLElement).textContent = text;
    byId("divider-label", HTMLElement).hidden = mode !== "slider";
    byId("difference-range", HTMLElement).hidden = !difference || difference.ids || !["difference", "signed", "relative", "perceptual"].includes(mode);
    const figures = byId("difference", HTMLElement);
    figures.hidden = !difference;
    if (!difference) return;
    const { width, height } = difference.plane;
    /** @type {[string, string][]} */
    const rows = [["pixels that differ", `${grouped(difference.pixels)} of ${grouped(width * height)}`]];
    if (difference.kind === "perceptual") rows.push(["largest FLIP error", sixDigits(difference.most, "float64")], ["mean FLIP error", sixDigits(difference.mean, "float64")]);
    else if (!difference.ids) {
      rows.push(["largest difference", sixDigits(difference.most, "float64")]);
      rows.push(["mean", sixDigits(difference.mean, "float64")], ["root mean square", sixDigits(difference.rms, "float64")]);
      rows.push(...similarities(layers));
    }
    figures.replaceChildren(...rows.flatMap(([term, value]) => [element("dt", term), element("dd", value)]));
  }
}

/** @param {(HTMLCanvasElement | null)[]} layers A and B as displayed @returns {[string, string][]} */
function similarities([a, b]) {
  if (!a || !b || a.width !== b.width || a.height !== b.height) return [];
  const [x, y] = [a, b].map((each) => /** @type {CanvasRenderingContext2D} */ (each.getContext("2d")).getImageData(0, 0, each.width, each.height).data);
  const [psnr, ssim] = [psnrOf(x, y), ssimOf(x, y, a.width)];
  return [["PSNR, as displayed", Number.isFinite(psnr) ? `${psnr.toFixed(2)} dB` : "equal"], ["SSIM, as displayed", Number.isNaN(ssim) ? "too small" : ssim.toFixed(5)]];
}
