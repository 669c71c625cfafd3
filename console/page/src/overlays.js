// Contacts of bodies and rays of sensors, as the newest overlay message has them.

import {
  BufferAttribute, BufferGeometry, Group, LineBasicMaterial, LineSegments, Points, PointsMaterial,
} from "three";

const CONTACTS_MAX = 4096;
const RAYS_MAX = 8192;

export class Overlays {
  constructor() {
    this.group = new Group();
    const points = new BufferGeometry();
    points.setAttribute("position", new BufferAttribute(new Float32Array(CONTACTS_MAX * 3), 3));
    this.contacts = new Points(points, new PointsMaterial({ color: "#e69f00", size: 9, sizeAttenuation: false, depthTest: false }));
    const lines = new BufferGeometry();
    lines.setAttribute("position", new BufferAttribute(new Float32Array(RAYS_MAX * 6), 3));
    this.rays = new LineSegments(lines, new LineBasicMaterial({ color: "#cc79a7", transparent: true, opacity: 0.7 }));
    for (const object of [this.contacts, this.rays]) {
      object.frustumCulled = false;
      object.geometry.setDrawRange(0, 0);
      this.group.add(object);
    }
    this.contacts.renderOrder = 2;
  }

  /** @param {Overlay | null} overlay @param {boolean} contacts @param {boolean} rays which of them are shown */
  draw(overlay, contacts, rays) {
    const points = (contacts && overlay?.contacts) || [];
    const lines = (rays && overlay?.rays) || [];
    const shownPoints = points.slice(0, CONTACTS_MAX);
    const shownLines = lines.slice(0, RAYS_MAX);
    put(this.contacts.geometry, shownPoints.flatMap(([x, y, z]) => [x, y, z]), shownPoints.length);
    put(this.rays.geometry, shownLines.flat(), shownLines.length * 2);
    return { contacts: shownPoints.length, rays: shownLines.length };
  }
}

/** @param {BufferGeometry} geometry @param {number[]} numbers @param {number} count */
function put(geometry, numbers, count) {
  const attribute = geometry.getAttribute("position");
  /** @type {Float32Array} */ (attribute.array).set(numbers);
  attribute.needsUpdate = true;
  geometry.setDrawRange(0, count);
}
