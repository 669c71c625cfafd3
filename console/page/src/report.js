// Charts and maps of a report: a document that holds its data, and needs no server.
//
// The document has one `<script type="application/json" id="report-data">`: a mapping from names to drawings. Each element
// with `data-drawing="NAME"` gets the one of that name.

import { drawLanes } from "./lanes.js";
import { drawMap } from "./map.js";
import { drawMatrix } from "./matrix.js";
import { timeChart } from "./plots.js";
import { h } from "./ui.js";

/**
 * @typedef {{kind: "time", range: [number, number], series: Series[]} & import("./plots.js").ChartOptions} TimeDrawing
 *   points: [s, value]; a value of null breaks the line
 * @typedef {{kind: "lanes", range: [number, number], lanes: import("./lanes.js").Lane[]}} LanesDrawing
 * @typedef {{kind: "matrix", names: string[], cells: import("./matrix.js").Cell[]}} MatrixDrawing
 * @typedef {{kind: "map", legend: {sign: string, colour: string, text: string}[], map: import("./map.js").MapData}} MapDrawing
 */

/** What is drawn again when the page gets another width or other colours. @type {(() => void)[]} */
const again = [];

/** What the signs of a map mean. @param {MapDrawing["legend"]} entries */
function legend(entries) {
  const signs = entries.map(({ sign, colour, text }) => {
    const drawn = h("b", {}, sign);
    drawn.style.color = colour;
    return h("span", {}, drawn, ` ${text}`);
  });
  return h("p", { class: "legend" }, ...signs);
}

/** @param {HTMLElement} place @param {TimeDrawing | LanesDrawing | MatrixDrawing | MapDrawing} drawing */
function draw(place, drawing) {
  switch (drawing.kind) {
    case "time": {
      const chart = timeChart(place, drawing);
      chart.update(drawing.series, drawing.range);
      again.push(() => chart.redraw());
      return;
    }
    case "lanes":
      drawLanes(place, drawing.lanes, drawing.range);
      return;
    case "matrix":
      drawMatrix(place, drawing.names, drawing.cells);
      return;
    case "map": {
      const map = h("div");
      place.replaceChildren(legend(drawing.legend), map);
      drawMap(map, drawing.map);
      again.push(() => drawMap(map, drawing.map));
    }
  }
}

let count = 0;
const drawings = JSON.parse(document.getElementById("report-data")?.textContent ?? "{}");
for (const place of document.querySelectorAll("[data-drawing]")) {
  const drawing = drawings[/** @type {HTMLElement} */ (place).dataset.drawing ?? ""];
  if (!drawing) continue;
  draw(/** @type {HTMLElement} */ (place), drawing);
  count += 1;
}
const redraw = () => again.forEach((one) => one());
window.addEventListener("resize", redraw);
window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
document.documentElement.dataset.drawn = String(count);
