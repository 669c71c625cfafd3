// What the page knows of its sources. Modules listen by name; what is drawn reads the newest state when it draws.

import { isPlaced } from "./messages.js";

const MARKS_MAX = 5000;
const NOTES_MAX = 300;

/** The bodies of a scene that are absent in poses. @param {SceneMessage} scene @param {Poses} poses */
function absentIn(scene, poses) {
  return new Set(scene.bodies.filter(({ links }) => links.length > 0 && !isPlaced(poses.links, links[0])).map(({ name }) => name));
}

/** One thing that the page looks at: a run, a capture, a replay, recorded poses. */
export class Source {
  /** @param {SourceInfo} info */
  constructor(info) {
    this.info = info;
    /** @type {SceneMessage | null} */
    this.scene = null;
    /** @type {Poses | null} */
    this.poses = null;
    /** @type {Set<string>} the bodies that are absent in these poses */
    this.absent = new Set();
    /** @type {Status | null} */
    this.status = null;
    /** @type {LinkWindow[]} */
    this.links = [];
    this.window_s = 0;
    /** How many links were used: of many the busiest are told, and those that are watched. */
    this.links_in_all = 0;
    /** @type {WatchedMessage | null} */
    this.watched = null;
    /** @type {Overlay | null} */
    this.overlay = null;
    /** @type {Mark[]} */
    this.marks = [];
    /** @type {Presence | null} */
    this.presence = null;
    /** @type {JobsMessage | null} */
    this.jobs = null;
  }

  get tick() {
    return this.poses?.tick ?? this.status?.ticks ?? this.info.span?.first ?? 0;
  }

  /** Simulated seconds of a tick. @param {number} tick */
  seconds(tick) {
    return (tick * this.info.tick_ns) / 1e9;
  }

  get paused() {
    return this.poses ? this.poses.paused : this.status?.state === "paused";
  }

  /** @param {string} verb */
  may(verb) {
    return this.info.verbs.includes(verb);
  }

  /** The node that computes a body: of a robot its owner, of a free body who solves it. @param {string} body */
  ownerOf(body) {
    const nodes = this.status?.nodes ?? {};
    for (const [node, account] of Object.entries(nodes)) if (account.owned?.includes(body)) return node;
    return this.status?.solvers?.[body] ?? "";
  }
}

/** @typedef {{at: Date, level: string, text: string, who: string, tick: number | null}} Note */

export class Store {
  constructor() {
    /** @type {Map<number, Source>} */
    this.sources = new Map();
    this.role = "viewer";
    this.version = "";
    /** @type {Note[]} */
    this.notes = [];
    /** @type {Compared | null} */
    this.compared = null;
    /** @type {string} the body that is selected; empty for none */
    this.selected = "";
    /** @type {string} the robot that is sent to the place that is clicked next; empty for none */
    this.aim = "";
    /** @type {[string, string] | null} */
    this.link = null;
    /** @type {Map<string, Set<(payload: any) => void>>} */
    this._listeners = new Map();
  }

  /** The source that controls, tables and plots are about. @returns {Source | null} */
  get main() {
    return this.sources.get(0) ?? null;
  }

  /** @param {string} name @param {(payload: any) => void} listener */
  on(name, listener) {
    if (!this._listeners.has(name)) this._listeners.set(name, new Set());
    this._listeners.get(name)?.add(listener);
  }

  /**
   * Tell all that listen; one that fails is reported, and the others are told all the same.
   * @param {string} name
   * @param {any} [payload]
   */
  emit(name, payload) {
    for (const listener of this._listeners.get(name) ?? []) {
      try {
        listener(payload);
      } catch (error) {
        window.reportError(error);
      }
    }
  }

  /** @param {string} body */
  select(body) {
    if (this.selected === body) return;
    this.selected = body;
    this.emit("selected", body);
  }

  /** @param {string} robot */
  aimWith(robot) {
    if (this.aim === robot) return;
    this.aim = robot;
    this.emit("aim");
  }

  /** @param {[string, string] | null} link */
  selectLink(link) {
    if (this.link?.join("\n") === link?.join("\n")) return;
    this.link = link;
    this.emit("link", link);
  }

  /** @param {string} level @param {string} text @param {string} [who] @param {number | null} [tick] */
  note(level, text, who = "", tick = null) {
    const note = { at: new Date(), level, text, who, tick };
    this.notes.push(note);
    if (this.notes.length > NOTES_MAX) this.notes.shift();
    this.emit("note", note);
  }

  /** Take poses; those of another scene than the page has are dropped. @param {Poses} poses */
  takePoses(poses) {
    const source = this.sources.get(poses.source);
    if (!source?.scene || source.scene.generation !== poses.generation) return;
    source.poses = poses;
    const absent = absentIn(source.scene, poses);
    const others = absent.size !== source.absent.size || [...absent].some((name) => !source.absent.has(name));
    source.absent = absent;
    this.emit("poses", source);
    if (others) this.emit("absent", source);
  }

  /** @param {any} message */
  take(message) {
    const source = this.sources.get(message.source ?? 0);
    switch (message.type) {
      case "welcome":
      case "sources":
        this._take_sources(message);
        return;
      case "note":
        this.note(message.level, message.text);
        return;
      case "answer":
        if (message.verb === "look") return;
        // The slider shows what became of a request for another moment of a recording.
        this.note(!message.accepted ? "error" : this.main?.info.kind === "live" ? "answer" : "info", message.text || `${message.verb}: done`, message.who, message.tick);
        return;
      case "compared":
        this.compared = message;
        this.emit("compared", message);
        return;
    }
    if (source) this._take_of(source, message);
  }

  /** @param {any} message */
  _take_sources(message) {
    if (message.role) this.role = message.role;
    if (message.version) this.version = message.version;
    const known = this.sources;
    this.sources = new Map();
    for (const info of message.sources) {
      const source = message.type === "sources" ? known.get(info.id) : undefined;
      if (source) source.info = info;
      this.sources.set(info.id, source ?? new Source(info));
    }
    this.emit("sources", message.type);
  }

  /** @param {Source} source @param {any} message */
  _take_of(source, message) {
    switch (message.type) {
      case "scene":
        source.scene = message;
        source.poses = null;
        source.absent = new Set();
        source.overlay = null;
        break;
      case "status":
        source.status = message.status;
        break;
      case "links":
        source.links = message.links;
        source.window_s = message.window_s;
        source.links_in_all = message.in_all;
        break;
      case "watched":
        source.watched = message;
        break;
      case "overlay":
        if (source.scene?.generation !== message.generation) return;
        source.overlay = message;
        break;
      case "jobs":
        source.jobs = message;
        break;
      case "presence":
        source.presence = message;
        break;
      case "marks":
        this._take_marks(source, message.marks);
        break;
    }
    this.emit(message.type, message.type === "plotted" ? message : source);
    if (message.type === "links") this.emit("drops", { source, drops: message.drops ?? [] });
  }

  /** @param {Source} source @param {Mark[]} marks */
  _take_marks(source, marks) {
    const known = new Set(source.marks.map((mark) => `${mark.tick} ${mark.kind} ${mark.text}`));
    source.marks.push(...marks.filter((mark) => !known.has(`${mark.tick} ${mark.kind} ${mark.text}`)));
    source.marks.sort((a, b) => a.tick - b.tick);
    if (source.marks.length > MARKS_MAX) source.marks.splice(0, source.marks.length - MARKS_MAX);
  }
}
