// The parts of the page that need no browser: `node --test test`.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import test from "node:test";
import { Matrix4 } from "three";
import { addableOf, placeOf } from "../src/adding.js";
import { choiceOf, choicesOf } from "../src/choices.js";
import { curveVariable, lossColour } from "../src/colours.js";
import { Connection, tokenOf } from "../src/connection.js";
import { settingsOf } from "../src/disturb.js";
import { motionOf } from "../src/driving.js";
import { programsOf } from "../src/machines.js";
import { scaleLength } from "../src/map.js";
import { fromAbove } from "../src/map_data.js";
import { decodePoses } from "../src/messages.js";
import { bannerOf, stateOf } from "../src/presence.js";
import { moreText, oldText } from "../src/network.js";
import { Ring } from "../src/ring.js";
import { goingOf, numbersTo } from "../src/sending.js";
import { batchesOf, linkMatrix } from "../src/shapes.js";
import { Source, Store } from "../src/store.js";
import { number, numberPaths, time, valueAt } from "../src/text.js";

const INFO = { id: 0, kind: "live", name: "run", world: "table", tick_ns: 2e6, verbs: ["pause"], span: null };

function posesMessage({ generation = 1, tick = 5, links = 1, values = [] } = {}) {
  const view = new DataView(new ArrayBuffer(24 + 28 * links + 4 * values.length));
  view.setUint8(0, 1);
  view.setUint8(2, 3);
  view.setUint32(4, generation, true);
  view.setFloat64(8, tick, true);
  view.setUint32(16, links, true);
  view.setUint32(20, values.length, true);
  for (let index = 0; index < 7 * links; index += 1) view.setFloat32(24 + 4 * index, index, true);
  values.forEach((value, index) => view.setFloat32(24 + 28 * links + 4 * index, value, true));
  return view.buffer;
}

test("programs at gateways have a row each, and a gateway without any has one, too", () => {
  const gateways = { morse: { kind: "socket", programs: [{ name: "tcp/[::1]:9", what: "cat.pose", hz: 50 }] }, log: { kind: "text", programs: [] } };
  assert.deepEqual(programsOf(gateways), [["morse", "socket", "tcp/[::1]:9", "cat.pose", "50"], ["log", "text", "–", "", ""]]);
});

test("poses are decoded, and refused where their length is not what they say", () => {
  const poses = decodePoses(posesMessage({ links: 2, values: [1.5, -2] }));
  assert.deepEqual([poses.source, poses.jump, poses.paused, poses.generation, poses.tick], [0, true, true, 1, 5]);
  assert.deepEqual([...poses.links.slice(0, 3), ...poses.values], [0, 1, 2, 1.5, -2]);
  assert.throws(() => decodePoses(posesMessage().slice(0, 40)), /take 52/);
  assert.throws(() => decodePoses(new ArrayBuffer(3)), /3 bytes/);
});

test("poses of another scene than the page has are dropped", () => {
  const store = new Store();
  store.take({ type: "welcome", role: "viewer", version: "1", sources: [INFO] });
  store.take({ type: "scene", source: 0, generation: 2, links: [], bodies: [] });
  store.takePoses(decodePoses(posesMessage({ generation: 1 })));
  assert.equal(store.main.poses, null);
  store.takePoses(decodePoses(posesMessage({ generation: 2 })));
  assert.equal(store.main.tick, 5);
});

test("what has no pose is absent, and who listens is told when that changes", () => {
  const store = new Store();
  store.take({ type: "welcome", role: "viewer", version: "1", sources: [INFO] });
  const bodies = [{ name: "a", links: [0] }, { name: "b", links: [1] }, { name: "bare", links: [] }];
  store.take({ type: "scene", source: 0, generation: 1, links: [], bodies });
  const told = [];
  store.on("absent", (source) => told.push([...source.absent]));
  const there = decodePoses(posesMessage({ links: 2 }));
  const gone = decodePoses(posesMessage({ links: 2 }));
  gone.links.fill(NaN, 7);
  for (const poses of [there, gone, gone, there]) store.takePoses(poses);
  assert.deepEqual(told, [["b"], []]);
  assert.deepEqual(linkMatrix(gone.links, 1, new Matrix4()).elements.slice(0, 15), new Array(15).fill(0));
  assert.deepEqual(linkMatrix(there.links, 0, new Matrix4()).elements.slice(12, 15), [0, 1, 2]);
});

