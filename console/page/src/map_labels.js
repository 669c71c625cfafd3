// Where names stand beside what they name, so that none covers another one.

export const LABEL_PX = 12;
/** The width of a letter, about (px). */
const LETTER_PX = 6.6;
const CELL_PX = 64;
/** Rings around a place on which there may be room for its name, the nearest first, and how far apart they are (px). */
const RINGS = 20;
const RING_PX = 15;
const TURNS = 8;

/** Boxes that are taken, found by the cells of a grid. */
class Taken {
  constructor() {
    /** @type {Map<string, Box[]>} */
    this.cells = new Map();
  }

  /** @param {Box} box @param {(cell: string) => void} each */
  _cells(box, each) {
    for (let column = Math.floor(box.left / CELL_PX); column <= Math.floor(box.right / CELL_PX); column += 1) {
      for (let row = Math.floor(box.top / CELL_PX); row <= Math.floor(box.foot / CELL_PX); row += 1) each(`${column} ${row}`);
    }
  }

  /** @param {Box} box */
  add(box) {
    this._cells(box, (cell) => this.cells.set(cell, [...(this.cells.get(cell) ?? []), box]));
  }

  /** @param {Box} box */
  holds(box) {
    let held = false;
    this._cells(box, (cell) => {
      held ||= (this.cells.get(cell) ?? []).some((one) => one.left < box.right && box.left < one.right && one.top < box.foot && box.top < one.foot);
    });
    return held;
  }
}

/**
 * @typedef {{left: number, right: number, top: number, foot: number}} Box
 * @typedef {{x: number, y: number, apart: boolean}} Label the middle of its foot (px), and whether a line should lead to it
 */

/** @param {number} x @param {number} y @param {number} width @returns {Box} */
const boxAt = (x, y, width) => ({ left: x - width / 2, right: x + width / 2, top: y - LABEL_PX, foot: y + 3 });

/**
 * Where a name may stand: above its place, below, beside it, and around it further and further away.
 * @param {{x: number, y: number}} place @param {number} width
 * @returns {Generator<Label>}
 */
function* around({ x, y }, width) {
  for (let ring = 0; ring < RINGS * RING_PX; ring += RING_PX) {
    const apart = ring > RING_PX;
    yield { x, y: y - 7 - ring, apart };
    yield { x, y: y + LABEL_PX + 5 + ring, apart };
    for (let turn = 0; turn < TURNS; turn += 1) {
      const angle = (2 * Math.PI * turn) / TURNS;
      yield { x: x + Math.cos(angle) * (width / 2 + 7 + ring), y: y + 4 + Math.sin(angle) * ring, apart };
    }
  }
}

/**
 * A place for each name, within the drawing; where there is no room, above what it names.
 * @param {{x: number, y: number, text: string}[]} places (px)
 * @param {{width: number, height: number}} room of the drawing (px)
 * @returns {Label[]}
 */
export function placeLabels(places, room) {
  const taken = new Taken();
  return places.map((place) => {
    const width = place.text.length * LETTER_PX;
    const inside = (/** @type {number} */ x) => Math.min(Math.max(x, width / 2 + 2), Math.max(width / 2 + 2, room.width - width / 2 - 2));
    /** @type {Label | null} */
    let first = null;
    for (const found of around(place, width)) {
      const label = { ...found, x: inside(found.x) };
      if (label.y < LABEL_PX + 2 || label.y > room.height - 4) continue;
      first ??= label;
      const box = boxAt(label.x, label.y, width);
      if (taken.holds(box)) continue;
      taken.add(box);
      return label;
    }
    return first ?? { x: inside(place.x), y: place.y, apart: false };
  });
}
