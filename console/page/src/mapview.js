// The view of a browser without WebGL: the map, drawn anew a few times a second.

import { drawMap } from "./map.js";
import { mapOf } from "./map_data.js";
import { h } from "./ui.js";

const EVERY_MS = 250;

export class MapView {
  /**
   * @param {HTMLElement} place
   * @param {import("./store.js").Store} store
   * @param {Stat} stat
   */
  constructor(place, store, stat) {
    this.store = store;
    this.stat = stat;
    this.place = h("div", { class: "mapview" });
    place.append(h("p", { class: "notice" }, "This browser has no WebGL: the world is shown from above."), this.place);
    this.place.addEventListener("click", (event) => {
      const at = store.aim ? this._place_at(event) : null;
      if (at) store.emit("aimed", at);
    });
    this.next_ms = 0;
    window.requestAnimationFrame((now_ms) => this._frame(now_ms));
  }

  /** @param {number} now_ms */
  _frame(now_ms) {
    window.requestAnimationFrame((next_ms) => this._frame(next_ms));
    const source = this.store.main;
    if (now_ms < this.next_ms || !source?.scene || !source.poses) return;
    this.next_ms = now_ms + EVERY_MS;
    const { clientWidth: width, clientHeight: height } = this.place;
    drawMap(this.place, mapOf(source.scene, source.poses.links), { width, height, selected: this.store.selected });
    this.stat.frames += 1;
  }

  /**
   * The place (m) that is clicked; null without a drawing.
   * @param {MouseEvent} event
   * @returns {[number, number] | null}
   */
  _place_at(event) {
    const onto = this.place.querySelector("svg")?.getScreenCTM()?.inverse();
    if (!onto) return null;
    const { clientX: x, clientY: y } = event;
    return [onto.a * x + onto.c * y + onto.e, -(onto.b * x + onto.d * y + onto.f)];
  }

  touch() {
    this.next_ms = 0;
  }

  home() {
    this.touch();
  }

  rearrange() {
    this.touch();
  }

  retheme() {
    this.touch();
  }
}
