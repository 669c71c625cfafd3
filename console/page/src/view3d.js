// The view: worlds, camera, what is followed and picked. It draws when the browser asks for a frame, the newest state only.

import {
  Box3, Color, DirectionalLight, GridHelper, HemisphereLight, PerspectiveCamera, Plane, Raycaster, Scene, Vector2, Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { Labels } from "./labels.js";
import { Overlays } from "./overlays.js";
import { RadioLines } from "./radio_lines.js";
import { byId, h } from "./ui.js";
import { World } from "./world.js";

const CLICK_PX = 5;
const PIXEL_RATIO_MAX = 2;
/** Drawn anew although nothing moved: what the page looks like settles. */
const FRAMES_AFTER_CHANGE = 4;
/** The side of the shadow map. */
const SHADOW_PX = 1024;
/** The direction to the sun, as cameras have it (rendering/model.py). */
const SUN = new Vector3(0.384, 0.288, 0.877);
const HOME_ROUNDS = 16;
/** The world stands below the middle by this share of half the height: above it is the bar of the view. */
const HOME_DROP = 0.06;

/**
 * @typedef {object} Options what is shown
 * @property {boolean} owners
 * @property {boolean} paths
 * @property {boolean} contacts
 * @property {boolean} rays
 * @property {boolean} radio
 * @property {boolean} labels
 * @property {boolean} follow
 * @property {"single" | "side" | "ghost"} two how a second source is shown
 */

export class View3D {
  /**
   * The browser has WebGL 2.
   * @param {HTMLElement} place
   * @param {import("./store.js").Store} store
   * @param {Options} options
   * @param {Stat} stat
   */
  constructor(place, store, options, stat) {
    this.place = place;
    this.store = store;
    this.options = options;
    this.stat = stat;
    this.renderer = new WebGLRenderer({ antialias: true, powerPreference: "high-performance" });
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, PIXEL_RATIO_MAX));
    this.canvas = this.renderer.domElement;
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", "The world in three dimensions. Arrow keys turn the view, plus and minus zoom.");
    place.append(this.canvas);
    this.labels = new Labels(place);
    this.halves = h("div", { id: "halves", hidden: true });
    byId("over").append(this.halves);
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(45, 1, 0.01, 500);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.addEventListener("change", () => this.touch());
    this.scene.add(new HemisphereLight("#ffffff", "#a0a4ab", 1.7));
    this.sun = new DirectionalLight("#ffffff", 2.2);
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(SHADOW_PX, SHADOW_PX);
    this.renderer.shadowMap.enabled = true;
    this.scene.add(this.sun, this.sun.target);
    this.radio = new RadioLines();
    this.overlays = new Overlays();
    this.scene.add(this.radio.group, this.overlays.group);
    /** @type {Map<number, World>} */
    this.worlds = new Map();
    /** @type {GridHelper | null} */
    this.grid = null;
    this.dirty = FRAMES_AFTER_CHANGE;
    this.framed = "";
    this.followed = new Vector3();
    this.following = "";
    this.raycaster = new Raycaster();
    this._listen();
    this.retheme();
    new ResizeObserver(() => this.resize()).observe(place);
    this.resize();
    this.renderer.setAnimationLoop((now_ms) => this.frame(now_ms));
  }

  /** Something changed: draw again. */
  touch() {
    this.dirty = Math.max(this.dirty, FRAMES_AFTER_CHANGE);
  }

  _listen() {
    const { store } = this;
    store.on("sources", () => this._match());
    store.on("scene", (source) => this._build(source));
    store.on("poses", (source) => {
      const world = this.worlds.get(source.info.id);
      if (world) world.paths.add(source.poses, source.info.tick_ns / 1e9, source.marks);
    });
    store.on("drops", ({ source, drops }) => {
      const world = this.worlds.get(source.info.id);
      if (world && this.options.radio && document.visibilityState === "visible") {
        this.radio.flash(world, drops, performance.now());
        this.stat.flashes += drops.length;
        this.stat.flashing = this.radio.flashes.length;
      }
      this.touch();
    });
    for (const name of ["links", "overlay", "status", "selected", "link", "options"]) store.on(name, () => this.touch());
    /** @type {[number, number]} */
    let pressed = [0, 0];
    this.canvas.addEventListener("pointerdown", (event) => (pressed = [event.clientX, event.clientY]));
    this.canvas.addEventListener("pointerup", (event) => {
      const moved = Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]);
      if (moved > CLICK_PX || event.button !== 0) return;
      const at = store.aim ? this.ground(event.clientX, event.clientY) : null;
      if (at) store.emit("aimed", at);
      else if (!store.aim) store.select(this.pick(event.clientX, event.clientY));
    });
    this.canvas.addEventListener("keydown", (event) => this._key(event));
  }

  /** @param {KeyboardEvent} event */
  _key(event) {
    const turns = /** @type {Record<string, [number, number, number]>} */ ({
      ArrowLeft: [-0.1, 0, 1], ArrowRight: [0.1, 0, 1], ArrowUp: [0, -0.08, 1], ArrowDown: [0, 0.08, 1],
      "+": [0, 0, 0.9], "-": [0, 0, 1.1],
    });
    const found = turns[event.key];
    if (!found || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    event.stopPropagation();
    const [around, up, away] = found;
    const arm = this.camera.position.clone().sub(this.controls.target).multiplyScalar(away);
    const flat = Math.hypot(arm.x, arm.y);
    const turn = Math.atan2(arm.y, arm.x) + around;
    const rise = Math.min(1.55, Math.max(-1.5, Math.atan2(arm.z, flat) - up));
    const length = arm.length();
    arm.set(Math.cos(turn) * Math.cos(rise), Math.sin(turn) * Math.cos(rise), Math.sin(rise)).multiplyScalar(length);
    this.camera.position.copy(this.controls.target).add(arm);
    this.controls.update();
    this.touch();
  }

  /** Have a world for each source. */
  _match() {
    for (const world of this.worlds.values()) world.dispose();
    this.worlds.clear();
    for (const source of this.store.sources.values()) {
      const world = new World(source, source.info.id > 0 && this.options.two === "ghost");
      this.worlds.set(source.info.id, world);
      this.scene.add(world.group);
      world.build();
    }
    this._name_halves();
    this.touch();
  }

  /** Say which world is which, where there are two. */
  _name_halves() {
    const { two } = this.options;
    this.halves.hidden = this.worlds.size < 2 || two === "single";
    this.halves.className = two;
    const names = [...this.worlds.values()].map(({ source }) => source.info.name);
    this.halves.replaceChildren(...names.map((name, index) => h("span", {}, h("b", {}, index > 0 && two === "ghost" ? `ghost: ${name}` : name))));
  }

  /** How a second source is shown has changed. */
  rearrange() {
    this._match();
    this.home();
  }

  /** @param {import("./store.js").Source} source */
  _build(source) {
    const world = this.worlds.get(source.info.id);
    world?.build();
    if (source.info.id === 0 && source.scene && this.framed !== `${source.info.name} ${source.scene.bounds}`) {
      this.framed = `${source.info.name} ${source.scene.bounds}`;
      this.home();
    }
    this.touch();
  }

  get bounds() {
    const [low, high] = this.store.main?.scene?.bounds ?? [[-1, -1, 0], [1, 1, 1]];
    return new Box3(new Vector3(...low), new Vector3(...high));
  }

  /** Show the whole world, from the near side and above. */
  home() {
    const box = this.bounds;
    const size = box.getSize(new Vector3());
    const centre = box.getCenter(new Vector3());
    const reach = size.length();
    this._light(centre, reach);
    this.camera.near = reach / 150;
    this.camera.far = reach * 40;
    this.camera.aspect = this.place.clientWidth / (this._is_split ? 2 : 1) / Math.max(1, this.place.clientHeight);
    this.camera.updateProjectionMatrix();
    let [near, far] = [reach * 0.3, reach * 6];
    for (let round = 0; round < HOME_ROUNDS; round += 1) {
      const away = (near + far) / 2;
      if (this._fits(box, centre, away)) far = away;
      else near = away;
    }
    this._fits(box, centre, far);
    this.controls.minDistance = reach / 100;
    this.controls.maxDistance = reach * 8;
    this.controls.update();
    this._lay_grid(size, box);
    this.touch();
  }

  /** Have the sun's shadows cover the world. @param {Vector3} centre @param {number} reach m */
  _light(centre, reach) {
    this.sun.target.position.copy(centre);
    this.sun.position.copy(centre).addScaledVector(SUN, reach);
    const { camera } = this.sun.shadow;
    [camera.left, camera.right, camera.bottom, camera.top] = [-reach / 2, reach / 2, -reach / 2, reach / 2];
    [camera.near, camera.far] = [reach / 4, reach * 2];
    camera.updateProjectionMatrix();
    this.sun.shadow.normalBias = reach / SHADOW_PX;
  }

  /**
   * Look from a distance, the world in the middle of what the bars leave; returns whether all of it is seen.
   * @param {Box3} box @param {Vector3} centre @param {number} away
   */
  _fits(box, centre, away) {
    const target = centre.clone();
    let extent = [0, 0, 0];
    for (let round = 0; round < 3; round += 1) {
      this.controls.target.copy(target);
      this.camera.position.copy(target).add(new Vector3(0, -0.66, 0.75).normalize().multiplyScalar(away));
      this.camera.lookAt(target);
      this.camera.updateMatrixWorld();
      const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((bits) =>
        new Vector3(bits & 1 ? box.max.x : box.min.x, bits & 2 ? box.max.y : box.min.y, bits & 4 ? box.max.z : box.min.z).project(this.camera));
      const heights = corners.map(({ y }) => y);
      extent = [Math.min(...heights), Math.max(...heights), Math.max(...corners.map(({ x }) => Math.abs(x)))];
      const off = (extent[0] + extent[1]) / 2 + HOME_DROP;
      target.y += off * away * Math.tan((this.camera.fov * Math.PI) / 360);
    }
    return extent[1] - extent[0] < 1.7 && extent[2] < 0.95;
  }

  /** @param {Vector3} size @param {Box3} box */
  _lay_grid(size, box) {
    if (this.grid) {
      this.scene.remove(this.grid);
      this.grid.dispose();
    }
    const reach = Math.max(size.x, size.y) * 2.5;
    const cell = 10 ** Math.round(Math.log10(Math.max(size.x, size.y) / 10));
    const cells = 2 * Math.ceil(reach / cell / 2);
    const style = getComputedStyle(document.documentElement);
    const line = style.getPropertyValue("--grid").trim();
    this.grid = new GridHelper(cells * cell, cells, line, line);
    this.grid.rotation.x = Math.PI / 2;
    this.grid.position.z = Math.min(0, box.min.z) - 0.002 * size.length();
    this.scene.add(this.grid);
  }

  /** Take the colours of the page's theme. */
  retheme() {
    this.scene.background = new Color(getComputedStyle(document.documentElement).getPropertyValue("--sky").trim() || "#fff");
    if (this.grid) this._lay_grid(this.bounds.getSize(new Vector3()), this.bounds);
    this.touch();
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.place;
    if (!width || !height) return;
    this.renderer.setSize(width, height);
    this.radio.resize(width, height);
    this.touch();
  }

  /**
   * The place on the ground (m) under a place of the window, in the first source; null where there is none.
   * @param {number} x @param {number} y px
   * @returns {[number, number] | null}
   */
  ground(x, y) {
    if (this._look_through(x, y).source !== 0) return null;
    const at = this.raycaster.ray.intersectPlane(new Plane(new Vector3(0, 0, 1)), new Vector3());
    return at && [at.x, at.y];
  }

  /** The body under a place of the window; empty where there is none. @param {number} x @param {number} y px */
  pick(x, y) {
    const world = this.worlds.get(this._look_through(x, y).source);
    const hits = this.raycaster.intersectObjects((world?.batches ?? []).map((batch) => batch.mesh), false);
    for (const hit of hits) {
      const batch = hit.object.userData.batch;
      const { link } = batch.placed[hit.instanceId ?? 0];
      if (link >= 0) return world?.scene?.links[link].body ?? "";
    }
    return "";
  }

  /** Lay the ray through a place of the window; returns the half of the view that it is in. @param {number} x @param {number} y px */
  _look_through(x, y) {
    const view = this._viewport_at(x - this.canvas.getBoundingClientRect().left);
    const box = this.canvas.getBoundingClientRect();
    const point = new Vector2(((x - box.left - view.left) / view.width) * 2 - 1, 1 - ((y - box.top) / box.height) * 2);
    this.camera.aspect = view.width / box.height;
    this.camera.updateProjectionMatrix();
    this.raycaster.setFromCamera(point, this.camera);
    return view;
  }

  get _is_split() {
    return this.options.two === "side" && this.worlds.size > 1;
  }

  /** @param {number} x px from the left of the canvas */
  _viewport_at(x) {
    const width = this.place.clientWidth;
    if (!this._is_split) return { left: 0, width, source: 0 };
    return x < width / 2 ? { left: 0, width: width / 2, source: 0 } : { left: width / 2, width: width / 2, source: 1 };
  }

  /** @param {number} now_ms */
  frame(now_ms) {
    let moved = false;
    for (const world of this.worlds.values()) {
      moved = world.place() || moved;
      moved = world.paint(this.options.owners, this.store.selected) || moved;
      world.paths.group.visible = this.options.paths;
    }
    this._follow();
    const flashes = this.radio.fade(now_ms);
    this.stat.flashing = this.radio.flashes.length;
    if (!moved && !flashes && this.dirty <= 0) return;
    this.dirty -= 1;
    const main = this.worlds.get(0);
    if (main) this._draw_overlays(main);
    this._render();
    this.stat.frames += 1;
    this.stat.drawn = main?.drawn?.tick ?? -1;
  }

  /** @param {World} main */
  _draw_overlays(main) {
    this.radio.group.visible = this.options.radio;
    if (this.options.radio) this.radio.draw(main, this.store.link);
    this.stat.radio = this.options.radio ? this.radio.count : 0;
    const counts = this.overlays.draw(main.source.overlay, this.options.contacts, this.options.rays);
    Object.assign(this.stat, counts);
  }

  _follow() {
    const world = this.worlds.get(0);
    const name = this.options.follow ? this.store.selected : "";
    const body = name ? world?.scene?.bodies.find((one) => one.name === name) : undefined;
    const place = body && world ? world.placeOf(body, new Vector3()) : null;
    if (!place) {
      this.following = "";
      return;
    }
    if (this.following !== name) {
      this.following = name;
      this.followed.copy(this.controls.target);
    }
    const step = place.clone().sub(this.followed);
    if (step.lengthSq() < 1e-12) return;
    this.camera.position.add(step);
    this.controls.target.add(step);
    this.followed.copy(place);
    this.controls.update();
  }

  _render() {
    const { clientWidth: width, clientHeight: height } = this.place;
    const views = this._is_split ? [0, 1] : [0];
    const share = width / views.length;
    this.renderer.setScissorTest(views.length > 1);
    this.camera.aspect = share / Math.max(1, height);
    this.camera.updateProjectionMatrix();
    for (const view of views) {
      for (const [id, world] of this.worlds) {
        world.group.visible = this._is_split ? id === view : id === 0 || this.options.two === "ghost";
      }
      this.overlays.group.visible = view === 0;
      this.radio.group.visible = view === 0 && this.options.radio;
      this.renderer.setViewport(view * share, 0, share, height);
      this.renderer.setScissor(view * share, 0, share, height);
      this.renderer.render(this.scene, this.camera);
    }
    const main = this.worlds.get(0);
    if (main) this.labels.draw(main, this.camera, share, height, this.options.labels, this.store.selected);
  }
}
