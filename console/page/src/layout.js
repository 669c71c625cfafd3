// How the page is laid out, kept in the browser: tab, width of the panel, theme, what the view shows. And the keyboard.

import { shown } from "./dialogs.js";
import { byId, h } from "./ui.js";

const KEY = "foosim.console";
const PANEL_MIN_PX = 300;
const VIEW_MIN_PX = 320;
const TABS = ["world", "network", "machines", "plots", "compare", "log"];

/** What the page remembers. A browser that keeps nothing has the defaults. */
export class Memory {
  constructor() {
    /** @type {Record<string, any>} */
    this.values = {};
    try {
      const kept = JSON.parse(localStorage.getItem(KEY) ?? "{}");
      if (kept && typeof kept === "object") this.values = kept;
    } catch {
      this.values = {};
    }
  }

  /** @param {string} key @param {any} otherwise */
  get(key, otherwise) {
    const value = this.values[key];
    return typeof value === typeof otherwise && Array.isArray(value) === Array.isArray(otherwise) ? value : otherwise;
  }

  /** @param {string} key @param {any} value */
  set(key, value) {
    this.values[key] = value;
    try {
      localStorage.setItem(KEY, JSON.stringify(this.values));
    } catch {
      return; // a private window: the layout lasts as long as the page
    }
  }

  forget() {
    this.values = {};
    try {
      localStorage.removeItem(KEY);
    } catch {
      return;
    }
  }
}

/** @typedef {{keys: string[], shown: string, text: string, act: (event: KeyboardEvent) => void}} Shortcut */

export class Layout {
  /** @param {import("./store.js").Store} store @param {Memory} memory */
  constructor(store, memory) {
    this.store = store;
    this.memory = memory;
    /** @type {Shortcut[]} */
    this.shortcuts = [];
    this._tabs();
    this._splitter();
    this.theme(memory.get("theme", "auto"));
    byId("theme").addEventListener("click", () => this.nextTheme());
    window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.theme(this.name ?? "auto"));
    byId("help").addEventListener("click", () => this.help());
    document.addEventListener("keydown", (event) => this._key(event));
    store.on("show-tab", (tab) => this.show(tab));
    this.show(memory.get("tab", "world"));
  }

  _tabs() {
    for (const tab of TABS) {
      byId(`tab-${tab}`).addEventListener("click", () => this.show(tab));
      byId(`tab-${tab}`).addEventListener("keydown", (event) => {
        const by = event.key === "ArrowRight" ? 1 : event.key === "ArrowLeft" ? -1 : 0;
        if (!by) return;
        const open = TABS.filter((one) => !byId(`tab-${one}`).hidden);
        const next = open[(open.indexOf(tab) + by + open.length) % open.length];
        this.show(next);
        byId(`tab-${next}`).focus();
      });
    }
  }

  /** @param {string} wanted */
  show(wanted) {
    const chosen = TABS.includes(wanted) ? wanted : "world";
    for (const tab of TABS) {
      const isChosen = tab === chosen;
      byId(`tab-${tab}`).setAttribute("aria-selected", String(isChosen));
      byId(`tab-${tab}`).tabIndex = isChosen ? 0 : -1;
      byId(`panel-${tab}`).hidden = !isChosen;
    }
    this.memory.set("tab", chosen);
    this.store.emit("tab", chosen);
    if (this.store.main) for (const name of ["status", "links", "compared"]) this.store.emit(name, this.store.main);
  }

  _splitter() {
    const splitter = byId("splitter");
    const set = (/** @type {number} */ px) => {
      const width = Math.round(Math.max(PANEL_MIN_PX, Math.min(window.innerWidth - VIEW_MIN_PX, px)));
      document.documentElement.style.setProperty("--panel", `${width}px`);
      splitter.setAttribute("aria-valuenow", String(width));
      return width;
    };
    let width = set(this.memory.get("panel", Math.min(520, window.innerWidth * 0.42)));
    const keep = (/** @type {number} */ px) => this.memory.set("panel", (width = set(px)));
    splitter.addEventListener("pointerdown", (event) => splitter.setPointerCapture(event.pointerId));
    splitter.addEventListener("pointermove", (event) => {
      if (splitter.hasPointerCapture(event.pointerId)) keep(window.innerWidth - event.clientX);
    });
    splitter.addEventListener("keydown", (event) => {
      const by = event.key === "ArrowLeft" ? 20 : event.key === "ArrowRight" ? -20 : 0;
      if (!by) return;
      event.preventDefault();
      event.stopPropagation();
      keep(width + by);
    });
    window.addEventListener("resize", () => set(width));
  }

  /** @param {string} name auto, light or dark */
  theme(name) {
    this.name = ["light", "dark"].includes(name) ? name : "auto";
    document.documentElement.dataset.theme = this.name;
    byId("theme").textContent = { auto: "◐", light: "○", dark: "●" }[this.name] ?? "";
    byId("theme").setAttribute("aria-label", `Theme: ${this.name === "auto" ? "as the system" : this.name}`);
    this.memory.set("theme", this.name);
    this.store.emit("theme", this.name);
  }

  nextTheme() {
    const order = ["auto", "light", "dark"];
    this.theme(order[(order.indexOf(this.name ?? "auto") + 1) % order.length]);
  }

  /** @param {Shortcut[]} shortcuts */
  add(...shortcuts) {
    this.shortcuts.push(...shortcuts);
  }

  /** @param {KeyboardEvent} event */
  _key(event) {
    const target = /** @type {HTMLElement} */ (event.target);
    if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]")) return;
    if (target.closest("input:not([type=range]):not([type=checkbox]), textarea, select")) return;
    // A button in focus has the space bar for itself.
    if (event.key === " " && target.closest("button, summary, [tabindex='0'] tr")) return;
    if (event.key.startsWith("Arrow") && target.closest("[role=tab], input")) return;
    const found = this.shortcuts.find(({ keys }) => keys.includes(event.shiftKey && event.key.startsWith("Arrow") ? `Shift+${event.key}` : event.key));
    if (!found) return;
    event.preventDefault();
    found.act(event);
  }

  help() {
    const rows = this.shortcuts.map(({ shown: keys, text }) => h("tr", {}, h("th", { scope: "row", class: "left" }, h("kbd", {}, keys)), h("td", { class: "left" }, text)));
    const mouse = [["Drag", "turn the view"], ["Right drag", "shift the view"], ["Wheel, pinch", "nearer or farther"], ["Click", "select an entity"], ["Drag a robot's name", "move it to a node"], ["Drag in a chart", "zoom into a span; Live goes back"]];
    const pointer = mouse.map(([what, text]) => h("tr", {}, h("th", { scope: "row", class: "left" }, what), h("td", { class: "left" }, text)));
    const reset = h("button", { type: "button" }, "Forget the saved layout");
    reset.addEventListener("click", () => {
      this.memory.forget();
      window.location.reload();
    });
    shown("Keys and pointer", [h("div", { class: "help" }, h("table", {}, h("tbody", {}, ...rows)), h("table", {}, h("tbody", {}, ...pointer))), reset, h("p", { class: "hint" }, `foosim ${this.store.version}`)]);
  }
}
