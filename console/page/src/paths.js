// The ways that bodies went: the last metres of each, cut where time or a body jumped.

import { BufferAttribute, BufferGeometry, Color, DynamicDrawUsage, Group, LineBasicMaterial, LineSegments } from "three";
import { paletteColour } from "./colours.js";
import { FLOATS_PER_LINK, isPlaced } from "./messages.js";

const SEGMENTS = 1024;
const BODIES_MAX = 256;
/** A body that was faster than this (m/s) did not go: it was put there. */
const SPEED_MAX = 16;
const STEP_M = 0.004;
/** A page that is behind gets poses that lie apart: what may be a way, and what a jump, is told by no more than this. */
const GAP_S = 0.04;

class Path {
  /** @param {number} link @param {string} colour */
  constructor(link, colour) {
    this.link = link;
    this.next = 0;
    this.count = 0;
    /** @type {{x: number, y: number, z: number, tick: number} | null} */
    this.last = null;
    const geometry = new BufferGeometry();
    this.positions = new BufferAttribute(new Float32Array(SEGMENTS * 6), 3).setUsage(DynamicDrawUsage);
    geometry.setAttribute("position", this.positions);
    geometry.setDrawRange(0, 0);
    this.line = new LineSegments(geometry, new LineBasicMaterial({ color: new Color(colour) }));
    this.line.frustumCulled = false;
  }

  /** @param {Float32Array} poses @param {number} tick @param {number} tick_s @param {boolean} cut */
  add(poses, tick, tick_s, cut) {
    if (!isPlaced(poses, this.link)) {
      this.last = null;
      return;
    }
    const start = this.link * FLOATS_PER_LINK;
    const [x, y, z] = [poses[start], poses[start + 1], poses[start + 2]];
    const last = this.last;
    if (last === null || cut || tick < last.tick) {
      this.last = { x, y, z, tick };
      return;
    }
    const way = Math.hypot(x - last.x, y - last.y, z - last.z);
    const way_max = STEP_M + SPEED_MAX * Math.min(GAP_S, (tick - last.tick) * tick_s);
    if (way < STEP_M) {
      last.tick = tick;
      return;
    }
    if (way <= way_max) {
      this.positions.array.set([last.x, last.y, last.z, x, y, z], this.next * 6);
      this.next = (this.next + 1) % SEGMENTS;
      this.count = Math.min(SEGMENTS, this.count + 1);
      this.positions.needsUpdate = true;
      this.line.geometry.setDrawRange(0, this.count * 2);
    }
    this.last = { x, y, z, tick };
  }
}

export class Paths {
  constructor() {
    this.group = new Group();
    this.group.visible = false;
    /** @type {Path[]} */
    this.paths = [];
    this.tick = -1;
    /** @type {Record<string, SceneMark>} */
    this.kinds = {};
  }

  /** Begin anew with the bodies of a scene. @param {SceneMessage} scene */
  build(scene) {
    this.clear();
    this.kinds = scene.marks;
    scene.bodies.slice(0, BODIES_MAX).forEach((body, index) => {
      if (!body.links.length) return;
      const path = new Path(body.links[body.links.length - 1], paletteColour(index + 1));
      this.paths.push(path);
      this.group.add(path.line);
    });
  }

  /**
   * Go on to further poses. Where time jumped, or something was put elsewhere in between, no line joins them.
   * @param {Poses} poses
   * @param {number} tick_s
   * @param {Mark[]} marks
   */
  add(poses, tick_s, marks) {
    const cut = poses.jump || marks.some(({ tick, kind }) => tick > this.tick && tick <= poses.tick && this.kinds[kind]?.cut);
    for (const path of this.paths) path.add(poses.links, poses.tick, tick_s, cut);
    this.tick = poses.tick;
  }

  clear() {
    for (const path of this.paths) {
      this.group.remove(path.line);
      path.line.geometry.dispose();
      /** @type {LineBasicMaterial} */ (path.line.material).dispose();
    }
    this.paths = [];
  }

  dispose() {
    this.clear();
    this.group.removeFromParent();
  }
}
