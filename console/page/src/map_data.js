// A scene and its poses as data of a map: shapes as seen from above.

import { decodeMesh, FLOATS_PER_LINK, isPlaced } from "./messages.js";

/** Corners of a mesh that its outline is made of; of a mesh with more the outermost ones in so many directions. */
const CORNERS_MAX = 400;
/** Corners that a circle is drawn with. */
const ROUND = 16;

/** @param {Rgba} colour */
function cssColour([red, green, blue, alpha]) {
  return `rgb(${Math.round(red * 255)} ${Math.round(green * 255)} ${Math.round(blue * 255)} / ${Math.round(alpha * 100)}%)`;
}

/** @param {Quat} a @param {Quat} b @returns {Quat} the turn b followed by a */
function times([ax, ay, az, aw], [bx, by, bz, bw]) {
  return [
    aw * bx + ax * bw + ay * bz - az * by,
    aw * by - ax * bz + ay * bw + az * bx,
    aw * bz + ax * by - ay * bx + az * bw,
    aw * bw - ax * bx - ay * by - az * bz,
  ];
}

/** @param {Quat} q @param {Vec3} v @returns {Vec3} */
function turned(q, v) {
  const [x, y, z] = times(times(q, [v[0], v[1], v[2], 0]), [-q[0], -q[1], -q[2], q[3]]);
  return [x, y, z];
}

/** @type {WeakMap<{vertices: string, triangles: string}, Vec3[]>} */
const cornersKnown = new WeakMap();

/** The corners (m) of a mesh that its convex outline is made of. @param {{vertices: string, triangles: string}} mesh */
export function cornersOf(mesh) {
  let corners = cornersKnown.get(mesh);
  if (!corners) {
    const { vertices } = decodeMesh(mesh);
    const all = Array.from({ length: vertices.length / 3 }, (_, index) => /** @type {Vec3} */ ([...vertices.subarray(3 * index, 3 * index + 3)]));
    corners = all.length > CORNERS_MAX ? outermost(all) : all;
    cornersKnown.set(mesh, corners);
  }
  return corners;
}

/** The points that are farthest in directions that are spread evenly (a Fibonacci sphere). @param {Vec3[]} points */
function outermost(points) {
  /** @type {Set<Vec3>} */
  const found = new Set();
  for (let index = 0; index < CORNERS_MAX; index += 1) {
    const z = 1 - (2 * index + 1) / CORNERS_MAX;
    const across = Math.sqrt(1 - z * z);
    const angle = index * Math.PI * (3 - Math.sqrt(5));
    const [x, y] = [across * Math.cos(angle), across * Math.sin(angle)];
    let best = points[0];
    let far = -Infinity;
    for (const point of points) {
      const reach = x * point[0] + y * point[1] + z * point[2];
      if (reach > far) [best, far] = [point, reach];
    }
    found.add(best);
  }
  return [...found];
}

/**
 * What is seen of a shape from above: the convex outline of its projection, or a circle; upright, a cylinder and a capsule
 * are circles. A cylinder that lies is seen as the box around it; null for a mesh that is not known.
 * @param {Shape} shape
 * @param {Vec3} position of its link
 * @param {Quat} orientation of its link
 * @param {SceneMessage["meshes"]} meshes
 * @returns {import("./map.js").MapShape | null}
 */
export function fromAbove(shape, position, orientation, meshes) {
  const [x, y] = turned(orientation, shape.position);
  const at = /** @type {[number, number]} */ ([position[0] + x, position[1] + y]);
  const turn = times(orientation, shape.orientation);
  const colour = cssColour(shape.colour);
  if (shape.kind === "sphere") return { kind: "circle", at, radius: shape.radius, colour };
  const up = turned(turn, [0, 0, 1]);
  const radius = shape.radius ?? 0;
  const isRound = shape.kind === "cylinder" || shape.kind === "capsule";
  if (isRound && Math.abs(up[2]) > 0.9) return { kind: "circle", at, radius, colour };
  if (shape.kind === "capsule") {
    const ends = [-1, 1].map((side) => (side * (shape.length ?? 0)) / 2);
    const round = [...Array(ROUND).keys()].map((step) => (2 * Math.PI * step) / ROUND);
    const points = ends.flatMap((end) => round.map((angle) => /** @type {[number, number]} */ (
      [end * up[0] + radius * Math.cos(angle), end * up[1] + radius * Math.sin(angle)])));
    return { kind: "polygon", at, points: hull(points), colour };
  }
  if (shape.kind === "mesh") {
    const mesh = meshes[shape.mesh ?? ""];
    if (!mesh) return null;
    const seen = cornersOf(mesh).map((corner) => turned(turn, corner));
    return { kind: "polygon", at, points: hull(seen.map(([cx, cy]) => [cx, cy])), colour };
  }
  const half = shape.kind === "box" ? (shape.half ?? [0, 0, 0]) : [radius, radius, (shape.length ?? 0) / 2];
  const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((bits) => {
    const corner = half.map((size, index) => (bits & (1 << index) ? size : -size));
    return turned(turn, [corner[0], corner[1], corner[2]]);
  });
  return { kind: "polygon", at, points: hull(corners.map(([cx, cy]) => [cx, cy])), colour };
}

/** The convex hull of points, by Andrew's monotone chain. @param {[number, number][]} points @returns {[number, number][]} */
function hull(points) {
  const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const half = (/** @type {[number, number][]} */ order) => {
    /** @type {[number, number][]} */
    const chain = [];
    for (const point of order) {
      while (chain.length > 1 && cross(chain[chain.length - 2], chain[chain.length - 1], point) <= 1e-12) chain.pop();
      chain.push(point);
    }
    chain.pop();
    return chain;
  };
  return [...half(sorted), ...half(sorted.reverse())];
}

/** @param {[number, number]} o @param {[number, number]} a @param {[number, number]} b */
function cross(o, a, b) {
  return (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]);
}

/**
 * @param {SceneMessage} scene
 * @param {Float32Array} poses
 * @returns {import("./map.js").MapData}
 */
export function mapOf(scene, poses) {
  const [low, high] = scene.bounds;
  const poseOf = (/** @type {number} */ link) => {
    const [x, y, z, qx, qy, qz, qw] = poses.subarray(link * FLOATS_PER_LINK, (link + 1) * FLOATS_PER_LINK);
    return { position: /** @type {Vec3} */ ([x, y, z]), orientation: /** @type {Quat} */ ([qx, qy, qz, qw]) };
  };
  const bodies = scene.bodies.filter(({ links }) => links.length && isPlaced(poses, links[links.length - 1])).map((body) => {
    const { position } = poseOf(body.links[body.links.length - 1]);
    const shapes = body.links.flatMap((link) => {
      const pose = poseOf(link);
      return scene.links[link].shapes.map((shape) => fromAbove(shape, pose.position, pose.orientation, scene.meshes));
    });
    return { name: body.name, at: /** @type {[number, number]} */ ([position[0], position[1]]), shapes: present(shapes) };
  });
  const scenery = present(scene.scenery.map((shape) => fromAbove(shape, [0, 0, 0], [0, 0, 0, 1], scene.meshes)));
  return { bounds: [[low[0], low[1]], [high[0], high[1]]], scenery, bodies };
}

/** @template T @param {(T | null)[]} items @returns {T[]} */
function present(items) {
  return /** @type {T[]} */ (items.filter((item) => item !== null));
}
