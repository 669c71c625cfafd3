// What a report draws, as far as it needs no browser.

import assert from "node:assert/strict";
import test from "node:test";
import { Plan } from "../src/map.js";
import { placeLabels } from "../src/map_labels.js";
import { delayChart, lanesOf, lossChart, mapData, matrixCells, causesChart } from "../src/report_drawings.js";
import { lonely, stack } from "../src/series.js";
import { ticks } from "../src/text.js";

test("names stand within the map, and none on another one, however many bodies are in a corner", () => {
  const at = [[0, 0], [800, 600], [400, 300], [420, 305], [0, 300]];
  const places = [...Array(60).keys()].map((n) => ({ x: at[n % 5][0], y: at[n % 5][1], text: `rover${n}.arm` }));
  const labels = placeLabels(places, { width: 800, height: 600 });
  const boxes = labels.map(({ x, y }, n) => ({ left: x - 3.3 * places[n].text.length, right: x + 3.3 * places[n].text.length, y }));
  for (const { left, right, y } of boxes) assert.ok(left >= 0 && right <= 800 && y >= 12 && y <= 600);
  const clash = (a, b) => a.left < b.right && b.left < a.right && Math.abs(a.y - b.y) < 12;
  assert.deepEqual(boxes.filter((box, n) => boxes.slice(0, n).some((other) => clash(box, other))), []);
  assert.ok(labels.filter(({ apart }) => apart).length > 20, "a line leads to those that had to go far");
  assert.ok(!labels[0].apart);
});

test("a map fills its place, has one scale, and keeps at its edge what is beyond", () => {
  for (const [width, height] of [[1000, 500], [300, 900], [800, undefined]]) {
    const plan = new Plan([[-1, -2], [3, 2]], width, height);
    const [low, high] = [plan.pixel([-1, -2]), plan.pixel([3, 2])];
    assert.ok(Math.abs(high.x - low.x - (low.y - high.y)) < 1e-9, "four metres are as long across as along");
    assert.ok(low.x > 0 && high.x < width && high.y > 0 && low.y < plan.height);
    assert.ok(Math.abs(low.x + high.x - width) < 1e-6, "the field stands in the middle");
    assert.deepEqual([low.out, plan.pixel([-50, 0]).out, plan.pixel([50, 9]).out, plan.pixel([0, 90]).out], ["", "◀", "▶", "▲"]);
    assert.equal(Math.round(plan.pixel([50, 0]).x), width - 10);
  }
});

test("bars are stacked, the highest first", () => {
  const one = (name, points) => ({ name, unit: "", points });
  const stacked = stack([one("a", [[0, 1], [1, 2]]), one("b", [[0, 3], [1, null]])]);
  assert.deepEqual(stacked.map(({ name, points }) => [name, points]), [["b", [[0, 4], [1, 2]]], ["a", [[0, 1], [1, 2]]]]);
});

test("a value between two gaps is a point, one beside a value of another series is none", () => {
  const found = [[1, null, 2, 3, null, 4], [1, undefined, 2], [null, undefined, 5, undefined, null], []].map(lonely);
  assert.deepEqual(found, [[0, 5], [], [2], []]);
});

test("a time axis has round numbers", () => {
  assert.deepEqual(ticks(0, 32, 8), [0, 5, 10, 15, 20, 25, 30]);
  assert.deepEqual(ticks(0.1, 0.4, 4), [0.1, 0.2, 0.3, 0.4]);
  assert.deepEqual(ticks(3, 3, 8), [3]);
});

const BINS = [[1, 0], [0, 0], [1, 1], [0, 1], [1, 0]].map(([delivered, dropped]) => ({ delivered, dropped, p50_ms: 5, p95_ms: 7 }));
const link = (source, destination, offered, delivered, dropped, loss) =>
  ({ source, destination, offered, delivered, dropped, loss, causes: dropped ? { snr: dropped } : {} });
