// The tab "Network": packets, what is disturbed, the table of links of the last seconds, and the link that is selected.

import { lossColour, css, lossGradient } from "./colours.js";
import { Disturb } from "./disturb.js";
import { LinkDetail } from "./link_detail.js";
import { causesText, counted, milliseconds, number, percent, whole } from "./text.js";
import { button, byId, h, keyed, setText } from "./ui.js";

const ROWS_MAX = 200;
/** A disturbance that is over is shown no longer than that many. */
const DISTURBANCES_SHOWN = 6;
/** Endpoints that a message names. */
const ENDPOINTS_SAID = 8;

/**
 * @typedef {object} Column
 * @property {string} name
 * @property {string} title
 * @property {(link: LinkWindow) => number | string} by what it is sorted by
 * @property {(link: LinkWindow) => string} text
 * @property {boolean} [left]
 */

/** @type {Column[]} */
const COLUMNS = [
  { name: "From", title: "Who sends", by: (link) => link.from, text: (link) => link.from, left: true },
  { name: "To", title: "Who receives", by: (link) => link.to, text: (link) => link.to, left: true },
  { name: "Loss", title: "Share of packets dropped in the window", by: (link) => -(link.loss ?? -1), text: (link) => percent(link.loss) },
  { name: "Delay", title: "Mean delay of packets delivered in the window", by: (link) => -(link.delay_ms ?? -1), text: (link) => milliseconds(link.delay_ms) },
  { name: "Queue", title: "What waits to be sent, in time", by: (link) => -(link.queue_ms ?? -1), text: (link) => milliseconds(link.queue_ms) },
  { name: "Packets", title: "Packets offered in the window", by: (link) => -link.offered, text: (link) => whole(link.offered) },
  { name: "Causes", title: "Why packets were dropped in the window", by: (link) => -link.dropped, text: (link) => causesText(link.causes), left: true },
];

/** @param {LinkWindow} link */
const keyOf = (link) => `${link.from}\n${link.to}\n${link.rule}`;

export class Network {
  /** @param {import("./store.js").Store} store @param {import("./desk.js").Desk} desk @param {import("./plot_panel.js").PlotPanel} plots */
  constructor(store, desk, plots) {
    this.store = store;
    this.disturb = new Disturb(desk, () => store.link);
    this.desk = desk;
    this.sorted = { column: 5, down: false };
    this.radioOnly = false;
    this.summary = h("p", { class: "summary" });
    this.disturbances = h("ul", { class: "disturbances", "aria-label": "Requested disturbances" });
    this.filter = h("input", { type: "search", placeholder: "Find links", "aria-label": "Find links by end, rule or cause", oninput: () => this.draw() });
    this.body = h("tbody");
    this.more = h("p", { class: "hint" });
    this.old = h("p", { class: "warning", role: "status", hidden: true });
    this.from = h("input", { list: "endpoints", placeholder: "From", "aria-label": "Who sends on the link to watch", autocomplete: "off" });
    this.to = h("input", { list: "endpoints", placeholder: "To", "aria-label": "Who receives on the link to watch", autocomplete: "off" });
    this.pick = h("form", { class: "row", id: "watch-link", "aria-label": "Watch a link by its ends" }, this.from, this.to, h("button", { type: "submit", title: "Show this link, also one that is not in the table" }, "Watch"));
    this.pick.addEventListener("submit", (event) => {
      event.preventDefault();
      this.watch();
    });
    this.endpoints = h("datalist", { id: "endpoints" });
    this.rules = h("datalist", { id: "rules" });
    this.heads = COLUMNS.map((column, index) => {
      const sort = button(column.name, () => this.sortBy(index), { title: column.title });
      return h("th", { scope: "col", class: column.left ? "left" : "" }, sort);
    });
    this.table = h("table", { class: "links" }, h("caption", { class: "hidden" }, "Links of the last seconds"), h("thead", {}, h("tr", {}, ...this.heads)), this.body);
    this.buttons = this._buttons();
    const legend = h("div", { class: "legend", title: "Lines in the view: the half of a link at its sender has its colour" }, "loss 0 %", h("i", { style: `background:${lossGradient()}` }), "100 %");
    const detail = h("section", { class: "detail", "aria-label": "Selected link" });
    byId("panel-network").append(
      h("section", {}, h("h2", {}, "Packets"), this.old, this.summary, this.buttons, this.disturbances),
      h("section", { class: "fill" }, h("div", { class: "row" }, h("h2", {}, "Links"), this.filter, legend), h("div", { class: "scroll" }, this.table), this.more, this.pick),
      detail, this.endpoints, this.rules,
    );
    this.detail = new LinkDetail(detail, store, plots);
    for (const name of ["links", "link", "status", "sources", "connected"]) store.on(name, () => this.draw());
  }

