// The tab "World": what the rules say, the bodies, and what can be done with the one that is selected.

import { askAdd } from "./adding.js";
import { dialog, vector } from "./dialogs.js";
import { counted, time } from "./text.js";
import { button, byId, field, h, keyed, select, setText } from "./ui.js";

const ROWS_MAX = 400;

export class Entities {
  /**
   * @param {import("./store.js").Store} store
   * @param {import("./desk.js").Desk} desk
   * @param {{follow: () => void, plot: (entity: string) => void}} actions
   * @param {HTMLElement} sending
   */
  constructor(store, desk, actions, sending) {
    this.store = store;
    this.desk = desk;
    this.actions = actions;
    this.sending = sending;
    this.facts = h("dl", { class: "facts" });
    this.filter = h("input", { type: "search", placeholder: "Find an entity", "aria-label": "Find an entity", oninput: () => this.draw() });
    this.list = h("ul", { class: "entities", "aria-label": "Entities" });
    const heads = h("div", { class: "heads" }, ...["Entity", "Model", "Computed by"].map((name) => h("span", {}, name)));
    this.detail = h("section", { class: "detail", "aria-label": "Selected entity" });
    this.add = button("Add …", () => void this.askAdd(), { id: "add", title: "Add an entity that is absent" });
    byId("panel-world").append(
      h("section", {}, h("h2", {}, "State"), this.facts),
      h("section", { class: "fill" }, h("div", { class: "row" }, h("h2", {}, "Entities"), this.filter, this.add), heads, this.list),
      this.detail,
    );
    for (const name of ["scene", "status", "selected", "absent", "sources", "connected"]) store.on(name, () => this.draw());
    this.draw();
  }

  draw() {
    const source = this.store.main;
    if (!source) return;
    this._draw_facts(source);
    const wanted = this.filter.value.trim().toLowerCase();
    const bodies = (source.scene?.bodies ?? []).filter(({ name, model }) => `${name} ${model}`.toLowerCase().includes(wanted));
    const isAbsent = (/** @type {SceneBody} */ { name }) => source.absent.has(name);
    keyed(
      this.list,
      [...bodies.filter((body) => !isAbsent(body)), ...bodies.filter(isAbsent)].slice(0, ROWS_MAX),
      (body) => `${body.name} ${body.model}`,
      (body) => {
        const choose = h("button", { type: "button", onclick: () => this.store.select(this.store.selected === body.name ? "" : body.name) });
        choose.append(h("b", {}, body.name), h("span", {}, body.model), h("i"));
        return h("li", {}, choose);
      },
      (row, body) => {
        const choose = /** @type {HTMLElement} */ (row.firstElementChild);
        choose.setAttribute("aria-pressed", String(body.name === this.store.selected));
        row.classList.toggle("absent", isAbsent(body));
        setText(/** @type {Element} */ (choose.lastElementChild), isAbsent(body) ? "absent" : source.ownerOf(body.name));
      },
    );
    this.add.hidden = !source.may("add") || !source.scene?.bodies.some(({ removable }) => removable);
    this.add.disabled = !this.desk.may("add") || !source.absent.size;
    this._draw_detail(source);
  }

  /** @param {import("./store.js").Source} source */
  _draw_facts(source) {
    const { status } = source;
    /** @type {[string, string][]} */
    const facts = [];
    if (status?.summary?.length) facts.push(["World", status.summary.join("; ")]);
    if (status?.epoch !== undefined) facts.push(["Epoch", String(status.epoch)]);
    if (status?.handovers !== undefined) facts.push(["So far", `${counted(status.handovers, "hand-over")}, ${counted(status.moves ?? 0, "move")}`]);
    if (status?.recording?.state) facts.push(["Capture", [status.recording.state, status.recording.problem].filter(Boolean).join(": ")]);
    if (status?.waiting_for) facts.push(["Waits for", status.waiting_for]);
    if (status?.reason) facts.push(["Ended", status.reason]);
    const { span } = source.info;
    if (span) facts.push(["Span", `${time(source.seconds(span.first))} to ${time(source.seconds(span.last))}`]);
    if (source.scene) facts.push(["Scene", [counted(source.scene.bodies.length, "entity", "entities"), counted(source.scene.links.length, "link"), source.absent.size ? `${source.absent.size} absent` : ""].filter(Boolean).join(", ")]);
    keyed(this.facts, facts, ([name]) => name, ([name]) => h("div", {}, h("dt", {}, name), h("dd")), (row, [, text]) => setText(/** @type {Element} */ (row.lastElementChild), text));
  }

