// The last points of one line, in order of their ticks, bounded; what a chart shows of them has at most a few a pixel.

export class Ring {
  /** @param {number} [size] points that are kept */
  constructor(size = 60_000) {
    this.size = size;
    /** @type {number[]} */
    this.ticks = [];
    /** @type {(number | null)[]} */
    this.values = [];
  }

  /** Add a point. Where time went back, what was later is forgotten. @param {number} tick @param {number | null} value */
  push(tick, value) {
    const last = this.ticks.length - 1;
    if (last >= 0 && tick <= this.ticks[last]) {
      if (tick === this.ticks[last]) {
        this.values[last] = value;
        return;
      }
      this.cut(this.from(tick));
    }
    this.ticks.push(tick);
    this.values.push(value);
    // A quarter at once: to drop the first of an array for each point would cost its length.
    if (this.ticks.length > this.size * 1.25) {
      const excess = this.ticks.length - this.size;
      this.ticks.splice(0, excess);
      this.values.splice(0, excess);
    }
  }

  /** Add points, also earlier ones: a history that came later. @param {[number, number | null][]} points */
  merge(points) {
    if (!points.length) return;
    const last = this.ticks.at(-1) ?? -Infinity;
    if (points[0][0] > last) {
      for (const [tick, value] of points) this.push(tick, value);
      return;
    }
    const all = new Map(this.ticks.map((tick, index) => [tick, this.values[index]]));
    for (const [tick, value] of points) all.set(tick, value);
    const sorted = [...all].sort((a, b) => a[0] - b[0]).slice(-this.size);
    this.ticks = sorted.map(([tick]) => tick);
    this.values = sorted.map(([, value]) => value);
  }

  /** @param {number} length */
  cut(length) {
    this.ticks.length = length;
    this.values.length = length;
  }

  /** The index of the first point at a tick or behind it. @param {number} tick */
  from(tick) {
    let low = 0;
    let high = this.ticks.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.ticks[middle] < tick) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  /**
   * The points between two ticks, the least and the greatest of each of `columns` parts where there are more.
   * @param {number} first
   * @param {number} last
   * @param {number} columns
   * @returns {[number, number | null][]}
   */
  window(first, last, columns) {
    const start = Math.max(0, this.from(first) - 1);
    const end = Math.min(this.ticks.length, this.from(last) + 1);
    /** @type {[number, number | null][]} */
    const points = [];
    const stride = Math.max(1, Math.ceil((end - start) / columns));
    for (let index = start; index < end; index += stride) {
      const stop = Math.min(end, index + stride);
      let least = index;
      let most = index;
      for (let at = index + 1; at < stop; at += 1) {
        const value = this.values[at];
        if (value === null) continue;
        if (value < (this.values[least] ?? Infinity)) least = at;
        if (value > (this.values[most] ?? -Infinity)) most = at;
      }
      for (const at of least === most ? [least] : [Math.min(least, most), Math.max(least, most)]) {
        points.push([this.ticks[at], this.values[at]]);
      }
    }
    return points;
  }
}