test("what can be added are entities and fleets that are absent, at a place with units", () => {
  const bodies = ["ball", "ball-2", "ball-3", "crate", "rod"].map((name) => ({ name, removable: name !== "ball" && name !== "rod" }));
  const names = (absent) => addableOf(bodies, new Set(absent)).map(([name]) => name);
  assert.deepEqual(names(["ball-2", "ball-3", "rod"]), ["ball-2", "ball-3", "ball"]);
  assert.deepEqual(names(["ball-3", "crate"]), ["ball-3", "crate"]);
  assert.deepEqual(names([]), []);
  assert.deepEqual(placeOf({ x: " 0.5", y: "20 cm", z: "", yaw: "-90" }), { x: "0.5 m", y: "20 cm", yaw: "-90 deg" });
  assert.equal(placeOf({ x: "", y: " " }), undefined);
});

test("one listener that fails is reported, and the others are told", () => {
  const reported = [];
  globalThis.window = { reportError: (error) => reported.push(error.message) };
  const store = new Store();
  const told = [];
  store.on("status", () => { throw new Error("broken"); });
  store.on("status", (value) => told.push(value));
  store.emit("status", 7);
  delete globalThis.window;
  assert.deepEqual([reported, told], [["broken"], [7]]);
});

test("a ring keeps its order, forgets what is later than a jump back, and is bounded", () => {
  const ring = new Ring(100);
  for (let tick = 0; tick < 1000; tick += 1) ring.push(tick, tick % 50);
  assert.ok(ring.ticks.length <= 125);
  assert.equal(ring.ticks.at(-1), 999);
  ring.push(950, 1);
  assert.equal(ring.ticks.at(-1), 950);
  ring.merge([[10, 4], [940, 9]]);
  assert.deepEqual(ring.ticks, [...ring.ticks].sort((a, b) => a - b));
  assert.equal(ring.values[ring.ticks.indexOf(940)], 9);
});

test("what is drawn of many points keeps the least and the greatest", () => {
  const ring = new Ring(10_000);
  for (let tick = 0; tick < 10_000; tick += 1) ring.push(tick, tick === 4321 ? 100 : tick === 7777 ? -100 : 0);
  const values = ring.window(0, 10_000, 50).map(([, value]) => value);
  assert.ok(values.length <= 100);
  assert.deepEqual([Math.max(...values), Math.min(...values)], [100, -100]);
});

test("numbers of a field whose units differ have names of their own", () => {
  const source = new Source(INFO);
  const run = { entity: "red.goal", field: "joint_positions" };
  source.scene = { fields: [{ ...run, unit: "m", index: 4, count: 1 }, { ...run, unit: "rad", index: 5, count: 1 }], sensors: [{ robot: "camera", channel: "ball", unit: "m", numbers: [] }] };
  source.status = { lag_ms: { p99: 1 }, nodes: { "a.b": { solved_ticks: 3 } } };
  const choices = choicesOf(source);
  assert.deepEqual(choices.get("red.goal joint_positions[1]"), { name: "red.goal joint_positions[1]", unit: "rad", request: { field: 5 } });
  assert.deepEqual(choiceOf(choices, "reading camera/ball[2]").request, { reading: ["camera", "ball"], index: 2 });
  assert.deepEqual(choiceOf(choices, "link a → b: delay").request, { link: ["a", "b"], figure: "delay_ms" });
  assert.equal(choiceOf(choices, "nothing"), null);
});

test("a joint's numbers have its name, whatever is in it", () => {
  const source = new Source(INFO);
  source.scene = {
    fields: [{ entity: "arm", field: "joint_positions", name: "left/elbow [1]", unit: "rad", index: 7, count: 1 }],
    sensors: [{ robot: "arm", channel: "state", unit: "", numbers: [["positions.left/elbow [1]", "rad"], ["efforts.left/elbow [1]", "N m"]] }],
  };
  const choices = choicesOf(source);
  assert.deepEqual(choices.get("arm joint_positions.left/elbow [1]").request, { field: 7 });
  assert.deepEqual(choiceOf(choices, "reading arm/state.efforts.left/elbow [1]"), { name: "reading arm/state.efforts.left/elbow [1]", unit: "N m", request: { reading: ["arm", "state"], index: 1 } });
});

