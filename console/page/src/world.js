// One source's world in three: its shapes, where they are, their colours, the paths of its bodies.

import { Color, Group, Matrix4 } from "three";
import { coloursOf } from "./colours.js";
import { FLOATS_PER_LINK, isPlaced } from "./messages.js";
import { Paths } from "./paths.js";
import { batchesOf, linkMatrix } from "./shapes.js";

const GHOST_OPACITY = 0.35;
const UNOWNED = "#9a9a9a";
const SELECTED = new Color("#ffd24a");

export class World {
  /** @param {import("./store.js").Source} source @param {boolean} ghost */
  constructor(source, ghost) {
    this.source = source;
    this.ghost = ghost;
    this.group = new Group();
    this.paths = new Paths();
    this.group.add(this.paths.group);
    /** @type {ReturnType<typeof batchesOf>} */
    this.batches = [];
    /** @type {Matrix4[]} */
    this.matrices = [];
    /** @type {Poses | null} the poses that are drawn */
    this.drawn = null;
    this.painted = "";
    this.colour = new Color();
  }

  get scene() {
    return this.source.scene;
  }

  /** Take the source's scene. */
  build() {
    this.clear();
    const scene = this.scene;
    if (!scene) return;
    this.batches = batchesOf(scene, this.ghost ? GHOST_OPACITY : 1);
    this.matrices = scene.links.map(() => new Matrix4());
    for (const batch of this.batches) this.group.add(batch.mesh);
    this.paths.build(scene);
    this.painted = "";
    this.paint(false, "");
  }

  clear() {
    for (const batch of this.batches) {
      this.group.remove(batch.mesh);
      batch.dispose();
    }
    this.batches = [];
    this.drawn = null;
    this.paths.clear();
  }

  /** Take the newest poses; returns whether they were new. */
  place() {
    const poses = this.source.poses;
    if (!poses || poses === this.drawn || !this.scene) return false;
    this.drawn = poses;
    this.matrices.forEach((matrix, link) => linkMatrix(poses.links, link, matrix));
    for (const batch of this.batches) batch.place(this.matrices);
    return true;
  }

  /**
   * Colour the shapes, by owner or as they are, the selected body lit; does nothing where nothing changed.
   * @param {boolean} byOwner
   * @param {string} selected
   */
  paint(byOwner, selected) {
    const scene = this.scene;
    if (!scene) return false;
    const status = this.source.status;
    const owners = byOwner ? scene.links.map((link) => this.source.ownerOf(link.body)) : [];
    const key = `${selected} ${owners.join(",")}`;
    if (key === this.painted) return false;
    this.painted = key;
    const colours = coloursOf(Object.keys(status?.nodes ?? {}));
    for (const batch of this.batches) {
      batch.paint(({ shape, link }) => {
        const [red, green, blue] = shape.colour;
        this.colour.setRGB(red, green, blue, "srgb");
        if (link >= 0 && byOwner) this.colour.set(colours.get(owners[link]) ?? UNOWNED);
        if (link >= 0 && selected && scene.links[link].body === selected) this.colour.lerp(SELECTED, 0.55);
        return this.colour;
      });
    }
    return true;
  }

  /** Where a body is: the place of its last link, which moves most; null where it is absent. @param {SceneBody} body @param {import("three").Vector3} into */
  placeOf(body, into) {
    const poses = this.source.poses;
    if (!poses || !body.links.length) return null;
    return this.placeOfLink(body.links[body.links.length - 1], into);
  }

  /** @param {number} link @param {import("three").Vector3} into */
  placeOfLink(link, into) {
    const poses = this.source.poses;
    if (!poses || (link + 1) * FLOATS_PER_LINK > poses.links.length || !isPlaced(poses.links, link)) return null;
    const start = link * FLOATS_PER_LINK;
    return into.set(poses.links[start], poses.links[start + 1], poses.links[start + 2]);
  }

  dispose() {
    this.clear();
    this.paths.dispose();
    this.group.removeFromParent();
  }
}