  _buttons() {
    return h(
      "div",
      { class: "row", role: "group", "aria-label": "Disturb the network" },
      button("Partition …", () => void this.disturb.partition(), { id: "partition" }),
      button("Clog …", () => void this.disturb.clog(), { id: "clog" }),
      button("Set …", () => void this.disturb.set(this._rule()), { id: "set" }),
      button("Heal …", () => void this.disturb.heal(), { id: "heal" }),
    );
  }

  /** The link rule of the selected link, or the first one. A link's `rule` has its radio behind a slash. */
  _rule() {
    const rules = this.store.main?.scene?.network?.rules ?? [];
    const [from, to] = this.store.link ?? [];
    const link = this.store.main?.links.find((one) => one.from === from && one.to === to);
    return rules.find((id) => link && (link.rule === id || link.rule.startsWith(`${id}/`))) ?? rules[0] ?? "";
  }

  /** @param {number} column */
  sortBy(column) {
    this.sorted = { column, down: this.sorted.column === column && !this.sorted.down };
    this.draw();
  }

  draw() {
    const source = this.store.main;
    if (!source || byId("panel-network").hidden) return;
    this._draw_summary(source);
    const wanted = this.filter.value.trim().toLowerCase();
    const found = source.links.filter((link) => `${link.from} ${link.to} ${link.rule} ${causesText(link.causes)}`.toLowerCase().includes(wanted));
    const { column, down } = this.sorted;
    const { by } = COLUMNS[column];
    const order = down ? -1 : 1;
    found.sort((a, b) => {
      const [first, second] = [by(a), by(b)];
      return first < second ? -order : first > second ? order : keyOf(a) < keyOf(b) ? -1 : 1;
    });
    // Names go up at first, figures down.
    const rises = COLUMNS[column].name === "From" || COLUMNS[column].name === "To" ? !down : down;
    this.heads.forEach((head, index) => head.setAttribute("aria-sort", index !== column ? "none" : rises ? "ascending" : "descending"));
    keyed(this.body, found.slice(0, ROWS_MAX), keyOf, (link) => this._row(link), (row, link) => this._update(row, link));
    setText(this.more, moreText(source.links.length, source.links_in_all, found.length));
    this.pick.hidden = !source.scene?.network;
    this._draw_lists(source);
    this.detail.draw();
  }

  /** Watch the link between the ends that were typed, whether the table has it or not. */
  watch() {
    const [from, to] = [this.from.value.trim(), this.to.value.trim()];
    const endpoints = this.store.main?.scene?.network?.endpoints ?? [];
    const wrong = [from, to].find((name) => !endpoints.includes(name));
    if (wrong !== undefined) {
      this.store.note("error", `There is no endpoint ${wrong || "without a name"}; there are ${endpoints.slice(0, ENDPOINTS_SAID).join(", ")}${endpoints.length > ENDPOINTS_SAID ? ", …" : ""}`);
      return;
    }
    this.store.selectLink([from, to]);
  }

  /** @param {LinkWindow} link */
  _row(link) {
    const choose = () => this.store.selectLink(this.store.link?.join("\n") === `${link.from}\n${link.to}` ? null : [link.from, link.to]);
    const row = h("tr", { tabindex: 0, onclick: choose });
    row.addEventListener("keydown", (event) => {
      if (event.key === "Enter") choose();
    });
    row.append(...COLUMNS.map((column) => h("td", { class: column.left ? "left" : "" })));
    return row;
  }

