// What can be plotted, by the name that people pick it by.

import { numberPaths } from "./text.js";

const AXES = ["x", "y", "z", "w"];
const LINK_FIGURES = /** @type {[string, string, string][]} */ ([
  ["loss", "loss", ""], ["delay_ms", "delay", "ms"], ["queue_ms", "queue", "ms"],
  ["offered", "offered", "packets"], ["delivered", "delivered", "packets"], ["dropped", "dropped", "packets"],
]);
/** More would make the list of names slow to open. */
const NAMES_MAX = 4000;

/**
 * @typedef {{name: string, unit: string, request: Omit<SeriesRequest, "id">, hint?: string, step?: boolean}} Choice
 * `hint` says what it is, `step` that a value holds until the next one
 */

/** @param {[string, string]} link @param {string} figure @returns {Choice} */
export function linkChoice(link, figure) {
  const [, text, unit] = LINK_FIGURES.find(([key]) => key === figure) ?? [figure, figure, ""];
  return { name: `link ${link[0]} → ${link[1]}: ${text}`, unit, request: { link, figure } };
}

/**
 * The name of one of a field's numbers. @param {string} field @param {number} count all of them @param {number} place
 */
function component(field, count, place) {
  if (count === 1) return "";
  const isVector = count === 3 || (count === 4 && field.includes("orientation"));
  return isVector ? `.${AXES[place]}` : `[${place}]`;
}

/**
 * What robots were told: the set-points that their actuators hold.
 * @param {SceneCommand[]} commands @returns {Choice[]}
 */
function commandsOf(commands) {
  return commands.map(({ robot, channel, number, unit, index }) => ({ name: `command ${robot}/${channel}.${number}`, unit, hint: "set-point", step: true, request: { field: index } }));
}

/** All numbers of the frame: a field whose numbers differ in unit is several runs. @param {SceneField[]} runs */
function numbersOf(runs) {
  /** @type {Map<string, {field: string, numbers: {index: number, unit: string}[]}>} */
  const fields = new Map();
  /** @type {Choice[]} */
  const named = [];
  for (const { entity, field, name: number, unit, index, count } of runs) {
    if (number !== undefined) {
      named.push({ name: `${entity} ${field}.${number}`, unit, request: { field: index } });
      continue;
    }
    const name = `${entity} ${field}`;
    const found = fields.get(name) ?? { field, numbers: [] };
    fields.set(name, found);
    for (let place = 0; place < count; place += 1) found.numbers.push({ index: index + place, unit });
  }
  const others = [...fields].flatMap(([name, { field, numbers }]) =>
    numbers.map(({ index, unit }, place) => ({ name: `${name}${component(field, numbers.length, place)}`, unit, request: { field: index } })));
  return [...named, ...others];
}

/** Which status values have which unit: by the end of their name. @param {string} path */
function statusUnit(path) {
  if (/(^|\.)lag_ms\.|_ms($|\.)/.test(path)) return "ms";
  return path.endsWith("_ns") ? "ns" : "";
}

/**
 * All that can be plotted of a source.
 * @param {import("./store.js").Source} source
 * @returns {Map<string, Choice>}
 */
export function choicesOf(source) {
  const commands = source.scene?.commands ?? [];
  const held = new Set(commands.map(({ index }) => index));
  /** @type {Choice[]} */
  const choices = numbersOf((source.scene?.fields ?? []).filter(({ index }) => !held.has(index)));
  choices.push(...commandsOf(commands));
  for (const { robot, channel, unit, numbers } of source.scene?.sensors ?? []) {
    for (const [index, [number, its]] of numbers.entries()) choices.push({ name: `reading ${robot}/${channel}.${number}`, unit: its, request: { reading: [robot, channel], index } });
    if (!numbers.length) choices.push({ name: `reading ${robot}/${channel}[0]`, unit, request: { reading: [robot, channel], index: 0 } });
  }
  for (const path of numberPaths(source.status)) choices.push({ name: `status ${path}`, unit: statusUnit(path), request: { status: path } });
  for (const link of source.links) for (const [figure] of LINK_FIGURES) choices.push(linkChoice([link.from, link.to], figure));
  return new Map(choices.slice(0, NAMES_MAX).map((choice) => [choice.name, choice]));
}

/**
 * The choice of a name: one of those that there are, or a further number of a reading, or a link that is not busy yet.
 * @param {Map<string, Choice>} choices
 * @param {string} name
 * @returns {Choice | null}
 */
export function choiceOf(choices, name) {
  const known = choices.get(name);
  if (known) return known;
  const reading = /^(reading .+)\[(\d+)\]$/.exec(name);
  const first = reading && choices.get(`${reading[1]}[0]`);
  if (first && Number(reading[2]) < 256) return { ...first, name, request: { ...first.request, index: Number(reading[2]) } };
  const link = /^link (.+) → (.+): (.+)$/.exec(name);
  const figure = link && LINK_FIGURES.find(([, text]) => text === link[3]);
  return link && figure ? linkChoice([link[1], link[2]], figure[0]) : null;
}
