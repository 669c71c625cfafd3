// Shapes of links as instances: one mesh for each kind of geometry, so a world of a thousand robots is a few draw calls.

import {
  BoxGeometry, BufferAttribute, BufferGeometry, CapsuleGeometry, CylinderGeometry, DynamicDrawUsage, InstancedMesh, Matrix4,
  MeshPhongMaterial, Quaternion, SphereGeometry, Vector3,
} from "three";
import { toCreasedNormals } from "three/addons/utils/BufferGeometryUtils.js";
import { FLOATS_PER_LINK, decodeMesh, isPlaced } from "./messages.js";

/** @typedef {{shape: Shape, link: number}} Placed a shape and its link; -1: it never moves */

/** Faces of a mesh that meet at less than this (rad) look like one smooth surface. */
const CREASE = 0.72;

const at = new Vector3();
const turn = new Quaternion();
const one = new Vector3(1, 1, 1);
const whole = new Matrix4();

/**
 * The matrix of a link from the poses of all; of one that is absent it leaves nothing to see. @param {Float32Array} poses @param {number} link @param {Matrix4} into
 */
export function linkMatrix(poses, link, into) {
  if (!isPlaced(poses, link)) return into.makeScale(0, 0, 0);
  const start = link * FLOATS_PER_LINK;
  at.set(poses[start], poses[start + 1], poses[start + 2]);
  turn.set(poses[start + 3], poses[start + 4], poses[start + 5], poses[start + 6]);
  return into.compose(at, turn, one);
}

/** The matrix of a shape in its link, with its size where its geometry is of unit size. @param {Shape} shape */
function localMatrix(shape) {
  const size = new Vector3(1, 1, 1);
  if (shape.kind === "box" && shape.half) size.fromArray(shape.half).multiplyScalar(2);
  if (shape.kind === "sphere") size.setScalar(shape.radius ?? 1);
  if (shape.kind === "cylinder") size.set(shape.radius ?? 1, shape.radius ?? 1, shape.length ?? 1);
  return new Matrix4().compose(new Vector3(...shape.position), new Quaternion(...shape.orientation), size);
}

/**
 * A geometry of unit size, but for that of a mesh and of a capsule, whose ends would not stay round.
 * @param {Shape} shape @param {{vertices: string, triangles: string} | undefined} mesh
 */
function geometryOf({ kind, radius, length }, mesh) {
  if (kind === "box") return new BoxGeometry(1, 1, 1);
  if (kind === "sphere") return new SphereGeometry(1, 24, 16);
  if (kind === "cylinder") return new CylinderGeometry(1, 1, 1, 24).rotateX(Math.PI / 2);
  if (kind === "capsule") return new CapsuleGeometry(radius, length, 8, 24).rotateX(Math.PI / 2);
  const geometry = new BufferGeometry();
  if (mesh) {
    const { vertices, triangles } = decodeMesh(mesh);
    geometry.setAttribute("position", new BufferAttribute(vertices, 3));
    geometry.setIndex(new BufferAttribute(triangles, 1));
    return toCreasedNormals(geometry, CREASE);
  }
  return geometry;
}

/** All shapes of one geometry. */
class Batch {
  /** @param {BufferGeometry} geometry @param {Placed[]} placed @param {number} opacity @param {boolean} [metal] */
  constructor(geometry, placed, opacity, metal = false) {
    this.placed = placed;
    this.locals = placed.map(({ shape }) => localMatrix(shape));
    const material = new MeshPhongMaterial({
      transparent: opacity < 1, opacity, depthWrite: opacity === 1, specular: metal ? "#9a9a9a" : "#161616", shininess: metal ? 60 : 20,
    });
    this.mesh = new InstancedMesh(geometry, material, placed.length);
    this.mesh.instanceMatrix.setUsage(DynamicDrawUsage);
    this.mesh.frustumCulled = false;
    this.mesh.castShadow = this.mesh.receiveShadow = opacity === 1;
    this.mesh.userData.batch = this;
    this.locals.forEach((local, index) => this.mesh.setMatrixAt(index, local));
  }

  /** @param {Matrix4[]} links */
  place(links) {
    this.placed.forEach(({ link }, index) => {
      if (link >= 0) this.mesh.setMatrixAt(index, whole.multiplyMatrices(links[link], this.locals[index]));
    });
    this.mesh.instanceMatrix.needsUpdate = true;
    this.mesh.boundingSphere = null;
  }

  /** @param {(placed: Placed) => import("three").Color} colourOf */
  paint(colourOf) {
    this.placed.forEach((placed, index) => this.mesh.setColorAt(index, colourOf(placed)));
    if (this.mesh.instanceColor) this.mesh.instanceColor.needsUpdate = true;
  }

  dispose() {
    this.mesh.geometry.dispose();
    /** @type {MeshPhongMaterial} */ (this.mesh.material).dispose();
    this.mesh.dispose();
  }
}

/**
 * The batches of a scene: opaque ones and, for each opacity, see-through ones.
 * @param {SceneMessage} scene
 * @param {number} opacity of all of it, for a ghost
 * @returns {Batch[]}
 */
export function batchesOf(scene, opacity) {
  /** @type {Placed[]} */
  const placed = opacity < 1 ? [] : scene.scenery.map((shape) => ({ shape, link: -1 }));
  scene.links.forEach((link, index) => placed.push(...link.shapes.map((shape) => ({ shape, link: index }))));
  /** @type {Map<string, Placed[]>} */
  const groups = new Map();
  for (const one of placed) {
    const { kind, mesh, radius, length, colour, metal } = one.shape;
    const size = kind === "capsule" ? `${radius} ${length}` : "";
    const key = `${kind} ${mesh ?? ""} ${size} ${colour[3] * opacity} ${metal}`;
    const group = groups.get(key);
    if (group) group.push(one);
    else groups.set(key, [one]);
  }
  return [...groups.values()].map((group) => {
    const { mesh, colour, metal } = group[0].shape;
    return new Batch(geometryOf(group[0].shape, scene.meshes[mesh ?? ""]), group, colour[3] * opacity, metal);
  });
}
