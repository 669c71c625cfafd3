// The tab "Machines": nodes with what they own, load, lag, who is waited for; recoveries. Robots are dragged to nodes.

import { coloursOf, paletteColour } from "./colours.js";
import { confirmed } from "./dialogs.js";
import { timeChart } from "./plots.js";
import { Ring } from "./ring.js";
import { counted, milliseconds, number, percent } from "./text.js";
import { button, byId, h, keyed, setText } from "./ui.js";

const SPAN_S = 120;
const DRAG_PX = 6;
const ROBOTS_SHOWN_MAX = 60;
const RECOVERIES_SHOWN = 50;

/** @param {any} entry of the account of recoveries */
export function recoveryText(entry) {
  const texts = /** @type {Record<string, string>} */ ({
    node: `lost node ${entry.name} (${entry.reason})`,
    join: `node ${entry.name} takes part`,
    supervisor: "the supervisor was started again",
    vhub: `lost the vHub (${entry.reason})`,
    player: `lost ${entry.name} (${entry.reason})`,
    away: `continues without ${entry.name} (${entry.reason})`,
    return: `${entry.name} takes part again`,
  });
  const after = entry.outage_ms === null ? "" : `, continued after ${number(entry.outage_ms, 2)} ms`;
  return `${texts[entry.what] ?? `${entry.what} ${entry.name}`}${after}, epoch ${entry.epoch}`;
}

/**
 * The programs at gateways, a row each; a gateway without any has one row, too.
 * @param {Record<string, any>} gateways
 * @returns {string[][]} name, kind, program, what it is connected to, rate
 */
export function programsOf(gateways) {
  return Object.entries(gateways).flatMap(([name, { kind, programs }]) =>
    programs.length ? programs.map((/** @type {any} */ one) => [name, kind, one.name, one.what, number(one.hz, 1)]) : [[name, kind, "–", "", ""]],
  );
}

export class Machines {
  /** @param {import("./store.js").Store} store @param {import("./desk.js").Desk} desk */
  constructor(store, desk) {
    this.store = store;
    this.desk = desk;
    this.lags = new Ring(6000);
    this.head = h("p", { class: "summary" });
    this.balance = button("Balance", () => void this.desk.ask("balance"), { id: "balance", title: "Move robots from busy nodes to idle ones; the answer says which, and why" });
    this.nodes = h("div", { class: "nodes", "aria-label": "Nodes" });
    this.others = h("tbody");
    this.gateways = h("tbody");
    this.recoveries = h("ol", { class: "recoveries", "aria-label": "Recoveries" });
    const lag = h("div");
    this.chart = timeChart(lag, { unit: "lag (ms)", height: 140 });
    const columns = ["Name", "Role", "Process", "Load", "Waits for"].map((name) => h("th", { scope: "col", class: "left" }, name));
    byId("panel-machines").append(
      h("section", {}, h("div", { class: "row" }, h("h2", {}, "Nodes"), this.balance), this.head, this.nodes),
      h("section", {}, h("h2", {}, "Lag of ticks"), lag),
      h("section", {}, h("h2", {}, "Other roles"), h("table", {}, h("thead", {}, h("tr", {}, ...columns)), this.others)),
      (this.atGateways = h("section", { "aria-label": "Gateways" }, h("h2", {}, "Gateways"), h("table", {}, h("thead", {}, h("tr", {}, ...["Name", "Kind", "Program", "Connected to", "Messages/s"].map((name) => h("th", { scope: "col", class: "left" }, name)))), this.gateways))),
      h("section", {}, h("h2", {}, "Recoveries"), this.recoveries),
    );
    store.on("status", (source) => {
      if (source.info.id !== 0) return;
      if (source.status?.late) this.lags.push(source.status.ticks, source.status.late.lag_ms);
      this.draw();
    });
    for (const name of ["sources", "connected"]) store.on(name, () => this.draw());
    store.on("theme", () => this.chart.redraw());
  }

