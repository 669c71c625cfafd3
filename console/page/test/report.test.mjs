// What a report draws, as far as it needs no browser.

import assert from "node:assert/strict";
import test from "node:test";
import { Plan } from "../src/map.js";
import { placeLabels } from "../src/map_labels.js";
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
