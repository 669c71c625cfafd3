// Names of bodies over the view, as text of the page: sharp, in the page's font, and moved once for each frame.

import { Vector3 } from "three";
import { h, setText } from "./ui.js";

const LABELS_MAX = 80;

export class Labels {
  /** @param {HTMLElement} place */
  constructor(place) {
    this.layer = h("div", { class: "labels", "aria-hidden": "true" });
    place.append(this.layer);
    /** @type {HTMLElement[]} */
    this.pool = [];
    this.point = new Vector3();
  }

  /**
   * @param {import("./world.js").World} world
   * @param {import("three").Camera} camera
   * @param {number} width
   * @param {number} height
   * @param {boolean} all every body, or the selected one alone
   * @param {string} selected
   */
  draw(world, camera, width, height, all, selected) {
    let used = 0;
    for (const body of world.scene?.bodies ?? []) {
      if (used >= LABELS_MAX || (!all && body.name !== selected)) continue;
      const point = world.placeOf(body, this.point)?.project(camera);
      if (!point || point.z > 1 || Math.abs(point.x) > 1 || Math.abs(point.y) > 1) continue;
      const label = this._at(used);
      used += 1;
      setText(label, body.name);
      label.classList.toggle("selected", body.name === selected);
      label.style.transform = `translate(${((point.x + 1) / 2) * width}px, ${((1 - point.y) / 2) * height}px) translate(-50%, -150%)`;
    }
    this.pool.forEach((label, index) => (label.hidden = index >= used));
  }

  /** @param {number} index */
  _at(index) {
    if (index >= this.pool.length) {
      const label = h("span");
      this.pool.push(label);
      this.layer.append(label);
    }
    return this.pool[index];
  }
}
