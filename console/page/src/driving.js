// Driving the selected robot with the arrow keys: they set its speeds, and released keys or a lost focus stop it.

import { button, h, setText } from "./ui.js";

/** @type {Record<string, [number, number]>} What each key adds: ahead, to the left. */
const KEYS = { ArrowUp: [1, 0], ArrowDown: [-1, 0], ArrowLeft: [0, 1], ArrowRight: [0, -1] };

/**
 * The motion of the keys that are down.
 * @param {Iterable<string>} keys
 * @returns {{ahead: number, left: number}}
 */
export function motionOf(keys) {
  const all = Array.from(keys, (key) => KEYS[key]);
  const sum = (/** @type {number} */ n) => all.reduce((whole, one) => whole + one[n], 0);
  return { ahead: sum(0), left: sum(1) };
}

export class Driving {
  /** @param {import("./store.js").Store} store @param {import("./desk.js").Desk} desk */
  constructor(store, desk) {
    this.store = store;
    this.desk = desk;
    /** The robot that is driven; empty for none. */
    this.robot = "";
    /** @type {Set<string>} */
    this.down = new Set();
    this.sent = motionOf([]);
    this.toggle = button("Drive", () => this.drive(this.robot ? "" : this.store.selected), { id: "drive", title: "With the arrow keys" });
    this.place = h("div", { class: "row" }, this.toggle);
    for (const name of ["scene", "selected", "absent", "sources", "connected", "presence"]) store.on(name, () => this.draw());
    for (const kind of ["keydown", "keyup"]) window.addEventListener(kind, (event) => this._key(/** @type {KeyboardEvent} */ (event)), true);
    window.addEventListener("blur", () => this._release());
  }

  draw() {
    const source = this.store.main;
    const body = source?.scene?.bodies.find(({ name }) => name === this.store.selected);
    const may = Boolean(body?.drivable && source?.info.kind === "live" && !source.absent.has(body.name) && this.desk.may("drive"));
    if (this.robot && (!may || this.robot !== this.store.selected)) this.drive("");
    this.place.hidden = !may;
    this.toggle.setAttribute("aria-pressed", String(Boolean(this.robot)));
    setText(this.toggle, this.robot ? "Drive with the arrow keys" : "Drive");
  }

  /** Drive a robot from now on, or none. @param {string} robot */
  drive(robot) {
    this._release();
    this.robot = robot;
    this.draw();
  }

  /** @param {KeyboardEvent} event */
  _key(event) {
    const target = /** @type {HTMLElement} */ (event.target);
    if (!this.robot || !(event.key in KEYS) || target.closest?.("input, textarea, select, dialog")) return;
    event.preventDefault();
    event.stopPropagation();
    if (event.type === "keydown") this.down.add(event.key);
    else this.down.delete(event.key);
    this._send();
  }

  _release() {
    this.down.clear();
    this._send();
  }

  _send() {
    const motion = motionOf(this.down);
    if (motion.ahead === this.sent.ahead && motion.left === this.sent.left) return;
    this.sent = motion;
    void this.desk.ask("drive", { robot: this.robot, ...motion });
  }
}
