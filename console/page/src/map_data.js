// A scene and its poses as data of a map: shapes as seen from above.

import { FLOATS_PER_LINK } from "./messages.js";

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

/**
 * What is seen of a shape from above: the outline of its bounding box's projection, or a circle.
 * @param {Shape} shape
 * @param {Vec3} position of its link
 * @param {Quat} orientation of its link
 * @returns {import("./map.js").MapShape | null}
 */
export function fromAbove(shape, position, orientation) {
  const [x, y] = turned(orientation, shape.position);
  const at = /** @type {[number, number]} */ ([position[0] + x, position[1] + y]);
  const turn = times(orientation, shape.orientation);
  const colour = cssColour(shape.colour);
  if (shape.kind === "sphere") return { kind: "circle", at, radius: shape.radius, colour };
  const up = turned(turn, [0, 0, 1]);
  const radius = shape.radius ?? 0;
  if (shape.kind === "cylinder" && Math.abs(up[2]) > 0.9) return { kind: "circle", at, radius, colour };
  if (shape.kind === "mesh") return null;
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
  const bodies = scene.bodies.filter((body) => body.links.length).map((body) => {
    const { position } = poseOf(body.links[body.links.length - 1]);
    const shapes = body.links.flatMap((link) => {
      const pose = poseOf(link);
      return scene.links[link].shapes.map((shape) => fromAbove(shape, pose.position, pose.orientation));
    });
    return { name: body.name, at: /** @type {[number, number]} */ ([position[0], position[1]]), shapes: present(shapes) };
  });
  const scenery = present(scene.scenery.map((shape) => fromAbove(shape, [0, 0, 0], [0, 0, 0, 1])));
  return { bounds: [[low[0], low[1]], [high[0], high[1]]], scenery, bodies };
}

/** @template T @param {(T | null)[]} items @returns {T[]} */
function present(items) {
  return /** @type {T[]} */ (items.filter((item) => item !== null));
}
