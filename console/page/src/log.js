// The tab "Log": answers with who asked, notes of the console, requests of others.

import { byId, h, keyed } from "./ui.js";

const SHOWN = 200;

export class Log {
  /** @param {import("./store.js").Store} store */
  constructor(store) {
    this.store = store;
    this.requests = h("tbody");
    this.notes = h("ol", { class: "log", "aria-label": "Log" });
    const head = ["Tick", "Who", "Request", "Answer"].map((name) => h("th", { scope: "col", class: "left" }, name));
    byId("panel-log").append(
      h("section", {}, h("h2", {}, "Requests that changed something"), h("table", {}, h("thead", {}, h("tr", {}, ...head)), this.requests)),
      h("section", {}, h("h2", {}, "This page"), this.notes),
    );
    store.on("note", () => this.draw());
    store.on("status", () => this.draw());
  }

  /** What to try where nothing was tried yet. */
  invitation() {
    const source = this.store.main;
    const tries = [
      source?.may("push") && "push the selected body (World)",
      source?.may("add") && "add an entity (World)",
      source?.may("network") && "cut a link (Network, Partition)",
    ].filter(Boolean);
    return `None so far.${tries.length ? ` A first experiment: ${tries.join(", ")}.` : ""}`;
  }

  draw() {
    if (byId("panel-log").hidden) return;
    const requests = [...(this.store.main?.status?.requests ?? [])].reverse();
    keyed(
      this.requests, requests, (one) => JSON.stringify(one),
      (one) => h("tr", { class: one.accepted ? "" : "refused" }, h("td", { class: "left" }, one.tick), h("td", { class: "left" }, one.who), h("td", { class: "left" }, one.verb), h("td", { class: "left" }, one.accepted ? one.text : `refused: ${one.text}`)),
    );
    if (!requests.length) this.requests.replaceChildren(h("tr", {}, h("td", { class: "left hint", colspan: 4 }, this.invitation())));
    const notes = this.store.notes.slice(-SHOWN).reverse();
    keyed(
      this.notes, notes, (note) => `${note.at.getTime()} ${note.text}`,
      (note) => h("li", { class: note.level }, h("time", {}, note.at.toLocaleTimeString()), note.who ? h("b", {}, ` ${note.who}`) : null, ` ${note.text}`),
    );
  }
}