  draw() {
    const source = this.store.main;
    const status = source?.status;
    if (!source || !status || byId("panel-machines").hidden) return;
    const lag = status.lag_ms;
    const late = status.late?.waited_for ? `; tick ${status.late.tick} waited for ${status.late.waited_for}` : "";
    setText(this.head, lag ? `Epoch ${status.epoch}. Lag p50 ${milliseconds(lag.p50)}, p99 ${milliseconds(lag.p99)}, max ${milliseconds(lag.max)}${late}` : `Epoch ${status.epoch ?? "–"}.`);
    const nodes = Object.entries(status.nodes ?? {});
    const colours = coloursOf(nodes.map(([name]) => name));
    keyed(this.nodes, nodes, ([name]) => name, ([name]) => this._card(name), (card, [name, node]) => this._fill(card, name, node, status, colours));
    this.balance.hidden = !source.may("balance") || nodes.length < 2;
    this.balance.disabled = !this.desk.may("balance");
    const others = Object.entries(status.processes ?? {}).filter(([name]) => !(name in (status.nodes ?? {})));
    keyed(this.others, others, ([name]) => name, () => h("tr", {}, h("th", { scope: "row", class: "left" }), h("td", { class: "left" }), h("td", { class: "left" }), h("td"), h("td", { class: "left" })), (row, [name, process]) => {
      [name, process.role, status.shared?.[name] ?? name, percent(process.busy, 0), doing(process)].forEach((text, index) => setText(row.children[index], text));
    });
    const programs = programsOf(status.gateways ?? {});
    this.atGateways.hidden = !programs.length;
    keyed(this.gateways, programs, (row) => row.slice(0, 4).join(" "), () => h("tr", {}, h("th", { scope: "row", class: "left" }), h("td", { class: "left" }), h("td", { class: "left" }), h("td", { class: "left" }), h("td")), (row, texts) => texts.forEach((text, index) => setText(row.children[index], text)));
    const recoveries = [...(status.recoveries ?? [])].reverse().slice(0, RECOVERIES_SHOWN);
    keyed(this.recoveries, recoveries, (entry) => JSON.stringify(entry), (entry) => h("li", {}, h("b", {}, `${source.seconds(entry.tick).toFixed(3)} s`), ` tick ${entry.tick}: ${recoveryText(entry)}`));
    if (!recoveries.length) this.recoveries.replaceChildren(h("li", { class: "hint" }, "Nothing was lost so far."));
    const first = source.tick - SPAN_S / (source.info.tick_ns / 1e9);
    this.chart.update([{ name: "lag", unit: "ms", points: this.lags.window(first, source.tick, 300).map(([tick, value]) => [source.seconds(tick), value]) }]);
  }

  /** @param {string} name */
  _card(name) {
    const toggle = button("", () => void this.toggle(name), {});
    return h(
      "article",
      { class: "node", "data-node": name, "aria-label": `Node ${name}` },
      h("header", {}, h("i", { class: "swatch", "aria-hidden": "true" }), h("h3", {}, name), h("span", { class: "doing" }), toggle),
      h("div", { class: "load" }, h("i", { "aria-hidden": "true" }), h("span")),
      h("div", { class: "robots" }),
      h("p", { class: "hint" }),
    );
  }