  /** @param {import("./store.js").Source} source */
  _draw_detail(source) {
    const body = source.scene?.bodies.find(({ name }) => name === this.store.selected);
    this.detail.hidden = !body;
    if (!body) return;
    const isAbsent = source.absent.has(body.name);
    const owner = isAbsent ? "" : source.ownerOf(body.name);
    const key = [body.name, owner, isAbsent, body.pushable, body.removable, source.info.verbs, this.desk.connection.connected].join(" ");
    if (this.detail.dataset.drawn === key) return;
    this.detail.dataset.drawn = key;
    const may = (/** @type {string} */ verb) => this.desk.may(verb);
    const owned = Object.values(source.status?.nodes ?? {}).some((/** @type {any} */ node) => node.owned?.includes(body.name));
    const plot = button("Plot …", () => this.actions.plot(body.name));
    const add = body.removable && source.may("add") ? button("Add …", () => void this.askAdd(), { disabled: !may("add"), id: "add-selected" }) : null;
    const actions = (isAbsent ? [plot, add] : [
      button("Follow", this.actions.follow, { title: "Keep the view on it (F)" }),
      plot,
      body.pushable && source.may("push") ? button("Push …", () => this.askPush(body.name), { disabled: !may("push"), id: "push" }) : null,
      Object.keys(body.settable).length && source.may("set") ? button("Set …", () => this.askSet(body.name, body.settable), { disabled: !may("set"), id: "set" }) : null,
      owned && source.may("move") ? button("Move …", () => this.askMove(body.name), { disabled: !may("move"), id: "move" }) : null,
      body.removable && source.may("remove") ? button("Remove …", () => this.askRemove(body.name), { disabled: !may("remove"), id: "remove", class: "danger" }) : null,
    ]).filter((one) => one !== null);
    this.detail.replaceChildren(
      h("h2", {}, body.name),
      h("p", {}, `${body.model}, ${counted(body.links.length, "link")}${owner ? `, computed by ${owner}` : ""}${isAbsent ? ", absent" : ""}`),
      h("div", { class: "row" }, ...actions),
      this.sending,
    );
  }

  askAdd() {
    const source = this.store.main;
    return source ? askAdd(source, this.desk, this.store.selected) : undefined;
  }

  /** @param {string} name */
  async askPush(name) {
    const impulse = h("input", { value: "0.05 0 0", required: true });
    await dialog(`Push ${name}`, [field("Impulse (N s)", impulse, "x y z in the world")], {
      action: "Push",
      send: () => {
        const given = vector(impulse.value, "Impulse");
        return typeof given === "string" ? given : this.desk.ask("push", { name, impulse: given });
      },
    });
  }

  /**
   * @param {string} name
   * @param {Record<string, string>} settable What is valid, by field.
   */
  async askSet(name, settable) {
    const fields = Object.keys(settable);
    const which = select(fields.map((one) => [one, one]), fields[0]);
    const value = h("input", { required: true });
    const valid = h("p", { class: "hint" });
    const explain = () => setText(valid, settable[which.value]);
    which.addEventListener("change", explain);
    explain();
    await dialog(`Set ${name}`, [field("Field", which), field("Value", value), valid], {
      action: "Set",
      send: () => {
        const text = value.value.trim();
        return this.desk.ask("set", { name, field: which.value, value: text === "true" ? true : text === "false" ? false : text });
      },
    });
  }

  /** @param {string} robot */
  async askMove(robot) {
    const source = this.store.main;
    const owner = source?.ownerOf(robot) ?? "";
    const nodes = Object.keys(source?.status?.nodes ?? {}).filter((node) => node !== owner);
    const node = select(nodes.map((name) => [name, name]), nodes[0] ?? "");
    await dialog(`Move ${robot}`, [field("To the node", node, `${owner} has it now; the world does not notice.`)], {
      action: "Move",
      send: () => this.desk.ask("move", { robot, node: node.value }),
    });
  }

  /** @param {string} name */
  async askRemove(name) {
    await dialog(`Remove ${name}?`, [h("p", {}, `${name} leaves the world at the next tick. It can be added again.`)], {
      action: "Remove",
      danger: true,
      send: () => this.desk.ask("remove", { name }),
    });
  }
}
