// Names of bodies over the view, as text of the page: sharp, in the page's font. One that would cover another is left out.

import { Vector3 } from "three";
import { h, setText } from "./ui.js";

const LABELS_MAX = 80;
const LINE_PX = 20;

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
    /** @type {{x: number, y: number, half: number}[]} */
    const taken = [];
    const bodies = (world.scene?.bodies ?? []).filter(({ name }) => all || name === selected);
    bodies.sort((a, b) => Number(b.name === selected) - Number(a.name === selected));
    for (const body of bodies) {
      if (used >= LABELS_MAX) break;
      const point = world.placeOf(body, this.point)?.project(camera);
      if (!point || point.z > 1 || Math.abs(point.x) > 1 || Math.abs(point.y) > 1) continue;
      const [x, y] = [((point.x + 1) / 2) * width, ((1 - point.y) / 2) * height];
      const half = 6 + body.name.length * 3.5;
      if (taken.some((other) => Math.abs(other.x - x) < other.half + half && Math.abs(other.y - y) < LINE_PX)) continue;
      taken.push({ x, y, half });
      const label = this._at(used);
      used += 1;
      setText(label, body.name);
      label.classList.toggle("selected", body.name === selected);
      label.style.transform = `translate(${x}px, ${y}px) translate(-50%, -170%)`;
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
