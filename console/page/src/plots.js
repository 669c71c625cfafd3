// Charts from data alone: lines and stacked bars over time, counts. They need no server and no scene: a report inlines them.

import uPlot from "uplot";
import { curveVariable } from "./colours.js";
import { lonely, stack } from "./series.js";
import { number } from "./text.js";
import { h, keyed, setText } from "./ui.js";

const FONT = "12px system-ui, sans-serif";

/** @param {string} name of a CSS variable, which is read when the chart draws: it follows the theme */
const variable = (name) => () => getComputedStyle(document.documentElement).getPropertyValue(name).trim() || "#888";

/**
 * @param {string} label
 * @param {(value: number) => string} text
 * @param {number} [size] px
 * @returns {uPlot.Axis}
 */
function axis(label, text, size) {
  return {
    stroke: variable("--text"),
    grid: { stroke: variable("--line"), width: 1 },
    ticks: { stroke: variable("--line"), width: 1 },
    font: FONT,
    labelFont: FONT,
    label,
    labelSize: 18,
    ...(size === undefined ? {} : { size }),
    values: (_, splits) => splits.map((value) => (value === null ? "" : text(value))),
  };
}

/** @param {number} value */
const plain = (value) => String(+value.toPrecision(6));

/**
 * @typedef {{from: number, to: number, colour: string, text: string}} Shade something that held meanwhile
 *
 * @typedef {object} ChartOptions
 * @property {string} [title]
 * @property {string} [unit] of the values
 * @property {string} [x] what the horizontal axis shows
 * @property {number} [height] px
 * @property {boolean} [stacked] bars, each series on those before it; all have the same points
 * @property {string[]} [colours] of the series, instead of the theme's
 * @property {Shade[]} [shades] behind the values
 * @property {number[]} [moments] where something happened: upright lines
 */

/** @param {uPlot} plot @param {ChartOptions} options */
function drawShades(plot, { shades = [] }) {
  const { ctx, bbox } = plot;
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.clip();
  ctx.globalAlpha = 0.22;
  for (const { from, to, colour } of shades) {
    const left = plot.valToPos(from, "x", true);
    ctx.fillStyle = colour;
    ctx.fillRect(left, bbox.top, Math.max(1, plot.valToPos(to, "x", true) - left), bbox.height);
  }
  ctx.restore();
}

/** @param {uPlot} plot @param {ChartOptions} options */
function drawMoments(plot, { moments = [] }) {
  const { ctx, bbox } = plot;
  ctx.save();
  ctx.strokeStyle = variable("--text")();
  ctx.setLineDash([5, 4]);
  ctx.beginPath();
  for (const at of moments) {
    const x = plot.valToPos(at, "x", true);
    if (x < bbox.left || x > bbox.left + bbox.width) continue;
    ctx.moveTo(x, bbox.top);
    ctx.lineTo(x, bbox.top + bbox.height);
  }
  ctx.stroke();
  ctx.restore();
}

/** A chart of lines that share a horizontal axis. It is as wide as its place. */
class LineChart {
  /** @param {HTMLElement} place @param {ChartOptions} options */
  constructor(place, options) {
    this.place = place;
    this.options = options;
    this.names = "";
    /** @type {uPlot | null} */
    this.plot = null;
    this.height = options.height ?? 180;
    /** @type {[number, number] | null} */
    this.range = null;
    this.onzoom = /** @type {((from: number, to: number) => void) | null} */ (null);
    this.observer = new ResizeObserver(() => this.resize());
    this.observer.observe(place);
  }

  /**
   * @param {Series[]} series points as they lie on the horizontal axis
   * @param {[number, number] | null} [range] of the horizontal axis; null: all
   */
  update(series, range = null) {
    const names = series.map(({ name, unit }) => `${name} ${unit}`).join("\n");
    const drawn = this.options.stacked ? stack(series) : series;
    const tables = drawn.map(({ points }) => /** @type {uPlot.AlignedData} */ ([points.map(([x]) => x), points.map(([, y]) => y)]));
    const data = tables.length ? uPlot.join(tables) : /** @type {uPlot.AlignedData} */ ([[]]);
    this.range = range;
    if (!this.plot || names !== this.names) {
      this.names = names;
      this._make(series, data);
    } else this.plot.setData(data);
    if (range) this.plot?.setScale("x", { min: range[0], max: range[1] });
  }

  /** @param {Series[]} series @param {uPlot.AlignedData} data */
  _make(series, data) {
    this.plot?.destroy();
    this.plot = new uPlot(
      {
        title: this.options.title,
        width: Math.max(120, this.place.clientWidth),
        height: this.height,
        scales: { x: { time: false }, y: { range: this.options.stacked ? fromZero : spread } },
        axes: [axis(this.options.x ?? "simulated time (s)", plain, 30), axis(this.options.unit ?? "", plain, 62)],
        series: [{ label: this.options.x ?? "s", value: (_, value) => this._when(value) }, ...this._lines(series)],
        legend: { markers: this._markers(series) },
        cursor: { drag: { x: true, y: false, setScale: !this.onzoom } },
        hooks: {
          setSelect: [(plot) => this._selected(plot)],
          drawClear: [(plot) => drawShades(plot, this.options)],
          draw: [(plot) => drawMoments(plot, this.options)],
        },
      },
      data,
      this.place,
    );
  }

