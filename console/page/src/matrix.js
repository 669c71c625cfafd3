// Links as a table of cells: a row for each sender, a column for each receiver, coloured by loss. It needs no server.

import { css, lossColour, lossGradient } from "./colours.js";
import { h } from "./ui.js";

/**
 * @typedef {object} Cell
 * @property {number} from a place in the names
 * @property {number} to
 * @property {number | null} loss the share lost; null where nothing has a fate
 * @property {string} text
 */

/**
 * @param {HTMLElement} place
 * @param {string[]} names
 * @param {Cell[]} cells
 */
export function drawMatrix(place, names, cells) {
  const rows = names.map((name) => h("tr", {}, h("th", { scope: "row" }, name), ...names.map(() => h("td"))));
  for (const { from, to, loss, text } of cells) {
    const cell = /** @type {HTMLElement} */ (rows[from].children[to + 1]);
    cell.title = text;
    cell.className = "link";
    if (loss !== null) cell.style.background = css(lossColour(loss));
  }
  const head = h("tr", {}, h("th"), ...names.map((name) => h("th", { scope: "col" }, h("span", {}, name))));
  const scale = h("i");
  scale.style.background = lossGradient();
  const legend = h("p", { class: "legend" }, "lost: 0 %", scale, "100 %");
  place.replaceChildren(legend, h("div", { class: "scroll" }, h("table", { class: "matrix" }, h("thead", {}, head), h("tbody", {}, ...rows))));
}
