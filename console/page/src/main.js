// The page: connects, builds its parts, and draws with the browser's frames.

import { Comparison } from "./compare.js";
import { coloursOf } from "./colours.js";
import { Connection, tokenOf } from "./connection.js";
import { Control } from "./control.js";
import { Desk } from "./desk.js";
import { Driving } from "./driving.js";
import { Entities } from "./entities.js";
import { Eye } from "./eye.js";
import { Layout, Memory } from "./layout.js";
import { Log } from "./log.js";
import { Machines } from "./machines.js";
import { MapView } from "./mapview.js";
import { decodePoses } from "./messages.js";
import { Network } from "./network.js";
import { PlotPanel } from "./plot_panel.js";
import { bannerOf } from "./presence.js";
import { Sending } from "./sending.js";
import { shortcutsOf } from "./shortcuts.js";
import { Store } from "./store.js";
import { Timeline } from "./timeline.js";
import { byId, h, keyed, setText } from "./ui.js";
import { View3D } from "./view3d.js";
import { ViewBar } from "./view_bar.js";

const HZ = 50;

/** @type {Stat} */
const stat = {
  frames: 0, tick: -1, generation: -1, connected: false, errors: 0, messages: 0, poses: 0, links: 0, bodies: 0, absent: 0, drawn: -1,
  role: "", paused: false, marks: 0, contacts: 0, rays: 0, radio: 0, flashes: 0, flashing: 0, view: "",
};
window.foosim = { stat };
window.addEventListener("error", () => (stat.errors += 1));
window.addEventListener("unhandledrejection", () => (stat.errors += 1));

const store = new Store();
const memory = new Memory();
/** @type {import("./view3d.js").Options} */
const options = { labels: true, owners: false, paths: false, contacts: false, rays: false, radio: true, two: "ghost", ...memory.get("show", {}), follow: false };

let lost = "";

function drawBanner() {
  const text = bannerOf(lost, store.main?.presence);
  byId("banner").hidden = !text;
  setText(byId("banner"), text);
}

const scheme = window.location.protocol === "https:" ? "wss" : "ws";
const connection = new Connection(`${scheme}://${window.location.host}/ws`, tokenOf(window.location.hash), {
  binary: (buffer) => {
    stat.messages += 1;
    const poses = decodePoses(buffer);
    store.takePoses(poses);
    if (poses.source === 0) stat.poses += 1;
  },
  message: (message) => {
    stat.messages += 1;
    store.take(message);
  },
  changed: (connected, text) => {
    stat.connected = connected;
    lost = text;
    drawBanner();
    if (connected) queueMicrotask(() => store.emit("connected", true));
    else store.emit("connected", false);
  },
});
const send = (/** @type {object} */ message) => connection.send(message);

const layout = new Layout(store, memory);
const desk = new Desk(connection, store, byId("toasts"));
const control = new Control(store, desk);
const timeline = new Timeline(store, desk, control);
const plots = new PlotPanel(store, send, memory);
const sending = new Sending(store, desk);
const entities = new Entities(store, desk, {
  follow: () => bar.toggle("follow"),
  plot: (entity) => {
    layout.show("plots");
    plots.search(`${entity} `);
  },
}, h("div", { class: "sending" }, sending.place, new Driving(store, desk).place));
new Network(store, desk, plots);
new Machines(store, desk);
new Comparison(store);
const log = new Log(store);
const view = makeView();
const bar = new ViewBar(options, changedOption, () => view.home());
new Eye(connection, store, byId("corner"));

function makeView() {
  const has3d = document.createElement("canvas").getContext("webgl2") !== null;
  stat.view = has3d ? "3d" : "map";
  byId("view-bar").hidden = !has3d;
  return has3d ? new View3D(byId("view"), store, options, stat) : new MapView(byId("view"), store, stat);
}

/** @param {string} name of an option of the view */
function changedOption(name) {
  if (name === "two") view.rearrange();
  memory.set("show", options);
  show();
  store.emit("options");
  view.touch();
}

/** Tell the console which overlays are drawn: nobody computes what nobody sees. */
function show() {
  const overlays = [options.contacts ? "contacts" : "", options.rays ? "rays" : ""].filter(Boolean);
  for (const source of store.sources.keys()) send({ type: "show", source, overlays, hz: HZ });
}

function watch() {
  send({ type: "watch", source: 0, link: store.link });
}

function drawOwners() {
  const names = options.owners ? Object.keys(store.main?.status?.nodes ?? {}) : [];
  const colours = coloursOf(names);
  bar.owners.hidden = !names.length;
  keyed(bar.owners, names, (name) => name, (name) => h("span", {}, h("i", { class: "swatch", style: `background:${colours.get(name)}` }), name));
}

function drawSigns() {
  bar.signs.hidden = !options.radio || stat.view !== "3d" || !store.main?.links.length;
  bar.scale.hidden = !store.main?.links.some(({ radio }) => radio);
}

store.on("connected", (connected) => {
  if (!connected) return;
  show();
  watch();
});
store.on("link", watch);
for (const name of ["presence", "sources"]) store.on(name, drawBanner);
store.on("sources", () => {
  stat.role = store.role;
  byId("role").textContent = store.role;
  byId("role").title = store.role === "viewer" ? "This page may look, and not touch" : "This page may touch the run";
  const name = store.main?.info.world || store.main?.info.name || "";
  document.title = name ? `${name} · foosim` : "foosim";
});
store.on("theme", () => view.retheme());
store.on("move", (robot) => void entities.askMove(robot));
store.on("tab", () => log.draw());
for (const name of ["status", "options"]) store.on(name, drawOwners);
for (const name of ["links", "options"]) store.on(name, drawSigns);
store.on("poses", (source) => {
  if (source.info.id !== 0) return;
  stat.tick = source.tick;
  stat.paused = source.paused;
  stat.absent = source.absent.size;
});
store.on("scene", (source) => {
  if (source.info.id !== 0) return;
  stat.generation = source.scene.generation;
  stat.links = source.scene.links.length;
  stat.bodies = source.scene.bodies.length;
});
store.on("marks", (source) => source.info.id === 0 && (stat.marks = source.marks.length));
layout.add(...shortcutsOf({ store, control, timeline, layout, bar, home: () => view.home(), send: () => sending.aim(), pick: () => {
  layout.show("plots");
  plots.search("");
} }));

/** @param {number} now_ms */
function frame(now_ms) {
  window.requestAnimationFrame(frame);
  timeline.follow();
  plots.draw(now_ms);
}

window.requestAnimationFrame(frame);
connection.open();