const REPORT = {
  start_ns: 0, end_ns: 50e9, bin_ns: 10e9,
  causes_over_time: { full: [0, 0, 1, 0, 0], snr: [0, 0, 0, 1, 0] },
  channels: [{ name: "pose", bins: BINS }],
  endpoints: ["a", "b"],
  links: [link("a", "b", 6, 3, 2, 0.4), link("b", "a", 1, 0, 0, null), link("a", "elsewhere", 1, 1, 0, 0)],
  events: [
    { at_ns: 1e9, kind: "goal", text: "goal of red", by: "rules" },
    { at_ns: 2e9, kind: "network", text: "clog", by: "deployment" },
    { at_ns: 3e9, kind: "push", text: "push ball", by: "requested" },
    { at_ns: 4e9, kind: "recovery", text: "loss n1", by: "recovery" },
  ],
  looks: { goal: "star" },
  bands: [
    { kind: "settings", start_ns: 0, end_ns: 50e9, text: "fast: loss 30 %" },
    { kind: "partition", start_ns: 10e9, end_ns: 20e9, text: "a | b" },
  ],
  map: {
    tracks: [
      { name: "ball", at: [1, 2], is_gone: false, pieces: [[[0, 0], [1, 2]]] },
      { name: "ball-2", at: [3, 4], is_gone: true, pieces: [[[3, 4]]] },
    ],
    standing: { base: [9, 9] },
    losses: [{ at: [0.5, 0.5], cause: "snr", source: "a", destination: "b", sent_ns: 1.5e9 }],
  },
  scene: {
    bounds: [[-1, -1, 0], [1, 1, 1]], scenery: [], meshes: {},
    links: ["ball", "ball-2"].map((name) => ({ name, body: name, shapes: [{ kind: "sphere", radius: 0.1, position: [0, 0, 0], orientation: [0, 0, 0, 1], colour: [1, 0, 0, 1] }] })),
    bodies: ["ball", "ball-2"].map((name, index) => ({ name, links: [index] })),
  },
  poses: [[1, 2, 0, 0, 0, 0, 1], Array(7).fill(null)],
};

test("a line of a chart breaks where all was lost, and goes on over a span without packets", () => {
  const delay = delayChart(REPORT, REPORT.channels[0]);
  assert.deepEqual(delay.series.map(({ points }) => points), [7, 5].map((ms) => [[5, ms], [25, ms], [35, null], [45, ms]]));
  assert.deepEqual([delay.range, delay.moments], [[0, 50], [4]]);
  assert.deepEqual(delay.shades.map(({ from, to, text }) => [from, to, text]), [[10, 20, "partition: a | b"]]);
  assert.deepEqual(lossChart(REPORT, REPORT.channels[0]).series[0].points, [[5, 0], [15, 0], [25, 50], [35, 100], [45, 0]]);
  const causes = causesChart(REPORT);
  assert.deepEqual(causes.series.map(({ name, points }) => [name, points.map(([, count]) => count)]), Object.entries(REPORT.causes_over_time));
  assert.equal(new Set(causes.colours).size, 2);
});

test("spans and events have a lane for each kind, events of the deployment that of their spans", () => {
  const lanes = lanesOf(REPORT);
  assert.deepEqual(lanes.map(({ name, mark, look }) => [name, mark, look]), [
    ["partition", undefined, undefined], ["settings", undefined, undefined],
    ["goal", "goal", "star"], ["requested", "request", undefined], ["recovery", "recovery", undefined],
  ]);
  assert.deepEqual(lanes[0].entries, [{ from: 10, to: 20, text: "10 s to 20 s: a | b" }]);
  assert.deepEqual(lanes[3].entries, [{ from: 3, text: "3 s: push ball" }]);
});

test("the matrix has the links of the endpoints that are shown", () => {
  assert.deepEqual(matrixCells(REPORT), [
    { from: 0, to: 1, loss: 0.4, text: "a to b: 3 of 6 delivered, 2 snr, 1 in flight" },
    { from: 1, to: 0, loss: null, text: "b to a: 0 of 1 delivered, 1 in flight" },
  ]);
});

test("the map has bodies as they are at the end, removed ones by name, endpoints without a body, and losses", () => {
  const map = mapData(REPORT);
  assert.deepEqual(map.bodies.map(({ name, at, shapes, note }) => [name, at, shapes.length, note]), [
    ["ball", [1, 2], 1, undefined], ["ball-2", [3, 4], 0, "(removed)"], ["base", [9, 9], 0, undefined],
  ]);
  assert.deepEqual(map.marks.map(({ at, text }) => [at, text]), [[[0.5, 0.5], "a to b: snr at 1.500 s"]]);
  assert.notEqual(map.marks[0].colour, "");
});