test("a command is picked by robot, channel and number, and holds until the next one", () => {
  const source = new Source(INFO);
  const run = { entity: "red.goal", field: "wanted" };
  const told = { robot: "red.goal", channel: "position" };
  source.scene = {
    fields: [{ ...run, unit: "m", index: 4, count: 1 }, { ...run, unit: "rad", index: 5, count: 1 }], sensors: [],
    commands: [{ ...told, number: "slide", unit: "m", index: 4 }, { ...told, number: "spin", unit: "rad", index: 5 }],
  };
  const choices = choicesOf(source);
  assert.deepEqual([...choices.keys()], ["command red.goal/position.slide", "command red.goal/position.spin"]);
  assert.deepEqual(choiceOf(choices, "command red.goal/position.spin"), { name: "command red.goal/position.spin", unit: "rad", hint: "set-point", step: true, request: { field: 5 } });
});

test("values of a status are found by their path, also under names with dots", () => {
  const status = { lag_ms: { p99: 1.5 }, nodes: { "a.b": { solved_ticks: 3 } }, state: "running" };
  assert.deepEqual(numberPaths(status).map((path) => [path, valueAt(status, path)]), [["lag_ms.p99", 1.5], ["nodes.a.b.solved_ticks", 3]]);
  assert.equal(valueAt(status, "lag_ms.p50"), null);
});

test("settings are read as they are written", () => {
  assert.deepEqual(JSON.parse(JSON.stringify(settingsOf("loss: 5 %\nburst.loss = 1 %\nburst.mean_bad: 40 ms\ncopies: 2"))), {
    loss: "5 %", burst: { loss: "1 %", mean_bad: "40 ms" }, copies: 2,
  });
  assert.match(settingsOf("loss"), /key: value/);
  assert.match(settingsOf(""), /At least one/);
});

test("tokens, times, numbers, scales", () => {
  assert.deepEqual([tokenOf("#view=a-b_c"), tokenOf("#operate=x"), tokenOf("")], ["a-b_c", "x", ""]);
  assert.deepEqual([time(12.3456), time(123.45), time(3723.45)], ["12.346 s", "2:03.450", "1:02:03.450"]);
  assert.deepEqual([number(0), number(1.23456), number(1234.5), number(null)], ["0", "1.235", "1235", "–"]);
  assert.deepEqual([scaleLength(1.4), scaleLength(40)], [0.2, 5]);
  assert.deepEqual([lossColour(0), lossColour(2)], [[0, 0.447, 0.698], [0.835, 0.369, 0]]);
});

test("a box that is turned is seen from above as it lies", () => {
  const box = { kind: "box", half: [2, 1, 1], position: [0, 0, 0], orientation: [0, 0, Math.SQRT1_2, Math.SQRT1_2], colour: [1, 0, 0, 1], name: "" };
  const { at, points } = fromAbove(box, [3, 4, 0], [0, 0, 0, 1], {});
  assert.deepEqual(at, [3, 4]);
  assert.equal(Math.round(Math.max(...points.map(([x]) => x))), 1);
  assert.equal(Math.round(Math.max(...points.map(([, y]) => y))), 2);
});

test("a capsule is seen from above as a circle where it stands, as long as its ends where it lies", () => {
  const capsule = { kind: "capsule", radius: 0.5, length: 2, position: [0, 0, 0], orientation: [0, 0, 0, 1], colour: [1, 0, 0, 1], name: "" };
  const upright = fromAbove(capsule, [3, 4, 0], [0, 0, 0, 1], {});
  assert.deepEqual([upright.kind, upright.at, upright.radius], ["circle", [3, 4], 0.5]);
  const { points } = fromAbove(capsule, [3, 4, 0], [0, Math.SQRT1_2, 0, Math.SQRT1_2], {});
  const [across, along] = [0, 1].map((axis) => points.map((point) => point[axis])).map((all) => Math.max(...all) - Math.min(...all)).reverse();
  assert.ok(Math.abs(along - 3) < 1e-9 && Math.abs(across - 1) < 1e-9, `${along} by ${across}`);
});

