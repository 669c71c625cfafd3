// The world from above as a drawing, from data alone: scenery, bodies, paths, marks, a scale. A report inlines it, and the
// page shows it where the browser has no WebGL.

import { paletteColour } from "./colours.js";

const SVG = "http://www.w3.org/2000/svg";
const LABEL_PX = 12;

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
 *
 * @typedef {object} MapMark
 * @property {[number, number]} at (m)
 * @property {string} sign
 * @property {string} text
 *
 * @typedef {object} MapData
 * @property {[[number, number], [number, number]]} bounds the lowest and highest corner (m)
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

/**
 * Draw a map as wide as its place; what it had is replaced. Returns the drawing.
 * @param {HTMLElement} place
 * @param {MapData} data
 * @param {{width?: number, height?: number, selected?: string}} [options] px
 */
export function drawMap(place, data, options = {}) {
  const [[left, bottom], [right, top]] = data.bounds;
  const room = 0.06 * Math.max(right - left, top - bottom);
  const width_m = right - left + 2 * room;
  const height_m = top - bottom + 2 * room;
  const width = options.width ?? Math.max(160, place.clientWidth);
  const height = options.height ?? Math.round((width * height_m) / width_m) + 28;
  const px = Math.max(width_m / width, height_m / (height - 28));
  const world = svg("g", { transform: "scale(1 -1)" });
  world.append(...data.scenery.map((shape) => drawn(shape, px)));
  const names = svg("g", { "font-size": LABEL_PX * px, fill: "var(--text)", "paint-order": "stroke", stroke: "var(--sky)", "stroke-width": 3 * px });
  data.bodies.forEach((body, index) => {
    for (const piece of body.paths ?? []) {
      if (piece.length < 2) continue;
      const points = piece.map((point) => point.join(",")).join(" ");
      world.append(svg("polyline", { points, fill: "none", stroke: paletteColour(index), "stroke-width": 1.5 * px }));
    }
    world.append(...body.shapes.map((shape) => drawn(shape, px)));
    const look = { x: body.at[0], y: -body.at[1] - 7 * px, "text-anchor": "middle", ...(body.name === options.selected ? { "font-weight": 700 } : {}) };
    names.append(svg("text", look, [body.name]));
  });
  for (const mark of data.marks ?? []) {
    const sign = svg("text", { x: mark.at[0], y: -mark.at[1], "text-anchor": "middle" }, [mark.sign]);
    sign.append(svg("title", {}, [mark.text]));
    names.append(sign);
  }
  const length = scaleLength(width_m);
  const foot = -bottom + room + 14 * px;
  const bar = svg("path", { d: `M${left} ${foot - 4 * px}v${4 * px}h${length}v${-4 * px}`, fill: "none", stroke: "var(--text)", "stroke-width": 1.5 * px });
  const unit = svg("text", { x: left + length + 6 * px, y: foot, "font-size": LABEL_PX * px, fill: "var(--text)" }, [`${length} m`]);
  const box = `${left - room} ${-top - room} ${width_m} ${height_m + 28 * px}`;
  const title = svg("title", {}, ["The world from above"]);
  const drawing = svg("svg", { viewBox: box, width, height, role: "img", class: "map" }, [title, world, names, bar, unit]);
  place.replaceChildren(drawing);
  return drawing;
}
