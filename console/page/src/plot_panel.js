// The tab "Plots": charts of what was picked, live or scrolled back over the last minutes.

import { choiceOf, choicesOf, linkChoice } from "./choices.js";
import { timeChart } from "./plots.js";
import { Ring } from "./ring.js";
import { time } from "./text.js";
import { button, byId, field, h, keyed, select, setText } from "./ui.js";

const SERIES_MAX = 32;
const SERIES_A_CHART_MAX = 8;
const SPANS = /** @type {[string, string][]} */ ([["5", "5 s"], ["20", "20 s"], ["60", "1 min"], ["300", "5 min"], ["900", "15 min"]]);
const COLUMNS = 500;
const EVERY_MS = 150;

/** @typedef {import("./choices.js").Choice & {id: string, ring: Ring}} Line */
/** @typedef {{unit: string, lines: Line[], card: HTMLElement, legend: HTMLElement, chart: ReturnType<typeof timeChart>}} Card */

export class PlotPanel {
  /**
   * @param {import("./store.js").Store} store
   * @param {(message: object) => boolean} send
   * @param {{get: (key: string, otherwise: any) => any, set: (key: string, value: any) => void}} layout
   */
  constructor(store, send, layout) {
    this.store = store;
    this.send = send;
    this.layout = layout;
    /** @type {Card[]} */
    this.cards = [];
    /** @type {string[]} names that wait for a scene that has them */
    this.wanted = layout.get("plots", []);
    this.made = 0;
    this.span_s = Number(layout.get("span_s", 60));
    /** @type {number | null} the time (s) at the right end; null: the newest */
    this.end_s = null;
    this.next_ms = 0;
    this.names = h("datalist", { id: "plottable" });
    this.pick = h("input", { id: "pick", list: "plottable", placeholder: "Pick a value: an entity, command, lag_ms, loss …", autocomplete: "off", spellcheck: false });
    this.span = select(SPANS, String(this.span_s), { "aria-label": "Length of the time axis", onchange: () => this._spanned() });
    this.back = h("input", { type: "range", min: 0, max: 0, value: 0, step: "any", "aria-label": "Scroll back", oninput: () => this._scrolled() });
    this.live = button("Live", () => this.follow(), { "aria-pressed": "true", title: "Follow the newest values" });
    this.at = h("span", { class: "hint" });
    this.list = h("div", { class: "charts" });
    this.empty = h("p", { class: "hint" }, "Nothing is plotted yet. Numbers of the world, commands, readings, figures of links and values of the status can be picked above; links and entities have buttons of their own.");
    this._build();
    store.on("poses", (source) => source.info.id === 0 && this._take(source));
    store.on("plotted", (message) => message.source === 0 && this._merge(message.series));
    store.on("scene", (source) => source.info.id === 0 && this._scene(source));
    store.on("connected", (connected) => connected && this.subscribe());
    for (const name of ["links", "status"]) store.on(name, () => this._resolve());
    store.on("theme", () => this.cards.forEach(({ chart }) => chart.redraw()));
  }

  _build() {
    this.pick.addEventListener("focus", () => this._offer());
    this.pick.addEventListener("change", () => this._picked());
    const form = h("form", { class: "row", onsubmit: (/** @type {Event} */ event) => {
      event.preventDefault();
      this._picked();
    } }, field("Value", this.pick), h("button", { type: "submit" }, "Plot"));
    byId("panel-plots").append(form, this.names, h("div", { class: "row" }, this.span, this.back, this.live, this.at), this.empty, this.list);
  }

  /** Fill the list of names when it is about to be opened. */
  _offer() {
    const source = this.store.main;
    if (!source) return;
    const choices = [...choicesOf(source).values()];
    keyed(this.names, choices, ({ name }) => name, ({ name, unit, hint }) => h("option", { value: name }, [hint, unit].filter(Boolean).join(", ")));
  }

  /** @param {string} text the beginning of names */
  search(text) {
    this.pick.value = text;
    this.pick.focus();
  }

  _picked() {
    const name = this.pick.value.trim();
    if (!name || !this.store.main) return;
    if (!this.addNamed(name)) return;
    this.pick.value = "";
  }

  /** @param {string} name */
  addNamed(name) {
    const source = this.store.main;
    const choice = source && choiceOf(choicesOf(source), name);
    if (choice) this.add(choice);
    return Boolean(choice);
  }

  /** @param {[string, string]} link @param {string} figure */
  addLink(link, figure) {
    this.add(linkChoice(link, figure));
    this.store.emit("show-tab", "plots");
  }

  get lines() {
    return this.cards.flatMap(({ lines }) => lines);
  }

  /** @param {import("./choices.js").Choice} choice */
  add(choice) {
    if (this.lines.some(({ name }) => name === choice.name)) return;
    if (this.lines.length >= SERIES_MAX) {
      this.store.note("warning", `at most ${SERIES_MAX} values are plotted at once; close one`);
      return;
    }
    this.made += 1;
    const line = { ...choice, id: `s${this.made}`, ring: new Ring() };
    const card = this.cards.find(({ unit, lines }) => unit === choice.unit && unit && lines.length < SERIES_A_CHART_MAX) ?? this._card(choice.unit);
    card.lines.push(line);
    this._changed();
  }

