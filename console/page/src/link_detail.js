// The link that is selected: its rule, its figures as charts, its drops by cause, and what became of the last of them.

import { bars, timeChart } from "./plots.js";
import { Ring } from "./ring.js";
import { button, h, keyed, setText } from "./ui.js";

const SPAN_S = 120;
const COLUMNS = 300;

export class LinkDetail {
  /** @param {HTMLElement} place @param {import("./store.js").Store} store @param {import("./plot_panel.js").PlotPanel} plots */
  constructor(place, store, plots) {
    this.place = place;
    this.store = store;
    this.head = h("h2");
    this.unused = h("p", { class: "hint" }, "No packet was told of on this link so far: figures come with the first.");
    this.rule = h("pre", { class: "rule", tabindex: 0, "aria-label": "Rule of the link" });
    this.causes = h("div", { "aria-label": "Drops by cause" });
    this.drops = h("div", { class: "drops" });
    const charts = h("div", { class: "charts" });
    const [delay, loss] = [h("div"), h("div")];
    charts.append(delay, loss);
    this.delay = timeChart(delay, { unit: "ms", height: 150 });
    this.loss = timeChart(loss, { unit: "%", height: 150 });
    this.rings = { delay: new Ring(4000), queue: new Ring(4000), loss: new Ring(4000) };
    const plot = (/** @type {string} */ figure) => () => store.link && plots.addLink(store.link, figure);
    const actions = h("div", { class: "row" },
      button("Plot delay", plot("delay_ms")), button("Plot loss", plot("loss")), button("Plot queue", plot("queue_ms")),
      button("Close", () => store.selectLink(null)));
    place.append(this.head, this.unused, actions, charts, h("h3", {}, "Drops by cause"), this.causes, h("h3", {}, "Rule"), this.rule, h("h3", {}, "The last drops"), this.drops);
    store.on("link", () => this._chosen());
    store.on("links", (source) => source.info.id === 0 && this._take(source));
    store.on("watched", (source) => source.info.id === 0 && this._watched(source));
    store.on("theme", () => [this.delay, this.loss].forEach((chart) => chart.redraw()));
    this._chosen();
  }

  _chosen() {
    const link = this.store.link;
    this.place.hidden = !link;
    for (const ring of Object.values(this.rings)) ring.cut(0);
    if (!link) return;
    setText(this.head, `${link[0]} → ${link[1]}`);
    setText(this.rule, "…");
    this.drops.replaceChildren(h("p", { class: "hint" }, "No drop since this link was selected."));
    if (this.store.main) this._take(this.store.main);
  }

  /** @param {import("./store.js").Source} source */
  _take(source) {
    const chosen = this.store.link;
    const link = chosen && source.links.find((one) => one.from === chosen[0] && one.to === chosen[1]);
    this.unused.hidden = !chosen || !!link;
    if (!link) return;
    this.rings.delay.push(source.tick, link.delay_ms);
    this.rings.queue.push(source.tick, link.queue_ms);
    this.rings.loss.push(source.tick, link.loss === null ? null : link.loss * 100);
    bars(this.causes, link.causes);
  }

  draw() {
    const source = this.store.main;
    if (!source || !this.store.link || this.place.hidden) return;
    const last = source.tick;
    const first = last - SPAN_S / (source.info.tick_ns / 1e9);
    const points = (/** @type {Ring} */ ring) =>
      /** @type {[number, number | null][]} */ (ring.window(first, last, COLUMNS).map(([tick, value]) => [source.seconds(tick), value]));
    this.delay.update([
      { name: "delay", unit: "ms", points: points(this.rings.delay) },
      { name: "queue", unit: "ms", points: points(this.rings.queue) },
    ]);
    this.loss.update([{ name: "loss", unit: "%", points: points(this.rings.loss) }]);
  }

  /** @param {import("./store.js").Source} source */
  _watched(source) {
    const { watched } = source;
    if (!watched || this.store.link?.join("\n") !== watched.link.join("\n")) return;
    setText(this.rule, watched.rule);
    if (!watched.drops.length) return;
    if (!this.drops.firstElementChild?.matches("details")) this.drops.replaceChildren();
    keyed(this.drops, [...watched.drops].reverse(), (drop) => `${drop.tick} ${drop.head}`, (drop) => this._drop(drop, source));
  }

  /** @param {ExplainedDrop} drop @param {import("./store.js").Source} source */
  _drop(drop, source) {
    const steps = drop.steps.map((step) => h("tr", { class: step.outcome }, h("th", { scope: "row" }, step.stage), h("td", {}, step.text)));
    return h(
      "details",
      {},
      h("summary", {}, h("b", {}, drop.cause), ` at ${source.seconds(drop.tick).toFixed(3)} s (tick ${drop.tick})`),
      h("p", {}, drop.head),
      h("table", { class: "steps" }, h("tbody", {}, ...steps)),
      h("p", {}, drop.verdict),
    );
  }
}
