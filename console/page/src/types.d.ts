// What goes over the WebSocket and between the modules. Ambient: every module sees these names.

type Vec3 = [number, number, number];
type Quat = [number, number, number, number];
type Rgba = [number, number, number, number];

interface Shape {
  kind: "box" | "sphere" | "cylinder" | "capsule" | "mesh";
  half?: Vec3;
  radius?: number;
  length?: number;
  mesh?: string;
  metal?: boolean;
  position: Vec3;
  orientation: Quat;
  colour: Rgba;
  name: string;
}

interface SceneLink { name: string; body: string; shapes: Shape[] }
interface SceneBody { name: string; model: string; links: number[]; robot: boolean; removable: boolean; pushable: boolean; settable: Record<string, string>; jobs: SceneJobs[]; drivable: boolean }
/** An actuator of whose jobs a sensor tells, and the names of its commands' numbers. */
interface SceneJobs { actuator: string; numbers: string[] }
/** A run of numbers of a field; with a name the number of a joint. */
interface SceneField { entity: string; field: string; name?: string; unit: string; index: number; count: number }
interface SceneCommand { robot: string; channel: string; number: string; unit: string; index: number }
/** A sensor; `numbers` are the names and units of a reading of joints. */
interface SceneSensor { robot: string; channel: string; kind: string; unit: string; numbers: [string, string][] }
/** A kind of marks that a rule of the world brings; with `cut` something is put elsewhere then. */
interface SceneMark { look: string; text: string; cut: boolean }

interface SceneMessage {
  type: "scene";
  source: number;
  generation: number;
  layout: string;
  links: SceneLink[];
  scenery: Shape[];
  bodies: SceneBody[];
  fields: SceneField[];
  commands: SceneCommand[];
  sensors: SceneSensor[];
  cameras?: { robot: string; channel: string; pictures: string[] }[];
  meshes: Record<string, { vertices: string; triangles: string }>;
  bounds: [Vec3, Vec3];
  /** The kinds of marks that the rules of the world bring. */
  marks: Record<string, SceneMark>;
  /** Ids of the link rules that can be set, and all endpoints; absent where there is no deployment. */
  network?: {rules: string[], endpoints: string[]};
}

/**
 * Poses of all links: 7 numbers each (x, y, z in m; quaternion x, y, z, w); behind them the values that are plotted. Of what
 * is absent they are not a number.
 */
interface Poses {
  source: number;
  jump: boolean;
  paused: boolean;
  generation: number;
  tick: number;
  links: Float32Array;
  values: Float32Array;
}

interface SourceInfo {
  id: number;
  kind: "live" | "capture" | "replay" | "poses";
  name: string;
  world: string;
  tick_ns: number;
  verbs: string[];
  span: { first: number; last: number } | null;
}

interface LinkWindow {
  from: string;
  to: string;
  rule: string;
  radio: boolean;
  offered: number;
  delivered: number;
  dropped: number;
  loss: number | null;
  delay_ms: number | null;
  queue_ms: number | null;
  causes: Record<string, number>;
  from_link: number | null;
  to_link: number | null;
  from_at?: Vec3 | null;
  to_at?: Vec3 | null;
  walls: Vec3[];
}

interface Drop { from: string; to: string; cause: string; where: "sender" | "way" | "receiver"; count: number }
interface Mark { tick: number; kind: string; text: string }
interface Step { stage: string; outcome: string; text: string }
interface ExplainedDrop { tick: number; cause: string; head: string; steps: Step[]; verdict: string }
interface WatchedMessage { source: number; link: [string, string]; rule: string; drops: ExplainedDrop[] }
/** Whether a run is there, its supervisor away, or the run over; then how, and what shows its capture. */
interface Presence {
  source: number;
  state: "here" | "away" | "ended";
  text: string;
  failed?: boolean;
  reason?: string;
  capture?: string | null;
  command?: string;
}
/** Jobs that the console has given, and why it can give none. */
interface JobsMessage { source: number; problem: string; jobs: { robot: string; actuator: string; number: number | null; state: string; text: string; ended: boolean }[] }
interface Answer { picture?: string; id: number; accepted: boolean; text: string; tick: number; verb: string; who: string }
interface Compared {
  at: number;
  /** First and last tick of the first source's clock at which the second one has something. */
  covers?: [number, number];
  entities: { name: string; distance_m: number }[];
  series: [number, number][];
}
interface Overlay {
  source: number;
  generation: number;
  tick: number;
  contacts?: [number, number, number, number][];
  rays?: [number, number, number, number, number, number][];
}

/** The status of a run, as the supervisor answers it. */
type Status = any;

/** One line of a chart: ticks ascending, a value each; null where there is none. With `step` a value holds until the next one. */
interface Series { name: string; unit: string; points: [number, number | null][]; step?: boolean }

interface SeriesRequest {
  id: string;
  field?: number;
  link?: [string, string];
  figure?: string;
  status?: string;
  reading?: [string, string];
  index?: number;
}

interface Stat {
  frames: number;
  tick: number;
  generation: number;
  connected: boolean;
  errors: number;
  messages: number;
  poses: number;
  links: number;
  bodies: number;
  absent: number;
  drawn: number;
  role: string;
  paused: boolean;
  marks: number;
  contacts: number;
  rays: number;
  radio: number;
  flashes: number;
  flashing: number;
  view: string;
}

interface Window { foosim: { stat: Stat } }
