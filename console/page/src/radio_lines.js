// Links over the air as lines coloured by loss, the walls they cross, and packets that flash where they died.
// Of each link the half at its sender is drawn: both ways of a pair are seen.

import {
  BufferAttribute, BufferGeometry, CanvasTexture, Color, Group, Points, PointsMaterial, Vector3,
} from "three";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";
import { LineSegments2 } from "three/addons/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/addons/lines/LineSegmentsGeometry.js";
import { lossColour } from "./colours.js";

const LINES_MAX = 2000;
const WALLS_MAX = 2000;
const FLASHES_MAX = 256;
const FLASH_MS = 900;

/** A sign as a texture. @param {string} sign @param {string} colour */
function signTexture(sign, colour) {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 64;
  const context = canvas.getContext("2d");
  if (context) {
    context.font = "bold 52px sans-serif";
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.lineWidth = 8;
    context.strokeStyle = "#000a";
    context.strokeText(sign, 32, 34);
    context.fillStyle = colour;
    context.fillText(sign, 32, 34);
  }
  return new CanvasTexture(canvas);
}

/** @param {number} count @param {CanvasTexture} map @param {number} size */
function signs(count, map, size) {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(count * 3), 3));
  geometry.setDrawRange(0, 0);
  const material = new PointsMaterial({ map, size, sizeAttenuation: false, transparent: true, depthTest: false });
  const points = new Points(geometry, material);
  points.frustumCulled = false;
  points.renderOrder = 3;
  return points;
}

/**
 * Where an end of a link is: at its link of the scene, or where the deployment has who has no body.
 * @param {import("./world.js").World} world
 * @param {number | null} link
 * @param {Vec3 | null | undefined} at
 * @param {Vector3} into
 */
function endOf(world, link, at, into) {
  if (link !== null) return world.placeOfLink(link, into);
  return at ? into.set(...at) : null;
}

export class RadioLines {
  constructor() {
    this.group = new Group();
    this.material = new LineMaterial({ linewidth: 2, vertexColors: true, transparent: true, opacity: 0.85 });
    this.lines = new LineSegments2(new LineSegmentsGeometry(), this.material);
    this.lines.frustumCulled = false;
    this.walls = signs(WALLS_MAX, signTexture("▮", "#ffffff"), 10);
    this.deaths = signs(FLASHES_MAX, signTexture("✕", "#ff7a1a"), 20);
    this.group.add(this.lines, this.walls, this.deaths);
    /** @type {{place: Vector3, until: number}[]} */
    this.flashes = [];
    this.count = 0;
    this.colour = new Color();
    this.from = new Vector3();
    this.to = new Vector3();
  }

  /**
   * Draw the lines of a world's links where they are.
   * @param {import("./world.js").World} world
   * @param {[string, string] | null} chosen
   */
  draw(world, chosen) {
    const positions = [];
    const colours = [];
    const walls = [];
    for (const link of world.source.links) {
      if (positions.length >= LINES_MAX * 6) break;
      if (!link.radio) continue;
      const from = endOf(world, link.from_link, link.from_at, this.from);
      const to = endOf(world, link.to_link, link.to_at, this.to);
      if (!from || !to) continue;
      const share = chosen && link.from === chosen[0] && link.to === chosen[1] ? 1 : 0.5;
      const end = to.lerp(from, 1 - share);
      positions.push(from.x, from.y, from.z, end.x, end.y, end.z);
      const { r, g, b } = this.colour.setRGB(...lossColour(link.loss ?? 0), "srgb");
      colours.push(r, g, b, r, g, b);
      if (walls.length < WALLS_MAX * 3) walls.push(...link.walls.flat());
    }
    this.count = positions.length / 6;
    this.lines.visible = this.count > 0;
    if (this.count) {
      const geometry = new LineSegmentsGeometry();
      geometry.setPositions(positions);
      geometry.setColors(colours);
      this.lines.geometry.dispose();
      this.lines.geometry = geometry;
    }
    put(this.walls, walls.slice(0, WALLS_MAX * 3));
  }

  /** @param {number} width @param {number} height of the canvas, px */
  resize(width, height) {
    this.material.resolution.set(width, height);
  }

  /**
   * Have drops flash where they happened.
   * @param {import("./world.js").World} world
   * @param {Drop[]} drops
   * @param {number} now_ms
   */
  flash(world, drops, now_ms) {
    for (const drop of drops) {
      const place = this._placeOf(world, drop);
      if (!place) continue;
      this.flashes.push({ place, until: now_ms + FLASH_MS });
    }
    this.flashes.splice(0, Math.max(0, this.flashes.length - FLASHES_MAX));
  }

  /** @param {import("./world.js").World} world @param {Drop} drop */
  _placeOf(world, drop) {
    const link = world.source.links.find((one) => one.from === drop.from && one.to === drop.to);
    if (!link) return null;
    const from = endOf(world, link.from_link, link.from_at, new Vector3());
    const to = endOf(world, link.to_link, link.to_at, new Vector3());
    if (drop.where === "way") {
      if (link.walls.length) return new Vector3(...link.walls[0]);
      return from && to ? from.lerp(to, 0.5) : (from ?? to);
    }
    return drop.where === "sender" ? from : to;
  }

  /** Draw what still flashes; returns whether something does. @param {number} now_ms */
  fade(now_ms) {
    const before = this.flashes.length;
    this.flashes = this.flashes.filter((flash) => flash.until > now_ms);
    if (!before) return false;
    put(this.deaths, this.flashes.flatMap(({ place }) => place.toArray()));
    return true;
  }
}

/** @param {Points<BufferGeometry, any>} points @param {number[]} places */
function put(points, places) {
  const attribute = points.geometry.getAttribute("position");
  /** @type {Float32Array} */ (attribute.array).set(places);
  attribute.needsUpdate = true;
  points.geometry.setDrawRange(0, places.length / 3);
  points.visible = places.length > 0;
}
