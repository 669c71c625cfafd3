// What a report draws, out of its data: lanes of events, charts over time, a matrix of links, a map.

import { paletteColour } from "./colours.js";
import { mapOf } from "./map_data.js";

/** Of causes, which are told apart without colours too. */
const SIGNS = "●■▲◆✕";
export const BAND_COLOURS = { partition: "#d55e00", clog: "#e69f00", settings: "#0072b2" };
const LOSS_COLOUR = "#d55e00";

/**
 * @typedef {{delivered: number, dropped: number, p50_ms: number, p95_ms: number}} Bin
 * @typedef {{name: string, bins: Bin[]}} Channel
 * @typedef {{source: string, destination: string, offered: number, delivered: number, dropped: number, loss: number | null, causes: Record<string, number>}} LinkFigures
 * @typedef {{kind: "partition" | "clog" | "settings", start_ns: number, end_ns: number, text: string}} Band
 * @typedef {{name: string, at: [number, number], is_gone: boolean, pieces: [number, number][][]}} Track
 * @typedef {{at: [number, number], cause: string, source: string, destination: string, sent_ns: number}} Loss
 *
 * @typedef {object} Report as console/report/collect.py makes it
 * @property {number} start_ns
 * @property {number} end_ns
 * @property {number} bin_ns
 * @property {Record<string, number[]>} causes_over_time
 * @property {Channel[]} channels
 * @property {string[]} endpoints
 * @property {LinkFigures[]} links
 * @property {{at_ns: number, kind: string, text: string, by: string}[]} events
 * @property {Record<string, string>} looks
 * @property {Band[]} bands
 * @property {{tracks: Track[], standing: Record<string, [number, number]>, losses: Loss[]}} map
 * @property {SceneMessage} scene
 * @property {(number | null)[][]} poses
 */

/** The colour and the sign of each cause of losses. @param {Report} report */
export function causeLooks(report) {
  const causes = Object.keys(report.causes_over_time);
  return new Map(causes.map((cause, index) => [cause, { colour: paletteColour(index), sign: SIGNS[index % SIGNS.length] }]));
}

/** @param {Band} band */
function span({ start_ns, end_ns, text }) {
  const [from, to] = [start_ns / 1e9, end_ns / 1e9];
  return { from, to, text: `${+from.toPrecision(6)} s to ${+to.toPrecision(6)} s: ${text}` };
}

/** A lane for each kind of span and of event. @param {Report} report @returns {import("./lanes.js").Lane[]} */
export function lanesOf(report) {
  /** @type {Map<string, import("./lanes.js").Lane>} */
  const lanes = new Map();
  for (const [kind, colour] of Object.entries(BAND_COLOURS)) {
    const entries = report.bands.filter((band) => band.kind === kind).map(span);
    if (entries.length) lanes.set(kind, { name: kind, colour, entries });
  }
  for (const { at_ns, kind, text, by } of report.events.filter((event) => event.by !== "deployment")) {
    const name = by === "rules" ? kind : by;
    const mark = by === "requested" ? "request" : kind;
    const lane = lanes.get(name) ?? { name, mark, look: report.looks[kind], entries: [] };
    lane.entries.push({ from: at_ns / 1e9, text: `${+(at_ns / 1e9).toPrecision(9)} s: ${text}` });
    lanes.set(name, lane);
  }
  return [...lanes.values()];
}

/** @param {Report} report @param {string} unit @param {number} height @param {Series[]} series @param {string[]} colours */
function overTime(report, unit, height, series, colours) {
  const shades = report.bands
    .filter(({ kind }) => kind !== "settings")
    .map((band) => ({ ...span(band), colour: BAND_COLOURS[band.kind], text: `${band.kind}: ${band.text}` }));
  const moments = report.events.filter(({ by }) => by === "recovery").map(({ at_ns }) => at_ns / 1e9);
  const range = /** @type {[number, number]} */ ([report.start_ns / 1e9, Math.max(report.end_ns, report.start_ns + 1) / 1e9]);
  return { unit, height, range, shades, moments, colours, series };
}