test("capsules of one size are drawn together, others apart, each with round ends", () => {
  const shape = (radius, length) => ({ kind: "capsule", radius, length, position: [0, 0, 0], orientation: [0, 0, 0, 1], colour: [1, 0, 0, 1], name: "" });
  const scene = { scenery: [shape(0.5, 2), shape(0.5, 2), shape(0.2, 1)], links: [], meshes: {} };
  const batches = batchesOf(scene, 1);
  assert.deepEqual(batches.map(({ placed }) => placed.length), [2, 1]);
  for (const [{ mesh }, high, wide] of [[batches[0], 1.5, 0.5], [batches[1], 0.7, 0.2]]) {
    mesh.geometry.computeBoundingBox();
    const { max } = mesh.geometry.boundingBox;
    assert.ok(Math.abs(max.z - high) < 1e-6 && Math.abs(max.x - wide) < 1e-6, `${max.x}, ${max.z}`);
  }
});

test("a run that has ended is said, with its capture, whatever becomes of the console", () => {
  const store = new Store();
  store.take({ type: "welcome", role: "viewer", version: "1", sources: [INFO] });
  const ended = { type: "presence", source: 0, state: "ended", failed: false, text: "The run has ended at tick 5: done." };
  const away = { type: "presence", source: 0, state: "away", text: "lost run; reconnecting" };
  assert.equal(bannerOf("", store.main.presence), "");
  store.take(away);
  assert.deepEqual([bannerOf("", store.main.presence), stateOf(true, store.main.presence, "running")], [away.text, "supervisor away"]);
  assert.deepEqual([bannerOf("Not connected", away), stateOf(false, away, "running")], ["Not connected", "not connected"]);
  store.take(ended);
  assert.deepEqual([bannerOf("Not connected", store.main.presence), stateOf(false, store.main.presence, "running")], [ended.text, "ended"]);
  assert.equal(stateOf(true, { ...ended, failed: true }, "running"), "failed");
});

test("a console whose run has ended is requested every 15 s, another one sooner, until it is back", () => {
  const [sockets, waits, told] = [[], [], []];
  globalThis.window = { setTimeout: (_, wait_ms) => waits.push(wait_ms) };
  globalThis.WebSocket = class {
    constructor() {
      this.on = {};
      sockets.push(this);
    }
    addEventListener(name, listener) { this.on[name] = listener; }
  };
  const connection = new Connection("ws://x/ws", "", { binary: () => {}, message: () => {}, changed: (_, text) => told.push(text) });
  const close = (event) => {
    connection.open();
    sockets.at(-1).on.close(event);
  };
  close({ code: 1001, reason: "the console was ended" });
  close({ code: 4410, reason: "The run has ended: done." });
  close({ code: 1006, reason: "" });
  connection.open();
  sockets.at(-1).on.message({ data: '{"type": "welcome"}' });
  close({ code: 1006, reason: "" });
  delete globalThis.window;
  delete globalThis.WebSocket;
  assert.deepEqual(waits.map((wait_ms) => (wait_ms > 11_000 ? "long" : wait_ms < 1000 ? "short" : wait_ms)), ["short", "long", "long", "short"]);
  assert.equal(told[0], "Not connected: the console was ended. Trying again …");
  assert.equal(told[1], "The run has ended: done.");
});

test("what the table of links leaves out, and that its figures are old, is said", () => {
  assert.equal(moreText(0, 0, 0), "No link was used yet.");
  assert.equal(moreText(18, 18, 18), "");
  assert.equal(moreText(200, 1482, 3), "200 of 1,482 links, the busiest and the watched ones. Any other is watched by its ends.");
  assert.equal(moreText(203, 203, 203), "3 more links: find the ones you want above.");
  assert.equal(oldText({ vhub_away: false, vhub_lost: null }), "");
  assert.equal(oldText(null), "");
  assert.equal(
    oldText({ vhub_away: true, vhub_lost: { reason: "its connection has closed", tick: 73, for_s: 1.25 } }),
    "⚠ The vHub is away since tick 73, for 1.25 s: its connection has closed. Packets and links are those of its last report.",
  );
});

function meshOf(points) {
  const base64 = (array) => Buffer.from(array.buffer).toString("base64");
  return { vertices: base64(Float32Array.from(points.flat())), triangles: base64(new Uint32Array(0)) };
}

