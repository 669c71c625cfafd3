// The bar over the view: what it shows, how two sources share it.

import { lossGradient } from "./colours.js";
import { byId, h, select, button } from "./ui.js";

const SWITCHES = /** @type {[string, string, string][]} */ ([
  ["labels", "Names", "Names of entities (N)"],
  ["owners", "Owners", "Colour by the node that computes it (O)"],
  ["paths", "Paths", "Where entities went (P)"],
  ["contacts", "Contacts", "Where bodies touch (C)"],
  ["rays", "Rays", "Rays of sensors (R)"],
  ["radio", "Radio", "Radio links, coloured by loss (L)"],
  ["follow", "Follow", "Keep the view on the selected entity (F)"],
]);

export class ViewBar {
  /**
   * @param {import("./view3d.js").Options} options
   * @param {(name: string) => void} changed
   * @param {() => void} home
   */
  constructor(options, changed, home) {
    this.options = /** @type {Record<string, any>} */ (options);
    this.changed = changed;
    /** @type {Map<string, HTMLButtonElement>} */
    this.buttons = new Map();
    const bar = byId("view-bar");
    for (const [name, text, title] of SWITCHES) {
      const one = button(text, () => this.toggle(name), { title, id: `show-${name}`, "aria-pressed": String(Boolean(this.options[name])) });
      this.buttons.set(name, one);
      bar.append(one);
    }
    bar.append(button("Whole", home, { title: "Show the whole world (Home)", id: "home" }));
    this.two = select([["single", "First alone"], ["side", "Side by side"], ["ghost", "Second as a ghost"]], options.two, { id: "two", hidden: true, "aria-label": "Two sources", onchange: () => {
      this.options.two = this.two.value;
      this.changed("two");
    } });
    bar.append(this.two);
    this.owners = h("div", { class: "legend owners", id: "owners", hidden: true });
    this.scale = h("span", { class: "legend" }, "loss 0 %", h("i", { style: `background:${lossGradient()}` }), "100 %", h("i", { class: "wall" }), "wall in the way");
    this.signs = h("div", { class: "legend signs", hidden: true }, this.scale, h("span", {}, "✕ packet dropped"));
    byId("corner").append(this.owners, this.signs);
  }

  /** @param {string} name */
  toggle(name) {
    this.options[name] = !this.options[name];
    this.buttons.get(name)?.setAttribute("aria-pressed", String(this.options[name]));
    this.changed(name);
  }
}
