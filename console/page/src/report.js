// Charts and map of a report: a document that holds its data, and needs no server.
//
// The document has one `<script type="application/json" id="report-data">`, the report (console/report/collect.py) with the
// scene of its map. Each element with `data-drawing="NAME"` gets the drawing of that name.

import { drawLanes } from "./lanes.js";
import { drawMap } from "./map.js";
import { drawMatrix } from "./matrix.js";
import { timeChart } from "./plots.js";
import { causesChart, causeLooks, delayChart, lanesOf, lossChart, mapData, matrixCells } from "./report_drawings.js";
import { h } from "./ui.js";

/** Redrawn when the page gets another width or other colours. @type {(() => void)[]} */
const again = [];

/** The signs of a map, with the cause of each. @param {Map<string, {colour: string, sign: string}>} looks */
function legend(looks) {
  const signs = [...looks].map(([cause, { sign, colour }]) => {
    const drawn = h("b", {}, sign);
    drawn.style.color = colour;
    return h("span", {}, drawn, ` ${cause}`);
  });
  return h("p", { class: "legend" }, ...signs);
}

/** @param {HTMLElement} place @param {ReturnType<typeof delayChart>} drawing */
function draw(place, { series, range, ...options }) {
  const chart = timeChart(place, options);
  chart.update(series, range);
  again.push(() => chart.redraw());
}

/** @param {import("./report_drawings.js").Report} report @param {HTMLElement} place @param {string} name */
function drawNamed(report, place, name) {
  const [kind, number] = name.split("-");
  const channel = report.channels[Number(number)];
  if (kind === "events") drawLanes(place, lanesOf(report), [report.start_ns / 1e9, report.end_ns / 1e9]);
  else if (kind === "links") drawMatrix(place, report.endpoints, matrixCells(report));
  else if (kind === "delay") draw(place, delayChart(report, channel));
  else if (kind === "loss") draw(place, lossChart(report, channel));
  else if (kind === "causes") draw(place, causesChart(report));
  else {
    const map = h("div");
    const data = mapData(report);
    place.replaceChildren(legend(causeLooks(report)), map);
    drawMap(map, data);
    again.push(() => drawMap(map, data));
  }
}

const report = JSON.parse(document.getElementById("report-data")?.textContent ?? "{}");
const places = document.querySelectorAll("[data-drawing]");
for (const place of places) drawNamed(report, /** @type {HTMLElement} */ (place), /** @type {HTMLElement} */ (place).dataset.drawing ?? "");
const redraw = () => again.forEach((one) => one());
window.addEventListener("resize", redraw);
window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
document.documentElement.dataset.drawn = String(places.length);
