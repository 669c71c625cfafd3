// Charts from data alone: lines over time, distributions, bars. They need no server and no scene: a report inlines them.

import uPlot from "uplot";
import { paletteColour } from "./colours.js";
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
 * @typedef {object} ChartOptions
 * @property {string} [title]
 * @property {string} [unit] of the values
 * @property {string} [x] what the horizontal axis shows
 * @property {number} [height] px
 * @property {boolean} [step] values hold until the next one
 */

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
    const tables = series.map(({ points }) => /** @type {uPlot.AlignedData} */ ([points.map(([x]) => x), points.map(([, y]) => y)]));
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
    const paths = this.options.step ? uPlot.paths.stepped?.({ align: 1 }) : undefined;
    this.plot = new uPlot(
      {
        title: this.options.title,
        width: Math.max(120, this.place.clientWidth),
        height: this.height,
        scales: { x: { time: false }, y: { range: spread } },
        axes: [axis(this.options.x ?? "simulated time (s)", plain), axis(this.options.unit ?? "", plain, 62)],
        series: [
          { label: this.options.x ?? "s", value: (_, value) => (value === null ? "–" : plain(value)) },
          ...series.map(({ name, unit }, index) => ({
            label: name,
            stroke: paletteColour(index),
            width: 1.5,
            paths,
            dash: index >= 8 ? [6, 4] : undefined,
            points: { show: false },
            value: (/** @type {uPlot} */ _, /** @type {number | null} */ value) => `${number(value, 4)} ${unit}`,
          })),
        ],
        cursor: { drag: { x: true, y: false, setScale: !this.onzoom } },
        hooks: { setSelect: [(plot) => this._selected(plot)] },
      },
      data,
      this.place,
    );
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
 * Lines over simulated time (s). @param {HTMLElement} place @param {ChartOptions} [options]
 */
export function timeChart(place, options = {}) {
  return new LineChart(place, options);
}

/**
 * The share of values at or below each: a line for each sample.
 * @param {HTMLElement} place
 * @param {{name: string, unit: string, values: number[]}[]} samples
 * @param {ChartOptions} [options]
 */
export function distributionChart(place, samples, options = {}) {
  const unit = samples[0]?.unit ?? "";
  const chart = new LineChart(place, { step: true, unit: "share", x: unit, ...options });
  chart.update(samples.map(({ name, values }) => ({ name, unit: "", points: distribution(values) })));
  return chart;
}

/** @param {number[]} values @returns {[number, number][]} */
export function distribution(values) {
  const sorted = [...values].sort((a, b) => a - b);
  /** @type {[number, number][]} */
  const points = [];
  sorted.forEach((value, index) => {
    const share = (index + 1) / sorted.length;
    const last = points.at(-1);
    if (last && last[0] === value) last[1] = share;
    else points.push([value, share]);
  });
  return points;
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
