// Adding what is absent: an entity, or the first one of a fleet; where it is put, and which node computes it.

import { dialog } from "./dialogs.js";
import { field, h, select } from "./ui.js";

const NUMBERED = /^(.+)-\d+$/;
/** The parts of a place, and the unit of a number without one. */
const PARTS = /** @type {[string, string][]} */ ([["x", "m"], ["y", "m"], ["z", "m"], ["yaw", "deg"]]);

/** @param {string} name */
const fleetOf = (name) => NUMBERED.exec(name)?.[1] ?? "";

/**
 * What can be added, as choices: each entity that is absent, then each fleet of which several are.
 * @param {SceneBody[]} bodies
 * @param {Set<string>} absent
 * @returns {[string, string][]}
 */
export function addableOf(bodies, absent) {
  const names = bodies.filter(({ name, removable }) => removable && absent.has(name)).map(({ name }) => name);
  const fleets = new Set(names.map(fleetOf).filter((fleet) => fleet && !absent.has(fleet)));
  const several = [...fleets].map((fleet) => /** @type {[string, number]} */ ([fleet, names.filter((name) => fleetOf(name) === fleet).length]));
  return [
    ...names.map((name) => /** @type {[string, string]} */ ([name, name])),
    ...several.filter(([, count]) => count > 1).map(([fleet, count]) => /** @type {[string, string]} */ ([fleet, `${fleet} (the first of ${count})`])),
  ];
}

/**
 * A place as a request has it: what was filled in, numbers with their units; nothing where all is left out.
 * @param {Record<string, string>} given by part
 * @returns {Record<string, string> | undefined}
 */
export function placeOf(given) {
  const said = PARTS.map(([part, unit]) => [part, given[part]?.trim() ?? "", unit]).filter(([, text]) => text);
  const written = said.map(([part, text, unit]) => [part, /^[-+]?[\d.]+$/.test(text) ? `${text} ${unit}` : text]);
  return written.length ? Object.fromEntries(written) : undefined;
}

/**
 * Ask what is added, and add it.
 * @param {import("./store.js").Source} source
 * @param {import("./desk.js").Desk} desk
 * @param {string} selected the entity that is chosen at first, if it is absent
 */
export async function askAdd(source, desk, selected) {
  const bodies = source.scene?.bodies ?? [];
  const choices = addableOf(bodies, source.absent);
  const first = choices.find(([name]) => name === selected)?.[0] ?? choices[0]?.[0] ?? "";
  const which = select(choices, first, { id: "add-which" });
  const parts = PARTS.map(([part, unit]) => /** @type {[string, string, HTMLInputElement]} */ ([part, unit, h("input", { id: `add-${part}`, autocomplete: "off" })]));
  const nodes = Object.keys(source.status?.nodes ?? {});
  const node = select([["", "chosen for it"], ...nodes.map((name) => /** @type {[string, string]} */ ([name, name]))], "", { id: "add-node" });
  const computed = field("Computed by", node);
  const isRobot = () => bodies.some(({ name, robot }) => robot && (name === which.value || fleetOf(name) === which.value));
  const explain = () => (computed.hidden = !isRobot());
  which.addEventListener("change", explain);
  explain();
  const place = parts.map(([part, unit, input]) => field(`${part} (${unit})`, input));
  const content = [field("Entity", which), h("div", { class: "row" }, ...place), h("p", { class: "hint" }, "What is left out is as the deployment has it."), computed];
  await dialog("Add an entity", content, {
    action: "Add",
    send: () => {
      const at = placeOf(Object.fromEntries(parts.map(([part, , input]) => [part, input.value])));
      return desk.ask("add", { name: which.value, ...(at ? { at } : {}), ...(isRobot() && node.value ? { node: node.value } : {}) });
    },
  });
}