  /** @param {Line} line */
  remove(line) {
    for (const card of this.cards) {
      card.lines = card.lines.filter((one) => one !== line);
      if (card.lines.length) continue;
      card.chart.destroy();
      card.card.remove();
    }
    this.cards = this.cards.filter(({ lines }) => lines.length);
    this._changed();
  }

  /** @param {string} unit @returns {Card} */
  _card(unit) {
    const legend = h("ul", { class: "lines" });
    const place = h("div");
    const card = h("article", { class: "chart" }, legend, place);
    this.list.append(card);
    const chart = timeChart(place, { unit, height: 170 });
    chart.onzoom = (from, to) => this._zoomed(from, to);
    const made = { unit, lines: [], card, legend, chart };
    this.cards.push(made);
    return made;
  }

  _changed() {
    for (const { lines, legend } of this.cards) {
      keyed(legend, lines, ({ id }) => id, (line) => h("li", {}, `${line.name}${line.unit ? ` (${line.unit})` : ""} `, button("×", () => this.remove(line), { "aria-label": `Close ${line.name}`, class: "quiet" })));
    }
    this.empty.hidden = this.cards.length > 0;
    this.layout.set("plots", [...this.lines.map(({ name }) => name), ...this.wanted]);
    this.subscribe();
    this.next_ms = 0;
  }

  /** Tell the console what is plotted. */
  subscribe() {
    const generation = this.store.main?.scene?.generation;
    const series = this.lines.map(({ id, request }) => ({ id, ...request }));
    if (generation === undefined) return;
    this.send({ type: "plot", source: 0, series, generation });
  }

  /** A page may come to another run, whose numbers are in other places: they are found again by name. @param {import("./store.js").Source} source */
  _scene(source) {
    const choices = choicesOf(source);
    for (const line of this.lines) {
      if (line.request.field === undefined) continue;
      const choice = choices.get(line.name);
      if (choice) line.request = choice.request;
      else this.remove(line);
    }
    this._resolve();
    this.subscribe();
  }

  /** Plot what a saved layout names, as soon as there is a value of that name. */
  _resolve() {
    if (!this.wanted.length || !this.store.main?.scene) return;
    const names = this.wanted;
    this.wanted = [];
    this.wanted = names.filter((name) => !this.addNamed(name));
  }

  /** @param {import("./store.js").Source} source */
  _take(source) {
    const { poses } = source;
    const fields = this.lines.filter(({ request }) => request.field !== undefined);
    // After a change, poses that were on their way have the values of before.
    if (!poses || !fields.length || poses.values.length !== fields.length) return;
    fields.forEach(({ ring }, index) => ring.push(poses.tick, Number.isNaN(poses.values[index]) ? null : poses.values[index]));
  }

  /** @param {{id: string, points: [number, number][]}[]} series */
  _merge(series) {
    for (const { id, points } of series) this.lines.find((line) => line.id === id)?.ring.merge(points);
  }

  _spanned() {
    this.span_s = Number(this.span.value);
    this.layout.set("span_s", this.span_s);
    this.next_ms = 0;
  }

  _scrolled() {
    this.end_s = Number(this.back.value);
    this.next_ms = 0;
  }

  /** @param {number} from @param {number} to s */
  _zoomed(from, to) {
    this.span_s = Math.max(0.01, to - from);
    this.end_s = to;
    this.next_ms = 0;
  }

  follow() {
    this.end_s = null;
    this.span_s = Number(this.span.value);
    this.next_ms = 0;
  }

  /** Draw, at most some times a second, and only while it is seen. @param {number} now_ms */
  draw(now_ms) {
    const source = this.store.main;
    if (!source || now_ms < this.next_ms || byId("panel-plots").hidden || !this.cards.length) return;
    this.next_ms = now_ms + EVERY_MS;
    const tick_s = source.info.tick_ns / 1e9;
    const newest_s = source.seconds(source.tick);
    const oldest_s = Math.min(newest_s, ...this.lines.map(({ ring }) => (ring.ticks[0] ?? source.tick) * tick_s));
    const end_s = this.end_s ?? newest_s;
    this.back.min = String(oldest_s);
    this.back.max = String(newest_s);
    if (this.end_s === null) this.back.value = String(newest_s);
    this.live.setAttribute("aria-pressed", String(this.end_s === null));
    setText(this.at, this.end_s === null ? "" : `to ${time(end_s)}`);
    const first_s = Math.max(end_s - this.span_s, Math.min(oldest_s, end_s - 1));
    for (const { lines, chart } of this.cards) {
      const series = lines.map(({ name, unit, ring, step }) => ({
        name, unit, step,
        points: /** @type {[number, number | null][]} */ (ring.window(first_s / tick_s, end_s / tick_s, COLUMNS).map(([tick, value]) => [tick * tick_s, value])),
      }));
      chart.update(series, [first_s, end_s]);
    }
  }
}