/** The middle of a span of time (s). @param {Report} report @param {number} index */
function middle(report, index) {
  const start = report.start_ns + index * report.bin_ns;
  return (start + Math.min(report.end_ns, start + report.bin_ns)) / 2e9;
}

/** Delays of a channel: a line breaks where all was lost, and goes on over spans without packets. @param {Report} report @param {Channel} channel */
export function delayChart(report, channel) {
  const line = (/** @type {string} */ name, /** @type {"p50_ms" | "p95_ms"} */ key) => ({
    name,
    unit: "ms",
    points: channel.bins.flatMap((bin, index) => {
      if (!bin.delivered && !bin.dropped) return [];
      return [/** @type {[number, number | null]} */ ([middle(report, index), bin.delivered ? bin[key] : null])];
    }),
  });
  const series = [line("95th percentile", "p95_ms"), line("median", "p50_ms")];
  return overTime(report, "delay (ms)", 190, series, [paletteColour(1), paletteColour(0)]);
}

/** @param {Report} report @param {string} name @param {string} unit @param {number[]} values @returns {Series} */
function bars(report, name, unit, values) {
  return { name, unit, points: values.map((value, index) => [middle(report, index), value]) };
}

/** @param {Report} report @param {Channel} channel */
export function lossChart(report, channel) {
  const lost = channel.bins.map(({ delivered, dropped }) => (dropped ? (100 * dropped) / (delivered + dropped) : 0));
  return { ...overTime(report, "lost (%)", 150, [bars(report, "lost", "%", lost)], [LOSS_COLOUR]), stacked: true };
}

/** @param {Report} report */
export function causesChart(report) {
  const series = Object.entries(report.causes_over_time).map(([cause, counts]) => bars(report, cause, "packets", counts));
  const colours = [...causeLooks(report).values()].map(({ colour }) => colour);
  return { ...overTime(report, "packets lost", 250, series, colours), stacked: true };
}

/** @param {Report} report @returns {import("./matrix.js").Cell[]} */
export function matrixCells(report) {
  const place = new Map(report.endpoints.map((name, index) => [name, index]));
  return report.links.flatMap(({ source, destination, offered, delivered, dropped, loss, causes }) => {
    const [from, to] = [place.get(source), place.get(destination)];
    if (from === undefined || to === undefined) return [];
    const lost = Object.entries(causes).map(([cause, count]) => `, ${count} ${cause}`).join("");
    const waiting = offered - delivered - dropped;
    const text = `${source} to ${destination}: ${delivered} of ${offered} delivered${lost}${waiting ? `, ${waiting} in flight` : ""}`;
    return [{ from, to, loss, text }];
  });
}

/** The last frame from above, with paths, endpoints without a body, and lost packets. @param {Report} report */
export function mapData(report) {
  const { tracks, standing, losses } = report.map;
  const map = mapOf(report.scene, Float32Array.from(report.poses.flat(), (value) => value ?? NaN));
  const shapes = new Map(map.bodies.map((body) => [body.name, body.shapes]));
  const looks = causeLooks(report);
  const bodies = tracks.map(({ name, at, is_gone, pieces }) => ({
    name, at, shapes: shapes.get(name) ?? [], paths: pieces, ...(is_gone ? { note: "(removed)" } : {}),
  }));
  const still = Object.entries(standing).map(([name, at]) => ({ name, at, shapes: [] }));
  const marks = losses.map(({ at, cause, source, destination, sent_ns }) => ({
    at, ...(looks.get(cause) ?? { colour: LOSS_COLOUR, sign: SIGNS[0] }), text: `${source} to ${destination}: ${cause} at ${(sent_ns / 1e9).toFixed(3)} s`,
  }));
  return { ...map, bodies: [...bodies, ...still], marks };
}
