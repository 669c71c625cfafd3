// The bar at the top: what is looked at, its state, and the tempo: pause, resume, step, pace.

import { confirmed, dialog, shown } from "./dialogs.js";
import { stateOf } from "./presence.js";
import { time } from "./text.js";
import { button, byId, field, h, select, setText } from "./ui.js";

const PACES = ["0.1x", "0.25x", "0.5x", "realtime", "2x", "5x", "fast"];
const SPEEDS = ["0.1x", "0.25x", "0.5x", "1x", "2x", "5x", "10x"];

/** Signs for states, so that they are told apart without their colours. */
const SIGNS = /** @type {Record<string, string>} */ ({
  running: "▶", paused: "❚❚", starting: "…", recovering: "…", ended: "■", "not connected": "✕", "supervisor away": "…", failed: "✕", playing: "▶",
});

export class Control {
  /** @param {import("./store.js").Store} store @param {import("./desk.js").Desk} desk */
  constructor(store, desk) {
    this.store = store;
    this.desk = desk;
    this.play = button("Pause", () => this.toggle(), { id: "play", class: "primary", title: "Pause, resume or play (Space)" });
    this.step = button("Step", () => this.stepBy(1), { id: "step", title: "One tick (.)" });
    this.steps = button("…", () => this.askSteps(), { title: "Several ticks (Shift + .)", "aria-label": "Several ticks" });
    this.pace = select([], "", { id: "pace", "aria-label": "Pace", title: "How fast simulated time goes", onchange: () => this.setPace() });
    this.end = button("End run …", () => this.down(), { id: "down", class: "danger" });
    byId("tempo").append(this.play, this.step, this.steps, this.pace, this.end);
    for (const name of ["sources", "status", "poses", "connected", "presence"]) store.on(name, () => this.later());
    this.waits = false;
    this.draw();
  }

  /** Draw with the next frame: poses may come more often. */
  later() {
    if (this.waits) return;
    this.waits = true;
    window.requestAnimationFrame(() => {
      this.waits = false;
      this.draw();
    });
  }

  get state() {
    const source = this.store.main;
    if (!source) return "starting";
    const state = source.status?.state;
    const told = source.info.kind === "live" ? (state ?? "starting") : source.paused ? "paused" : "playing";
    return stateOf(this.desk.connection.connected, source.presence, told);
  }

  draw() {
    const source = this.store.main;
    if (!source) return;
    const { status, info } = source;
    const state = this.state;
    setText(byId("world"), info.world || info.name);
    setText(byId("run"), status?.run ?? info.name);
    byId("run").title = info.name;
    setText(byId("seed"), status?.seed === undefined ? "" : `seed ${status.seed}`);
    const recorded = info.kind === "live" ? "" : "recording, ";
    setText(byId("state"), `${SIGNS[state] ?? ""} ${recorded}${state}`);
    byId("state").dataset.state = state;
    setText(byId("time"), time(source.seconds(source.tick)));
    setText(byId("tick"), `tick ${Math.round(source.tick)}`);
    byId("speed").title = "Simulated time for each second of the wall, since the start";
    setText(byId("speed"), status?.rtf === undefined || status.rtf === null ? "" : `${status.rtf.toFixed(2)}×`);
    const held = state === "paused" || (info.kind !== "live" && source.paused);
    setText(this.play, !held ? "Pause" : recorded ? "Play" : "Resume");
    this.play.disabled = !this.desk.may(held ? "resume" : "pause") && !this.desk.may("play");
    for (const part of [this.step, this.steps]) part.disabled = !this.desk.may("step");
    this.end.hidden = !source.may("down");
    this.end.disabled = !this.desk.may("down");
    this._draw_pace(source);
  }

  /** @param {import("./store.js").Source} source */
  _draw_pace(source) {
    const paces = source.info.kind === "live" ? PACES : SPEEDS;
    const now = source.status?.pace ?? (source.info.kind === "live" ? "realtime" : "1x");
    const choices = paces.includes(now) ? paces : [...paces, now];
    if (document.activeElement !== this.pace) {
      if (this.pace.dataset.choices !== choices.join(" ")) {
        this.pace.dataset.choices = choices.join(" ");
        this.pace.replaceChildren(...choices.map((pace) => h("option", { value: pace }, pace)));
      }
      if (this.pace.value !== now) this.pace.value = now;
    }
    this.pace.disabled = !this.desk.may("rate");
  }

  toggle() {
    const held = this.state === "paused";
    if (held && !this.desk.may("resume")) void this.desk.ask("play");
    else void this.desk.ask(held ? "resume" : "pause");
  }

  /** @param {number} count */
  stepBy(count) {
    void this.desk.ask("step", { count });
  }

  async askSteps() {
    const count = h("input", { type: "number", min: 1, max: 1e9, value: 50, required: true });
    const content = [field("Ticks", count, "The run goes on by so many ticks, then pauses.")];
    await dialog("Step", content, { action: "Step", send: () => this.desk.ask("step", { count: Number(count.value) }) });
  }

  setPace() {
    void this.desk.ask("rate", { pace: this.pace.value });
    this.pace.blur();
  }

  /** @param {number} by places in the list of paces */
  changePace(by) {
    const at = this.pace.selectedIndex + by;
    if (this.pace.disabled || at < 0 || at >= this.pace.options.length) return;
    this.pace.selectedIndex = at;
    this.setPace();
  }

  async down() {
    const run = this.store.main?.status?.run ?? "the run";
    const text = `Run ${run} ends for everybody: nodes, players and this page's live view. The capture is closed in order. It cannot be resumed from here.`;
    if (await confirmed("End the run?", text, "End run")) await this.desk.ask("down");
  }

  /** Say how to branch from a tick of a capture. @param {number} tick */
  async branch(tick) {
    const answer = await this.desk.answered("branch", { tick });
    if (!answer.accepted) return;
    const command = h("code", { class: "command", tabindex: 0 }, answer.text);
    const copy = button("Copy", () => void navigator.clipboard?.writeText(answer.text));
    shown(`A new run from tick ${tick}`, [h("p", {}, "This command starts a run with the world as it was at that tick:"), command, copy]);
  }
}