  /** @param {Series[]} series @returns {uPlot.Series[]} */
  _lines(series) {
    const { stacked, colours } = this.options;
    const bars = stacked ? uPlot.paths.bars?.({ size: [0.9, 60] }) : undefined;
    const lines = series.map(({ name, unit, points, step }, index) => {
      const colour = colours?.[index] ?? variable(curveVariable(index));
      return {
        label: name,
        stroke: colour,
        fill: stacked ? colour : undefined,
        width: stacked ? 0 : 1.5,
        paths: step && !stacked ? uPlot.paths.stepped?.({ align: 1 }) : bars,
        dash: index >= 8 && !stacked ? [6, 4] : undefined,
        points: { show: !stacked, filter: (/** @type {uPlot} */ plot, /** @type {number} */ line) => lonely(plot.data[line]), size: 4 },
        value: (/** @type {uPlot} */ _, /** @type {number | null} */ value, /** @type {number} */ _line, /** @type {number | null} */ at) => {
          const own = stacked ? (at === null ? null : points[at]?.[1]) : value;
          return `${number(own, 4)} ${unit}`;
        },
      };
    });
    return stacked ? lines.reverse() : lines;
  }

  /**
   * The colours of names, which are made once: the browser keeps them the theme's.
   * @param {Series[]} series @returns {uPlot.Legend.Markers}
   */
  _markers(series) {
    const { stacked, colours } = this.options;
    const named = series.map((_, index) => colours?.[index] ?? `var(${curveVariable(index)})`);
    if (stacked) named.reverse();
    const colour = (/** @type {uPlot} */ _, /** @type {number} */ line) => named[line - 1] ?? "";
    return stacked ? { stroke: colour, fill: colour } : { stroke: colour };
  }

  /** The place of the cursor, and what held there. @param {number | null} x */
  _when(x) {
    if (x === null) return "–";
    const held = (this.options.shades ?? []).filter(({ from, to }) => from <= x && x < to).map(({ text }) => text);
    return [plain(x), ...held].join(" · ");
  }

  /** @param {uPlot} plot */
  _selected(plot) {
    if (!this.onzoom || plot.select.width < 4) return;
    const from = plot.posToVal(plot.select.left, "x");
    const to = plot.posToVal(plot.select.left + plot.select.width, "x");
    plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    this.onzoom(from, to);
  }

  resize() {
    const width = this.place.clientWidth;
    if (this.plot && width > 0 && width !== this.plot.width) this.plot.setSize({ width, height: this.height });
  }

  /** Draw again, after the theme changed. */
  redraw() {
    this.plot?.redraw(false, true);
  }

  destroy() {
    this.observer.disconnect();
    this.plot?.destroy();
    this.plot = null;
  }
}

/**
 * The range of the vertical axis: some room around the values, and around a constant one.
 * @param {uPlot} _
 * @param {number | null} low
 * @param {number | null} high
 * @returns {[number, number]}
 */
function spread(_, low, high) {
  if (low === null || high === null || !Number.isFinite(low) || !Number.isFinite(high)) return [0, 1];
  const room = high > low ? (high - low) * 0.08 : Math.max(Math.abs(high) * 0.1, 1e-3);
  return [low >= 0 && low < room * 4 ? 0 : low - room, high + room];
}

/**
 * The range of the vertical axis of bars.
 * @param {uPlot} _
 * @param {number | null} _low
 * @param {number | null} high
 * @returns {[number, number]}
 */
function fromZero(_, _low, high) {
  return [0, high ? high * 1.05 : 1];
}

/**
 * Lines over simulated time (s). @param {HTMLElement} place @param {ChartOptions} [options]
 */
export function timeChart(place, options = {}) {
  return new LineChart(place, options);
}

/**
 * Counts by name as bars, the greatest first.
 * @param {HTMLElement} place
 * @param {Record<string, number>} counts
 */
export function bars(place, counts) {
  const rows = Object.entries(counts).filter(([, count]) => count > 0).sort((a, b) => b[1] - a[1]);
  const most = rows[0]?.[1] ?? 1;
  place.classList.add("bars");
  keyed(
    place,
    rows,
    ([name]) => name,
    ([name]) => h("div", { class: "bar" }, h("span", {}, name), h("i", { "aria-hidden": "true" }), h("b")),
    (element, [, count]) => {
      /** @type {HTMLElement} */ (element.children[1]).style.setProperty("--share", String(count / most));
      setText(element.children[2], count.toLocaleString("en"));
    },
  );
}
