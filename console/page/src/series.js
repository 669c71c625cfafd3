// What a chart makes of its series before it draws them.

/**
 * Values without a neighbour: no line shows them, so they are drawn as points.
 * @param {ArrayLike<number | null | undefined>} values undefined where another series has a value
 */
export function lonely(values) {
  const found = [];
  let before = null;
  let candidate = -1;
  for (let index = 0; index < values.length; index += 1) {
    const value = values[index];
    if (value === undefined) continue;
    if (value === null && candidate >= 0) found.push(candidate);
    candidate = value !== null && before === null ? index : -1;
    before = value;
  }
  if (candidate >= 0) found.push(candidate);
  return found;
}

/**
 * Each series with those before it added, the highest first: what is drawn later covers the foot of what was drawn before.
 * @param {Series[]} series
 * @returns {Series[]}
 */
export function stack(series) {
  /** @type {number[]} */
  let below = [];
  const sums = series.map((one) => {
    const points = one.points.map(([x, y], index) => /** @type {[number, number]} */ ([x, (y ?? 0) + (below[index] ?? 0)]));
    below = points.map(([, y]) => y);
    return { ...one, points };
  });
  return sums.reverse();
}
