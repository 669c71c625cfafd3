// Numbers as people read them.

/** @param {number | null | undefined} value @param {number} [digits] */
export function number(value, digits = 3) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  if (Math.abs(value) >= 1e6 || Math.abs(value) < 1e-4) return value.toExponential(2);
  return value.toFixed(Math.max(0, Math.min(6, digits - Math.max(0, Math.floor(Math.log10(Math.abs(value)))))));
}

/** @param {number | null | undefined} value */
export function whole(value) {
  return value === null || value === undefined ? "–" : Math.round(value).toLocaleString("en");
}

/** @param {number | null | undefined} value a share @param {number} [digits] */
export function percent(value, digits = 1) {
  return value === null || value === undefined ? "–" : `${(value * 100).toFixed(value === 0 || value === 1 ? 0 : digits)} %`;
}

/** @param {number | null | undefined} value */
export function milliseconds(value) {
  return value === null || value === undefined ? "–" : `${number(value, 2)} ms`;
}

/**
 * Simulated time, to the millisecond: `12.345 s`, `2:03.450`, `1:02:03.450`.
 * @param {number} seconds
 */
export function time(seconds) {
  if (!Number.isFinite(seconds)) return "–";
  const sign = seconds < 0 ? "-" : "";
  const all = Math.round(Math.abs(seconds) * 1000) / 1000;
  if (all < 60) return `${sign}${all.toFixed(3)} s`;
  const minutes = Math.floor(all / 60);
  const rest = (all - minutes * 60).toFixed(3).padStart(6, "0");
  return minutes < 60
    ? `${sign}${minutes}:${rest}`
    : `${sign}${Math.floor(minutes / 60)}:${String(minutes % 60).padStart(2, "0")}:${rest}`;
}

/**
 * Round numbers between two, about so many, a step of 1, 2 or 5 times a power of ten apart.
 * @param {number} low @param {number} high @param {number} count
 * @returns {number[]}
 */
export function ticks(low, high, count) {
  if (!(high > low)) return [low];
  const rough = (high - low) / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = ([1, 2, 5].find((digit) => digit * power >= rough) ?? 10) * power;
  const found = [];
  for (let number = Math.ceil(low / step); number * step <= high * (1 + 1e-12); number += 1) found.push(+(number * step).toPrecision(12));
  return found;
}

/** @param {Record<string, number>} causes */
export function causesText(causes) {
  return Object.entries(causes)
    .filter(([, count]) => count > 0)
    .sort((a, b) => b[1] - a[1])
    .map(([cause, count]) => `${cause} ${count}`)
    .join(", ");
}

/** @param {number} count @param {string} what @param {string} [many] its plural */
export function counted(count, what, many = `${what}s`) {
  return `${count.toLocaleString("en")} ${count === 1 ? what : many}`;
}

/**
 * The value at a dotted path in a status: `lag_ms.p99`, `nodes.red.solved_ticks`; names with dots match as a whole.
 * @param {any} from
 * @param {string} path
 * @returns {number | null}
 */
export function valueAt(from, path) {
  if (typeof from === "number") return path === "" ? from : null;
  if (from === null || typeof from !== "object") return null;
  for (const [key, value] of Object.entries(from)) {
    if (path === key) return typeof value === "number" ? value : null;
    if (path.startsWith(`${key}.`)) {
      const found = valueAt(value, path.slice(key.length + 1));
      if (found !== null) return found;
    }
  }
  return null;
}

/**
 * The dotted paths of all numbers in a status, lists left out.
 * @param {any} from
 * @param {string} [prefix]
 * @returns {string[]}
 */
export function numberPaths(from, prefix = "") {
  if (typeof from === "number") return [prefix.slice(0, -1)];
  if (from === null || typeof from !== "object" || Array.isArray(from)) return [];
  return Object.entries(from).flatMap(([key, value]) => numberPaths(value, `${prefix}${key}.`));
}
