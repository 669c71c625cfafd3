// The bar at the bottom: marks of what happened, by time; for captures and replays the slider, a frame-exact step, loop.

import { markStyle } from "./colours.js";
import { time } from "./text.js";
import { button, byId, h, keyed, setText } from "./ui.js";

const MARKS_DRAWN_MAX = 400;
const SEEK_EVERY_MS = 40;

export class Timeline {
  /** @param {import("./store.js").Store} store @param {import("./desk.js").Desk} desk @param {import("./control.js").Control} control */
  constructor(store, desk, control) {
    this.store = store;
    this.desk = desk;
    this.control = control;
    this.loops = false;
    /** @type {number | null} the tick that the slider is dragged to, until the console shows it */
    this.wanted = null;
    this.asked_ms = 0;
    this.back = button("◀ Frame", () => this.by(-1), { id: "frame-back", title: "One frame back (←)" });
    this.on = button("Frame ▶", () => this.by(1), { id: "frame-on", title: "One frame on (→)" });
    this.loop = button("Loop", () => this.toggleLoop(), { "aria-pressed": "false", id: "loop" });
    this.branch = button("Branch …", () => void this.control.branch(Math.round(this.store.main?.tick ?? 0)), { id: "branch", title: "A new run from this tick" });
    this.slider = h("input", { type: "range", id: "slider", min: 0, max: 1, step: 1, "aria-label": "Simulated time", oninput: () => this.drag(), onchange: () => this.dragged() });
    this.marks = h("div", { class: "marks", "aria-label": "What happened" });
    this.first = h("span", { class: "hint" });
    this.last = h("span", { class: "hint" });
    this.kinds = h("div", { class: "kinds", role: "group", "aria-label": "Marks that are shown" });
    /** @type {Set<string>} */
    this.hidden = new Set();
    this.seek = h("div", { class: "row" }, this.back, this.on, this.loop, this.branch);
    byId("timeline").append(this.seek, this.first, h("div", { class: "track" }, this.marks, this.slider), this.last, this.kinds);
    for (const name of ["sources", "marks", "connected"]) store.on(name, () => this.draw());
    store.on("status", () => this.draw());
    this.drawn = -1;
  }

  /** @returns {[number, number]} the first tick and the last */
  get span() {
    const source = this.store.main;
    const span = source?.info.span;
    if (span) return [span.first, Math.max(span.last, span.first + 1)];
    const first = source?.status?.first_tick ?? 0;
    return [first, Math.max(first + 1, source?.tick ?? 1)];
  }

  draw() {
    const source = this.store.main;
    if (!source) return;
    const [first, last] = this.span;
    const seekable = source.may("seek");
    this.slider.hidden = !seekable;
    this.slider.disabled = !this.desk.may("seek");
    this.slider.min = String(first);
    this.slider.max = String(last);
    this.seek.hidden = !seekable && !source.may("branch");
    for (const one of [this.back, this.on, this.loop]) one.hidden = !seekable;
    this.loop.hidden = !source.may("loop");
    this.branch.hidden = !source.may("branch");
    setText(this.first, time(source.seconds(first)));
    setText(this.last, time(source.seconds(last)));
    const shown = thinned(source.marks.filter(({ kind }) => !this.hidden.has(kind)), first, last);
    const scene = source.scene?.generation ?? -1; // which says how marks of the world's rules look
    keyed(this.marks, shown, (mark) => `${scene} ${mark.tick} ${mark.kind} ${mark.text}`, (mark) => this._mark(mark, source), (element, mark) => {
      element.style.left = `${((mark.tick - first) / (last - first)) * 100}%`;
    });
    const kinds = [...new Set(source.marks.map(({ kind }) => kind))].sort();
    keyed(this.kinds, kinds, (kind) => kind, (kind) => this._kind(kind));
    byId("timeline").hidden = !seekable && !source.may("branch") && source.marks.length === 0;
  }

  /** @param {Mark} mark @param {import("./store.js").Source} source */
  _mark(mark, source) {
    const { colour, sign } = markStyle(mark.kind, source.scene?.marks);
    const text = `${time(source.seconds(mark.tick))}, tick ${mark.tick}: ${mark.text}`;
    return button(sign, () => this._went(mark, text), { class: `mark ${mark.kind === "drops" ? "many" : ""}`, style: `color:${colour}`, title: text, "aria-label": text, tabindex: -1 });
  }

  /** @param {Mark} mark @param {string} text */
  _went(mark, text) {
    if (this.desk.may("seek")) void this.desk.ask("seek", { tick: mark.tick });
    else this.desk.toast("info", text);
  }

  /** @param {string} kind */
  _kind(kind) {
    const { colour, sign, text } = markStyle(kind, this.store.main?.scene?.marks);
    const toggle = h("button", { type: "button", "aria-pressed": "true", title: `Show or hide ${text}` }, h("i", { style: `color:${colour}`, "aria-hidden": "true" }, sign), ` ${text}`);
    toggle.addEventListener("click", () => {
      if (!this.hidden.delete(kind)) this.hidden.add(kind);
      toggle.setAttribute("aria-pressed", String(!this.hidden.has(kind)));
      this.draw();
    });
    return toggle;
  }

  /** Have the slider follow, once for each frame of the browser. */
  follow() {
    const source = this.store.main;
    if (!source || this.slider.hidden || this.wanted !== null || source.tick === this.drawn) return;
    this.drawn = source.tick;
    this.slider.value = String(Math.round(source.tick));
    this.slider.setAttribute("aria-valuetext", time(source.seconds(source.tick)));
  }

  drag() {
    this.wanted = Number(this.slider.value);
    const now_ms = performance.now();
    if (now_ms - this.asked_ms < SEEK_EVERY_MS) return;
    this.asked_ms = now_ms;
    void this.desk.ask("seek", { tick: this.wanted });
  }

  dragged() {
    const tick = Number(this.slider.value);
    this.wanted = null;
    void this.desk.ask("seek", { tick });
  }

  /** @param {number} frames */
  by(frames) {
    const unit = this.store.main?.info.kind === "capture" ? { unit: "frames" } : {};
    if (this.desk.may("step")) void this.desk.ask("step", { count: frames, ...unit });
  }

  /** @param {number} seconds */
  bySeconds(seconds) {
    const source = this.store.main;
    if (!source || !this.desk.may("seek")) return;
    const [first, last] = this.span;
    const tick = Math.round(source.tick + seconds / (source.info.tick_ns / 1e9));
    void this.desk.ask("seek", { tick: Math.max(first, Math.min(last, tick)) });
  }

  toggleLoop() {
    this.loops = !this.loops;
    this.loop.setAttribute("aria-pressed", String(this.loops));
    void this.desk.ask("loop", { on: this.loops });
  }
}

/**
 * The marks that fit side by side: of many of one kind at nearly the same place the first.
 * @param {Mark[]} marks @param {number} first @param {number} last
 */
function thinned(marks, first, last) {
  const cell = (last - first) / MARKS_DRAWN_MAX;
  const taken = new Set();
  return marks.filter(({ tick, kind }) => {
    const key = `${Math.floor((tick - first) / cell)} ${kind}`;
    if (tick < first || tick > last || taken.has(key)) return false;
    taken.add(key);
    return true;
  });
}
