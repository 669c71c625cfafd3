// What held and what happened over a run, a lane for each kind. It needs no server: a report inlines it.

import { lookStyle, markStyle } from "./colours.js";
import { ticks } from "./text.js";
import { h } from "./ui.js";

/**
 * @typedef {object} Lane
 * @property {string} name
 * @property {string} [mark] the kind of what happened, by whose sign it is drawn
 * @property {string | null} [look] how that looks, where a rule of the world says so
 * @property {string} [colour] of what held
 * @property {{from: number, to?: number, text: string}[]} entries (s); without an end it is a moment
 */

/**
 * @param {HTMLElement} place
 * @param {Lane[]} lanes
 * @param {[number, number]} range of simulated time (s)
 */
export function drawLanes(place, lanes, [start, end]) {
  const share = (/** @type {number} */ at) => (end > start ? (Math.min(end, Math.max(start, at)) - start) / (end - start) : 0);
  const percent = (/** @type {number} */ part) => `${(100 * part).toFixed(3)}%`;
  const rows = lanes.map(({ name, mark, look, colour, entries }) => {
    const style = lookStyle(look) ?? markStyle(mark ?? "");
    const drawn = entries.map(({ from, to, text }) => {
      const element = to === undefined ? h("b", { title: text }, style.sign) : h("i", { title: text });
      element.style.left = percent(share(from));
      if (to === undefined) element.style.color = style.colour;
      else {
        element.style.width = percent(share(to) - share(from));
        element.style.background = colour ?? style.colour;
      }
      return element;
    });
    return h("div", { class: "lane" }, h("span", {}, name), h("div", {}, drawn));
  });
  const numbers = ticks(start, end, 8).map((at) => {
    const number = h("span", {}, `${at} s`);
    number.style.left = percent(share(at));
    return number;
  });
  place.replaceChildren(...rows, h("div", { class: "lane times" }, h("span"), h("div", {}, numbers)));
}
