// Sending robots where one clicks: the console's jobs of the selected robot, and the next place.

import { button, byId, field, h, keyed, setText } from "./ui.js";

/** The numbers of a command that is a place, as the view can give them. */
const PLACE = ["x", "y", "z", "yaw"];
const LOW_M = 0.5;
const HEIGHT_M = 2;
const LACKS = "This run declares no endpoint of the console. With clients: {desk: {console: true}} in its deployment, this robot is sent where one clicks.";

/**
 * What of a robot takes a place as its job; undefined where nothing does.
 * @param {SceneBody | undefined} body
 */
export function goingOf(body) {
  return body?.jobs.find(({ numbers }) => numbers.includes("x") && numbers.includes("y") && numbers.every((name) => PLACE.includes(name)));
}

/**
 * The numbers of the command that sends a robot to a place: at this height, looking where it looks now.
 * @param {string[]} names
 * @param {[number, number]} at m
 * @param {ArrayLike<number>} pose x, y, z in m, quaternion x, y, z, w
 * @param {number} height m
 * @returns {Record<string, number>}
 */
export function numbersTo(names, [x, y], pose, height) {
  const [, , , qx, qy, qz, qw] = Array.from(pose);
  const all = /** @type {Record<string, number>} */ ({ x, y, z: height, yaw: Math.atan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz)) });
  return Object.fromEntries(names.map((name) => [name, Number(all[name].toFixed(3))]));
}

export class Sending {
  /** @param {import("./store.js").Store} store @param {import("./desk.js").Desk} desk */
  constructor(store, desk) {
    this.store = store;
    this.desk = desk;
    this.hint = h("p", { class: "hint" });
    this.go = button("Send …", () => this.aim(), { id: "send", title: "To the place that is clicked next (G)" });
    this.height = h("input", { type: "number", min: 0, step: 0.1, id: "send-height" });
    this.high = field("at a height of (m)", this.height);
    this.list = h("ul", { class: "jobs", "aria-label": "Jobs" });
    this.place = h("div", { class: "sending" }, h("div", { class: "row" }, this.go, this.high), this.list, this.hint);
    this.robot = "";
    for (const name of ["scene", "jobs", "selected", "absent", "sources", "connected", "presence", "aim"]) store.on(name, () => this.draw());
    store.on("aimed", (at) => this.sendTo(at));
  }

  /** The selected robot that can be sent, and what of it takes a place. */
  get chosen() {
    const source = this.store.main;
    const body = source?.scene?.bodies.find(({ name }) => name === this.store.selected);
    const going = goingOf(body);
    if (!source || !body || !going || source.info.kind !== "live" || source.absent.has(body.name)) return null;
    return { source, body, going };
  }

  draw() {
    const { chosen, store } = this;
    this.place.hidden = !chosen;
    if (store.aim && (store.aim !== chosen?.body.name || !this.desk.may("send"))) store.aimWith("");
    byId("view").classList.toggle("aiming", Boolean(store.aim));
    if (!chosen) return;
    const { source, body, going } = chosen;
    const declared = source.may("send");
    this.go.hidden = !declared;
    this.go.disabled = !this.desk.may("send");
    this.go.setAttribute("aria-pressed", String(Boolean(store.aim)));
    setText(this.go, store.aim ? "Click where it goes" : "Send …");
    this.high.hidden = !declared || !going.numbers.includes("z");
    if (this.robot !== body.name) {
      this.robot = body.name;
      const z = this.poseOf(body)?.[2] ?? 0;
      this.height.value = String(z < LOW_M ? HEIGHT_M : Number(z.toFixed(1)));
    }
    setText(this.hint, store.role === "operator" ? (declared ? (source.jobs?.problem ?? "") : LACKS) : "");
    const jobs = (source.jobs?.jobs ?? []).filter(({ robot }) => robot === body.name);
    keyed(
      this.list,
      jobs,
      ({ actuator }) => actuator,
      ({ robot, actuator }) => h("li", {}, h("span"), button("Cancel", () => void this.desk.ask("cancel", { robot, actuator }), { class: "cancel" })),
      (row, job) => {
        setText(/** @type {Element} */ (row.firstElementChild), `${job.actuator}: ${job.text}`);
        /** @type {HTMLElement} */ (row.lastElementChild).hidden = job.ended || !declared;
      },
    );
  }

  /** @param {SceneBody} body */
  poseOf(body) {
    const poses = this.store.main?.poses;
    const first = 7 * body.links[0];
    return poses?.links.subarray(first, first + 7);
  }

  /** Send the selected robot to the place that is clicked next, or no longer. */
  aim() {
    if (this.chosen && this.desk.may("send")) this.store.aimWith(this.store.aim ? "" : this.store.selected);
  }

  /** @param {[number, number]} at m */
  sendTo(at) {
    const { chosen, store } = this;
    store.aimWith("");
    const pose = chosen && this.poseOf(chosen.body);
    if (!chosen || !pose) return;
    const numbers = numbersTo(chosen.going.numbers, at, pose, Number(this.height.value));
    void this.desk.ask("send", { robot: chosen.body.name, actuator: chosen.going.actuator, numbers });
  }
}
