// Events of the network by hand: forms of `foosim net partition`, `clog`, `set` and `heal`.

import { dialog } from "./dialogs.js";
import { field, h, select } from "./ui.js";

/** @param {string} text names with commas @returns {string[]} */
function names(text) {
  return text.split(",").map((name) => name.trim()).filter(Boolean);
}

/** @param {string} value @param {string} placeholder @param {Record<string, any>} [more] */
function input(value, placeholder, more = {}) {
  return h("input", { value, placeholder, list: "endpoints", autocomplete: "off", spellcheck: false, ...more });
}

/** How long: a time with its unit, or nothing until a heal. */
function lasting(value = "", required = false) {
  return input(value, required ? "10 s" : "until a heal", { list: null, required });
}

/** @param {HTMLInputElement} lasts */
const forTime = (lasts) => (lasts.value.trim() ? { for: lasts.value.trim() } : {});

export class Disturb {
  /** @param {import("./desk.js").Desk} desk @param {() => [string, string] | null} chosen the link that is selected */
  constructor(desk, chosen) {
    this.desk = desk;
    this.chosen = chosen;
  }

  /** @param {Record<string, any>} event */
  ask(event) {
    return this.desk.ask("network", { event });
  }

  async partition() {
    const [from, to] = this.chosen() ?? ["", "rest"];
    const first = input(from, "names, with commas", { required: true });
    const second = input(to, "rest", { required: true });
    const lasts = lasting("10 s");
    const oneWay = h("input", { type: "checkbox" });
    const content = [
      field("Group", first, "Endpoints with commas; * stands for any letters."),
      field("Cut off from", second, "Endpoints, or rest for everybody else."),
      field("For", lasts, "Simulated time, for example 10 s."),
      field("Only what the first group sends", oneWay),
    ];
    await dialog("Partition", content, {
      action: "Cut",
      danger: true,
      send: () => this.ask({ partition: [names(first.value), names(second.value)], ...forTime(lasts), ...(oneWay.checked ? { symmetric: false } : {}) }),
    });
  }

  async clog() {
    const [from, to] = this.chosen() ?? ["", "*"];
    const first = input(from, "camera", { required: true });
    const second = input(to, "player-*", { required: true });
    const lasts = lasting("2 s");
    const content = [
      field("From", first), field("To", second),
      field("For", lasts, "Packets wait until then, and come at once in their order."),
    ];
    await dialog("Clog", content, {
      action: "Clog",
      danger: true,
      send: () => this.ask({ clog: { from: names(first.value), to: names(second.value) }, ...forTime(lasts) }),
    });
  }

  /** @param {string} chosen id of a link rule */
  async set(chosen) {
    const rule = input(chosen, "id of a link rule", { list: "rules", required: true });
    const settings = h("textarea", { rows: 4, required: true, spellcheck: false }, "loss: 5 %\ndelay: 20 ms");
    const content = [
      field("Link rule", rule),
      field("Settings", settings, "One on a line; a dot for what is inside: burst.loss: 1 %. They hold until a heal of settings."),
    ];
    await dialog("Set a link rule", content, {
      action: "Set",
      danger: true,
      send: () => {
        const given = settingsOf(settings.value);
        return typeof given === "string" ? given : this.ask({ set: { ...given, link: rule.value.trim() } });
      },
    });
  }

  async heal() {
    const what = select([["all", "everything"], ["partitions", "partitions"], ["clogs", "clogs"], ["settings", "settings"]], "all");
    await dialog("Heal", [field("What", what, "It ends at once, with what clogs hold.")], { action: "Heal", send: () => this.ask({ heal: what.value }) });
  }
}

/**
 * Settings by name, those with dots in mappings of their own; or the text of what is wrong.
 * @param {string} text
 * @returns {Record<string, any> | string}
 */
export function settingsOf(text) {
  /** @type {Record<string, any>} */
  const settings = Object.create(null);
  for (const line of text.split("\n").map((one) => one.trim()).filter(Boolean)) {
    const found = /^([\w.]+)\s*[:=]\s*(.+)$/.exec(line);
    if (!found) return `${line}: a setting is written key: value`;
    const path = found[1].split(".");
    let inside = settings;
    for (const key of path.slice(0, -1)) inside = inside[key] ??= Object.create(null);
    inside[path[path.length - 1]] = valueOf(found[2]);
  }
  return Object.keys(settings).length ? settings : "At least one setting is needed, for example loss: 5 %";
}

/** @param {string} text a number, true, false, or a quantity as it is written */
function valueOf(text) {
  const plain = text.replace(/^(['"])(.*)\1$/, "$2");
  if (plain !== text) return plain;
  if (text === "true" || text === "false") return text === "true";
  return /^-?\d+(\.\d+)?$/.test(text) ? Number(text) : text;
}
