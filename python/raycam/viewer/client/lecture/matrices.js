// Matrices of a figure: tables in which each number has the colour of its symbol.

import { element } from "../dom.js";
import { fixed } from "../figure/numbers.js";

/** @typedef {import("./figure.js").Figure} Figure */

/**
 * Adds matrices below a figure's canvases. The numbers in `marked` are emphasized.
 * @param {Figure} fig
 * @param {{ symbol: string, title?: string, columns: number, get: () => number[], marked?: (i: number) => boolean, digits?: number }[]} matrices
 */
export function addMatrices(fig, matrices) {
  const box = element("div", "", { class: "matrices" });
  fig.host.insertBefore(box, fig.tools.nextSibling);
  for (const { symbol, title = symbol, columns, get, marked = () => false, digits = 2 } of matrices) {
    const table = element("table", "", { class: "matrix", "data-symbol": symbol });
    table.append(element("caption", title));
    const cells = get().map(() => element("td"));
    for (let i = 0; i < cells.length; i += columns) {
      const row = element("tr");
      row.append(...cells.slice(i, i + columns));
      table.append(row);
    }
    box.append(table);
    fig.updates.push(() => get().forEach((value, i) => {
      cells[i].textContent = fixed(value, digits);
      cells[i].title = String(value);
      cells[i].classList.toggle("marked", marked(i));
    }));
  }
}
