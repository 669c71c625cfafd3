// Charts and maps of a report: a document that holds its data, and needs no server.
//
// The document has one `<script type="application/json" id="report-data">`: a mapping from names to drawings. Each element
// with `data-drawing="NAME"` gets the one of that name.

import { drawMap } from "./map.js";
import { bars, distributionChart, timeChart } from "./plots.js";

/**
 * @typedef {{kind: "time", unit?: string, height?: number, step?: boolean, series: Series[]}} TimeDrawing points: [s, value]
 * @typedef {{kind: "distribution", samples: {name: string, unit: string, values: number[]}[]}} DistributionDrawing
 * @typedef {{kind: "bars", counts: Record<string, number>}} BarsDrawing
 * @typedef {{kind: "map", map: import("./map.js").MapData}} MapDrawing
 */

/** @param {HTMLElement} place @param {TimeDrawing | DistributionDrawing | BarsDrawing | MapDrawing} drawing */
function draw(place, drawing) {
  switch (drawing.kind) {
    case "time":
      timeChart(place, { unit: drawing.unit, height: drawing.height, step: drawing.step }).update(drawing.series);
      return;
    case "distribution":
      distributionChart(place, drawing.samples);
      return;
    case "bars":
      bars(place, drawing.counts);
      return;
    case "map":
      drawMap(place, drawing.map);
      window.addEventListener("resize", () => drawMap(place, drawing.map));
  }
}

const drawings = JSON.parse(document.getElementById("report-data")?.textContent ?? "{}");
for (const place of document.querySelectorAll("[data-drawing]")) {
  const drawing = drawings[/** @type {HTMLElement} */ (place).dataset.drawing ?? ""];
  if (drawing) draw(/** @type {HTMLElement} */ (place), drawing);
}
