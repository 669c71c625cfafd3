// The world from above as a drawing, from data alone: scenery, bodies, paths, marks, a scale. A report inlines it, and the
// page shows it where the browser has no WebGL.

import { paletteColour } from "./colours.js";
import { LABEL_PX, placeLabels } from "./map_labels.js";

const SVG = "http://www.w3.org/2000/svg";
/** Below the field, for its scale (px). */
const FOOT = 28;
const MAX_HEIGHT = 900;
const MARK_PX = 9;
/** What lies beyond the field stands so far from the edge (px). */
const EDGE = 10;

/**
 * @typedef {object} MapShape
 * @property {"box" | "circle" | "polygon"} kind
 * @property {[number, number]} at its centre (m)
 * @property {number} [turn] about the vertical (rad)
 * @property {[number, number]} [half] of a box (m)
 * @property {number} [radius] of a circle (m)
 * @property {[number, number][]} [points] of a polygon (m), about its centre
 * @property {string} colour
 *
 * @typedef {object} MapBody
 * @property {string} name
 * @property {[number, number]} at (m)
 * @property {MapShape[]} shapes
 * @property {[number, number][][]} [paths] pieces of its way (m): no line joins two of them
 * @property {string} [note] stands behind its name
 *
 * @typedef {object} MapMark
 * @property {[number, number]} at (m)
 * @property {string} sign
 * @property {string} text
 * @property {string} [colour]
 *
 * @typedef {object} MapData
 * @property {[[number, number], [number, number]]} bounds the lowest and highest corner (m); what lies beyond stands at the edge
 * @property {MapShape[]} scenery
 * @property {MapBody[]} bodies
 * @property {MapMark[]} [marks]
 */

/**
 * @template {keyof SVGElementTagNameMap} K
 * @param {K} tag
 * @param {Record<string, string | number>} attributes
 * @param {(SVGElement | string)[]} [children]
 */
function svg(tag, attributes, children = []) {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, String(value));
  element.append(...children);
  return element;
}

/** The length of a scale bar: 1, 2 or 5 times a power of ten, about a fifth of the field. @param {number} width m */
export function scaleLength(width) {
  const rough = width / 5;
  const power = 10 ** Math.floor(Math.log10(rough));
  return [5, 2, 1].map((digit) => digit * power).find((length) => length <= rough) ?? power;
}

/** @param {MapShape} shape @param {number} px metres a pixel @returns {SVGElement} */
function drawn(shape, px) {
  const place = `translate(${shape.at[0]} ${shape.at[1]}) rotate(${((shape.turn ?? 0) * 180) / Math.PI})`;
  const look = { fill: shape.colour, stroke: "var(--text)", "stroke-width": px * 0.6, "stroke-opacity": 0.5 };
  if (shape.kind === "circle") return svg("circle", { r: shape.radius ?? 0, transform: place, ...look });
  if (shape.kind === "polygon") {
    return svg("polygon", { points: (shape.points ?? []).map((point) => point.join(",")).join(" "), transform: place, ...look });
  }
  const [x, y] = shape.half ?? [0, 0];
  return svg("rect", { x: -x, y: -y, width: 2 * x, height: 2 * y, transform: place, ...look });
}

/** Where a drawing shows what: metres on the one side, pixels on the other. */
class Plan {
  /** @param {[[number, number], [number, number]]} bounds @param {number} width @param {number | undefined} height px */
  constructor([[left, bottom], [right, top]], width, height) {
    const room = Math.max(0.06 * Math.max(right - left, top - bottom), 1e-6);
    this.left = left - room;
    this.top = top + room;
    this.width_m = right - left + 2 * room;
    this.height_m = top - bottom + 2 * room;
    this.width = width;
    this.height = height ?? Math.min(MAX_HEIGHT, Math.round((width * this.height_m) / this.width_m)) + FOOT;
    /** Metres a pixel. */
    this.px = Math.max(this.width_m / width, this.height_m / Math.max(1, this.height - FOOT));
  }

  /** The pixel of a place; a place beyond the edge has the nearest one. @param {[number, number]} at */
  pixel([x, y]) {
    const [px, py] = [(x - this.left) / this.px, (this.top - y) / this.px];
    const [right, foot] = [this.width_m / this.px - EDGE, this.height_m / this.px - EDGE];
    const [inX, inY] = [Math.min(right, Math.max(EDGE, px)), Math.min(foot, Math.max(EDGE, py))];
    const [byX, byY] = [px - inX, py - inY];
    const out = Math.abs(byX) > Math.abs(byY) ? (byX < 0 ? "◀" : "▶") : byY < 0 ? "▲" : "▼";
    return { x: inX, y: inY, out: byX || byY ? out : "" };
  }