  /**
   * @param {HTMLElement} card @param {string} name @param {any} node @param {Status} status
   * @param {Map<string, string>} colours
   */
  _fill(card, name, node, status, colours) {
    const process = status.processes?.[name];
    const [header, load, robots, more] = /** @type {HTMLElement[]} */ ([...card.children]);
    /** @type {HTMLElement} */ (header.children[0]).style.background = colours.get(name) ?? paletteColour(7);
    setText(header.children[2], doing(process));
    const toggle = /** @type {HTMLButtonElement} */ (header.children[3]);
    const gone = !process || process.stopped || process.lost;
    setText(toggle, gone ? "Start" : "Stop …");
    toggle.className = gone ? "" : "danger";
    toggle.hidden = !this.store.main?.may(gone ? "start" : "stop");
    const shared = status.shared?.[name];
    toggle.disabled = !this.desk.may(gone ? "start" : "stop") || (shared && !gone);
    toggle.title = shared && !gone ? `${name} shares process ${shared}, so it cannot be stopped alone` : "";
    const busy = process?.busy ?? 0;
    const owned = node.owned.filter((/** @type {string} */ robot) => !this.store.main?.absent.has(robot));
    load.style.setProperty("--share", String(Math.min(1, busy)));
    setText(load.children[1], `load ${percent(busy, 0)}, ${counted(owned.length, "robot")}${shared ? `, process ${shared}` : ""}${process?.host ? `, on ${process.host}` : ""}`);
    const mayMove = this.desk.may("move");
    keyed(robots, owned.slice(0, ROBOTS_SHOWN_MAX), (/** @type {string} */ robot) => robot, (/** @type {string} */ robot) => this._chip(robot), (chip) => chip.classList.toggle("movable", mayMove));
    const hidden = owned.length - ROBOTS_SHOWN_MAX;
    setText(more, hidden > 0 ? `and ${hidden} more` : owned.length ? "" : "owns no robot");
  }

  /** A robot, to be dragged to another node, or moved by its button. @param {string} robot */
  _chip(robot) {
    const chip = h("button", { type: "button", class: "chip", title: `${robot}: drag it to a node, or press Enter to move it` }, robot);
    /** @type {{x: number, y: number, ghost: HTMLElement | null} | null} */
    let drag = null;
    chip.addEventListener("pointerdown", (event) => {
      if (event.button !== 0 || !chip.classList.contains("movable")) return;
      chip.setPointerCapture(event.pointerId);
      drag = { x: event.clientX, y: event.clientY, ghost: null };
    });
    chip.addEventListener("pointermove", (event) => {
      if (!drag) return;
      if (!drag.ghost && Math.hypot(event.clientX - drag.x, event.clientY - drag.y) < DRAG_PX) return;
      drag.ghost ??= document.body.appendChild(h("div", { class: "chip dragged" }, robot));
      drag.ghost.style.transform = `translate(${event.clientX}px, ${event.clientY}px)`;
      this._mark(nodeAt(event.clientX, event.clientY));
    });
    const finish = (/** @type {PointerEvent} */ event, /** @type {boolean} */ dropped) => {
      if (!drag) return;
      const { ghost } = drag;
      drag = null;
      ghost?.remove();
      this._mark("");
      const node = ghost && dropped ? nodeAt(event.clientX, event.clientY) : "";
      if (node && node !== this.store.main?.ownerOf(robot)) void this.desk.ask("move", { robot, node });
      else if (dropped && !ghost) this.store.select(robot);
    };
    chip.addEventListener("pointerup", (event) => finish(event, true));
    chip.addEventListener("pointercancel", (event) => finish(event, false));
    chip.addEventListener("keydown", (event) => {
      if (event.key !== "Enter" || !this.desk.may("move")) return;
      event.preventDefault();
      this.store.emit("move", robot);
    });
    return chip;
  }

  /** @param {string} node the one that a robot would be dropped on */
  _mark(node) {
    for (const card of this.nodes.children) card.classList.toggle("target", /** @type {HTMLElement} */ (card).dataset.node === node);
  }

  /** @param {string} name */
  async toggle(name) {
    const process = this.store.main?.status?.processes?.[name];
    if (!process || process.stopped || process.lost) {
      await this.desk.ask("start", { node: name });
      return;
    }
    const text = `Its robots move to the other nodes first. The world does not notice; the node can be started again.`;
    if (await confirmed(`Stop node ${name}?`, text, "Stop node")) await this.desk.ask("stop", { node: name });
  }
}

/** @param {any} process */
function doing(process) {
  if (!process) return "not here yet";
  if (process.stopped) return "stopped";
  if (process.lost) return "lost";
  return process.waiting_for ? `waits for ${process.waiting_for}` : "";
}

/** The node whose card is at a place of the window. @param {number} x @param {number} y */
function nodeAt(x, y) {
  const card = /** @type {HTMLElement | null | undefined} */ (document.elementFromPoint(x, y)?.closest("[data-node]"));
  return card?.dataset.node ?? "";
}