  /** @param {HTMLElement} row @param {LinkWindow} link */
  _update(row, link) {
    COLUMNS.forEach((column, index) => setText(row.children[index], column.text(link)));
    const causes = causesText(link.causes);
    row.title = `${link.from} to ${link.to}${causes ? `; dropped: ${causes}` : ""}${link.rule ? `, rule ${link.rule}` : ""}${link.radio ? ", by radio" : ""}${link.walls.length ? `, through ${counted(link.walls.length, "wall")}` : ""}`;
    /** @type {HTMLElement} */ (row.children[2]).style.setProperty("--loss", link.loss === null ? "transparent" : css(lossColour(link.loss)));
    row.setAttribute("aria-selected", String(this.store.link?.[0] === link.from && this.store.link[1] === link.to));
  }

  /** @param {import("./store.js").Source} source */
  _draw_summary(source) {
    const packets = source.status?.packets;
    const old = oldText(source.status);
    this.old.hidden = !old;
    setText(this.old, old);
    this.table.classList.toggle("old", old !== "");
    setText(this.summary, packets
      ? `${whole(packets.offered)} offered, ${whole(packets.delivered)} delivered, ${whole(packets.dropped)} dropped, ${whole(packets.in_flight)} on their way. Links below: the last ${source.window_s} s.`
      : "Nothing is known of packets yet.");
    this.buttons.hidden = !source.may("network");
    for (const one of this.buttons.children) /** @type {HTMLButtonElement} */ (one).disabled = !this.desk.may("network");
    if (!source.scene?.network?.rules.length) /** @type {HTMLButtonElement} */ (byId("set")).disabled = true;
    const last = (source.status?.disruptions?.last ?? []).slice(-DISTURBANCES_SHOWN).reverse();
    keyed(
      this.disturbances, last, (one) => `${one.tick} ${JSON.stringify(one.event)}`,
      (one) => h("li", {}, h("b", {}, `tick ${one.tick}`), " ", eventText(one.event)),
    );
  }

  /** @param {import("./store.js").Source} source */
  _draw_lists(source) {
    const { endpoints = [], rules = [] } = source.scene?.network ?? {};
    for (const [list, names] of /** @type {[HTMLElement, string[]][]} */ ([[this.endpoints, endpoints], [this.rules, rules]])) {
      keyed(list, names, (name) => name, (value) => h("option", { value }));
    }
  }
}

/**
 * What the table has not: links that are not told, links that its filter or its length leave out.
 * @param {number} told @param {number} all links that were used @param {number} found by the filter
 */
export function moreText(told, all, found) {
  const parts = [];
  if (!told) return "No link was used yet.";
  if (all > told) parts.push(`${whole(told)} of ${whole(all)} links, the busiest and the watched ones. Any other is watched by its ends.`);
  if (found > ROWS_MAX) parts.push(`${counted(found - ROWS_MAX, "more link")}: find the ones you want above.`);
  return parts.join(" ");
}

/** That the figures are old, since when, and why; empty where they are not. @param {Status} status */
export function oldText(status) {
  if (!status?.vhub_away) return "";
  const lost = status.vhub_lost;
  const since = lost ? ` since tick ${lost.tick}, for ${number(lost.for_s, 2)} s: ${lost.reason}` : "";
  return `⚠ The vHub is away${since}. Packets and links are those of its last report.`;
}

/**
 * An event in words, as the supervisor's answers have it: `partition arm1 | rest, for 10 s`. @param {any} event
 */
export function eventText(event) {
  const lasts = event.for ? `, for ${typeof event.for === "string" ? event.for : `${event.for.exponential} on average`}` : "";
  const list = (/** @type {any} */ names) => (Array.isArray(names) ? names.join(", ") : String(names));
  if (event.heal) return `heal ${event.heal}`;
  if (event.partition) return `partition ${event.partition.map(list).join(" | ")}${event.symmetric === false ? ", one way" : ""}${lasts}`;
  if (event.clog) return `clog from ${list(event.clog.from)} to ${list(event.clog.to)}${lasts}`;
  if (event.set) return `set ${event.set.link}: ${Object.keys(event.set).filter((key) => key !== "link").join(", ")}`;
  return JSON.stringify(event);
}