  /** The coordinates in the drawing of a pixel: metres, y downwards. @param {number} x @param {number} y */
  drawn(x, y) {
    return { x: this.left + x * this.px, y: -this.top + y * this.px };
  }
}

/** @param {Plan} plan @param {MapBody} body @param {string} colour @returns {SVGElement[]} */
function way(plan, body, colour) {
  const pieces = (body.paths ?? []).filter((piece) => piece.length > 1);
  return pieces.map((piece) => {
    const points = piece.map((point) => point.join(",")).join(" ");
    return svg("polyline", { points, class: "way", fill: "none", stroke: colour, "stroke-width": 1.5 * plan.px });
  });
}

/** @param {Plan} plan @param {MapMark} mark */
function drawnMark(plan, mark) {
  const { x, y } = plan.pixel(mark.at);
  const look = { ...plan.drawn(x, y + 3), class: "mark", "text-anchor": "middle", fill: mark.colour ?? "var(--text)" };
  return svg("text", look, [svg("title", {}, [mark.text]), mark.sign]);
}

/**
 * The names of all bodies, none on another one where there is room: a line leads from a name that stands further off.
 * @param {Plan} plan @param {MapBody[]} bodies @param {string} [selected]
 */
function named(plan, bodies, selected) {
  const places = bodies.map((body) => {
    const { x, y, out } = plan.pixel(body.at);
    const far = out ? `${out} ${body.at.map((part) => Number(part.toPrecision(4))).join(", ")} m` : "";
    return { x, y, text: [body.name, far, body.note ?? ""].filter(Boolean).join(" ") };
  });
  const room = { width: plan.width_m / plan.px, height: plan.height_m / plan.px };
  return placeLabels(places, room).flatMap((label, index) => {
    const [from, to] = [plan.drawn(places[index].x, places[index].y), plan.drawn(label.x, label.y)];
    const weight = bodies[index].name === selected ? 700 : 400;
    const text = svg("text", { ...to, class: "name", "text-anchor": "middle", "font-weight": weight }, [places[index].text]);
    if (!label.apart) return [text];
    const line = { x1: from.x, y1: from.y, x2: to.x, y2: to.y - 4 * plan.px, stroke: "var(--muted)", "stroke-width": 0.8 * plan.px };
    return [svg("line", line), text];
  });
}

/** A scale below the field. @param {Plan} plan */
function scale(plan) {
  const length = scaleLength(plan.width_m);
  const start = plan.drawn(EDGE, plan.height_m / plan.px + 14);
  const tick = 4 * plan.px;
  const d = `M${start.x} ${start.y - tick}v${tick}h${length}v${-tick}`;
  const look = { x: start.x + length + 6 * plan.px, y: start.y, "font-size": LABEL_PX * plan.px, fill: "var(--text)" };
  return [svg("path", { d, fill: "none", stroke: "var(--text)", "stroke-width": 1.5 * plan.px }), svg("text", look, [`${Number(length.toPrecision(3))} m`])];
}

/**
 * Draw a map as wide as its place; what it had is replaced. Returns the drawing.
 * @param {HTMLElement} place
 * @param {MapData} data
 * @param {{width?: number, height?: number, selected?: string}} [options] px
 */
export function drawMap(place, data, options = {}) {
  const plan = new Plan(data.bounds, options.width ?? Math.max(160, place.clientWidth), options.height);
  const upright = { transform: "scale(1 -1)" };
  const ground = svg("g", upright, data.scenery.map((shape) => drawn(shape, plan.px)));
  ground.append(...data.bodies.flatMap((body, index) => way(plan, body, paletteColour(index))));
  const halo = { "paint-order": "stroke", stroke: "var(--sky)" };
  const lost = { "font-size": MARK_PX * plan.px, "stroke-width": plan.px, ...halo };
  const marks = svg("g", lost, (data.marks ?? []).map((mark) => drawnMark(plan, mark)));
  const bodies = svg("g", upright, data.bodies.flatMap((body) => body.shapes.map((shape) => drawn(shape, plan.px))));
  const look = { "font-size": LABEL_PX * plan.px, fill: "var(--text)", "stroke-width": 3 * plan.px, ...halo };
  const names = svg("g", look, named(plan, data.bodies, options.selected));
  const box = `${plan.left} ${-plan.top} ${plan.width_m} ${plan.height_m + FOOT * plan.px}`;
  const title = svg("title", {}, ["The world from above"]);
  const drawing = svg("svg", { viewBox: box, width: plan.width, height: plan.height, role: "img", class: "map" }, [title, ground, bodies, marks, names, ...scale(plan)]);
  place.replaceChildren(drawing);
  return drawing;
}