test("a mesh is seen from above by its convex outline, turned as it stands", () => {
  const shape = { kind: "mesh", mesh: "m", position: [0, 0, 0], orientation: [0, 0, 0, 1], colour: [1, 0, 0, 1], name: "" };
  const wedge = meshOf([[0, 0, 0], [2, 0, 0], [0, 1, 0], [0, 0, 3], [0.5, 0.2, 1]]);
  const around = (points) => points.map((point) => point.map((value) => Math.round(value * 100) / 100 + 0));
  const flat = fromAbove(shape, [1, 1, 0], [0, 0, 0, 1], { m: wedge });
  assert.deepEqual([flat.at, around(flat.points)], [[1, 1], [[0, 0], [2, 0], [0, 1]]]);
  const lying = fromAbove(shape, [0, 0, 0], [0, Math.SQRT1_2, 0, Math.SQRT1_2], { m: wedge });
  assert.deepEqual(around(lying.points), [[0, 0], [3, 0], [0, 1]], "what was up points along x");
  assert.equal(fromAbove(shape, [0, 0, 0], [0, 0, 0, 1], {}), null);
  const ball = Array.from({ length: 5000 }, (_, index) => {
    const [z, angle] = [1 - (2 * index + 1) / 5000, index * 2.399963];
    return [Math.sqrt(1 - z * z) * Math.cos(angle), Math.sqrt(1 - z * z) * Math.sin(angle), z];
  });
  const { points } = fromAbove(shape, [0, 0, 0], [0, 0, 0, 1], { m: meshOf(ball) });
  assert.ok(points.length > 10 && points.length < 400 && points.every((point) => Math.hypot(...point) > 0.95));
});

/** The relative luminance of WCAG 2. @param {string} colour */
function luminance(colour) {
  const [red, green, blue] = [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16) / 255).map((share) => (share <= 0.04045 ? share / 12.92 : ((share + 0.055) / 1.055) ** 2.4));
  return 0.2126 * red + 0.7152 * green + 0.0722 * blue;
}

test("every curve stands out from the ground of its theme", () => {
  const rules = readFileSync(new URL("../src/theme.css", import.meta.url), "utf8").split("{").filter((rule) => rule.includes("--ground"));
  assert.equal(rules.length, 3, "light, dark as the system is, dark as it was chosen");
  const themes = rules.map((rule) => new Map([...rule.matchAll(/(--[\w-]+): (#[0-9a-f]{6});/g)].map(([, name, colour]) => [name, colour])));
  assert.deepEqual(themes[1], themes[2]);
  for (const theme of themes) {
    const colours = [...Array(8).keys()].map((index) => theme.get(curveVariable(index)) ?? "none");
    assert.equal(new Set(colours).size, 8);
    for (const colour of colours) {
      const [low, high] = [luminance(colour), luminance(theme.get("--ground") ?? "")].sort((a, b) => a - b);
      assert.ok((high + 0.05) / (low + 0.05) > (theme === themes[0] ? 2 : 4), colour);
    }
  }
});

test("a place is what a robot is sent to: on the ground, or at a height and with the heading that it has", () => {
  const jobs = (...numbers) => ({ jobs: [{ actuator: "arm", numbers: ["q1"] }, { actuator: "drive", numbers }] });
  assert.equal(goingOf(jobs("x", "y")).actuator, "drive");
  assert.equal(goingOf(jobs("x", "y", "z", "yaw")).actuator, "drive");
  assert.deepEqual([goingOf(jobs("x", "y", "force")), goingOf(jobs("x")), goingOf({ jobs: [] }), goingOf(undefined)], Array(4).fill(undefined));
  const pose = [5, 6, 7, 0, 0, Math.SQRT1_2, Math.SQRT1_2];
  assert.deepEqual(numbersTo(["x", "y"], [1.23456, -2], pose, 3), { x: 1.235, y: -2 });
  assert.deepEqual(numbersTo(["x", "y", "z", "yaw"], [1, 2], pose, 3), { x: 1, y: 2, z: 3, yaw: 1.571 });
});

test("opposite arrow keys cancel each other, and none stops", () => {
  assert.deepEqual(motionOf(["ArrowUp", "ArrowLeft"]), { ahead: 1, left: 1 });
  assert.deepEqual(motionOf(["ArrowDown", "ArrowRight"]), { ahead: -1, left: -1 });
  assert.deepEqual(motionOf(["ArrowUp", "ArrowDown", "ArrowRight"]), { ahead: 0, left: -1 });
  assert.deepEqual(motionOf([]), { ahead: 0, left: 0 });
});
