// A look through a camera: asks the console for its pictures while it is shown, one at a time and only of new ticks.

import { h, select } from "./ui.js";

const EVERY_MS = 200;

export class Eye {
  /**
   * @param {import("./connection.js").Connection} connection
   * @param {import("./store.js").Store} store
   * @param {HTMLElement} place
   */
  constructor(connection, store, place) {
    this.connection = connection;
    this.store = store;
    this.picture = /** @type {HTMLImageElement} */ (h("img", { alt: "" }));
    this.problem = h("figcaption", { class: "hint" });
    this.choice = select([["", "No camera"]], "", { id: "camera", "aria-label": "Look through a camera", onchange: () => this._turn() });
    this.frame = h("figure", { id: "eye", hidden: true }, this.picture, this.problem);
    this.box = h("div", { id: "eye-box", hidden: true }, this.frame, this.choice);
    place.prepend(this.box);
    this.shown = "";
    this.asking = false;
    store.on("scene", (source) => source.info.id === 0 && this._fill(source.scene.cameras ?? []));
    window.setInterval(() => void this._ask(), EVERY_MS);
  }

  /** @param {{robot: string, channel: string, pictures: string[]}[]} cameras */
  _fill(cameras) {
    const names = cameras.flatMap(({ robot, channel, pictures }) => pictures.map((kind) => [JSON.stringify({ robot, channel, kind }), `${robot}/${channel} ${kind}`]));
    const { value } = this.choice;
    this.choice.replaceChildren(...[["", "No camera"], ...names].map(([key, text]) => h("option", { value: key }, text)));
    this.choice.value = names.some(([key]) => key === value) ? value : "";
    this.box.hidden = !names.length;
    this._turn();
  }

  _turn() {
    this.frame.hidden = !this.choice.value;
    this.shown = "";
  }

  async _ask() {
    const { value } = this.choice;
    const { main } = this.store;
    const wish = `${value} ${main?.poses?.tick} ${main?.scene?.generation}`;
    if (!value || this.asking || wish === this.shown || !this.connection.connected || document.hidden) return;
    this.asking = true;
    try {
      const { picture, text } = await this.connection.ask(0, "look", JSON.parse(value));
      if (value !== this.choice.value) return;
      if (picture) this.picture.src = picture;
      this.picture.alt = picture ? `What ${this.choice.selectedOptions[0].textContent} shows` : "";
      this.picture.hidden = !picture;
      this.problem.textContent = text;
      this.shown = wish;
    } catch {
      // The connection was lost: the banner says so.
    } finally {
      this.asking = false;
    }
  }
}
