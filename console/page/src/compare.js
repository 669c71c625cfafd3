// Two sources: how they are shown, and the distance between them over time.

import { timeChart } from "./plots.js";
import { number, time } from "./text.js";
import { byId, h, keyed, setText } from "./ui.js";

const ROWS_MAX = 40;

export class Comparison {
  /** @param {import("./store.js").Store} store */
  constructor(store) {
    this.store = store;
    const place = h("div");
    this.head = h("p", { class: "summary" });
    this.body = h("tbody");
    byId("panel-compare").append(
      h("section", {}, h("h2", {}, "Distance between the two"), this.head, place),
      h("section", {}, h("h2", {}, "By entity"), h("table", {}, h("thead", {}, h("tr", {}, h("th", { scope: "col", class: "left" }, "Entity"), h("th", { scope: "col" }, "Distance"))), this.body)),
    );
    this.chart = timeChart(place, { unit: "greatest distance (m)", height: 200 });
    store.on("compared", () => this.draw());
    store.on("sources", () => {
      byId("tab-compare").hidden = store.sources.size < 2;
      byId("two").hidden = store.sources.size < 2;
    });
    store.on("theme", () => this.chart.redraw());
  }

  /**
   * What is said where the second one has nothing at this time.
   * @param {Compared} compared @param {import("./store.js").Source} main
   */
  beyond({ at, covers }, main) {
    if (!covers || (covers[0] <= at && at <= covers[1])) return "";
    const name = this.store.sources.get(1)?.info.name ?? "the second";
    return ` · ${name} has ${time(main.seconds(covers[0]))} to ${time(main.seconds(covers[1]))} of this clock, and nothing here`;
  }

  draw() {
    const { compared, main } = this.store;
    if (!compared || !main || byId("panel-compare").hidden) return;
    const names = [...this.store.sources.values()].map(({ info }) => info.name).join(" and ");
    setText(this.head, `${names} at ${time(main.seconds(compared.at))}${this.beyond(compared, main)}`);
    const series = compared.series.map(([tick, metres]) => /** @type {[number, number]} */ ([main.seconds(tick), metres]));
    this.chart.update([{ name: "greatest distance", unit: "m", points: series }]);
    const rows = [...compared.entities].sort((a, b) => b.distance_m - a.distance_m).slice(0, ROWS_MAX);
    keyed(this.body, rows, ({ name }) => name, ({ name }) => h("tr", {}, h("th", { scope: "row", class: "left" }, name), h("td")), (row, { distance_m }) => setText(row.children[1], `${number(distance_m, 4)} m`));
  }
}
