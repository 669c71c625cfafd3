// Colours that people with any kind of colour vision tell apart: the palette of Okabe and Ito, and a scale for loss that
// goes from blue by yellow to vermilion, whose lightness and hue both differ.

/** Okabe and Ito, without black; the order keeps neighbours far apart. */
export const PALETTE = ["#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#f0e442", "#8c8c8c"];

/** @param {number} index */
export function paletteColour(index) {
  return PALETTE[index % PALETTE.length];
}

const CURVES = 8;

/** The CSS variable with the colour of a curve, which follows the theme. @param {number} index */
export function curveVariable(index) {
  return `--curve-${index % CURVES}`;
}

/**
 * The colour of each name, by its place among all of them.
 * @param {string[]} names
 * @returns {Map<string, string>}
 */
export function coloursOf(names) {
  return new Map([...names].sort().map((name, index) => [name, paletteColour(index)]));
}

/** @type {[number, Vec3][]} */
const LOSS = [
  [0, [0.0, 0.447, 0.698]],
  [0.05, [0.337, 0.706, 0.914]],
  [0.2, [0.941, 0.894, 0.259]],
  [0.5, [0.902, 0.624, 0.0]],
  [1, [0.835, 0.369, 0.0]],
];

/**
 * The colour of a share of packets that are lost, as red, green, blue in 0..1.
 * @param {number} loss
 * @returns {Vec3}
 */
export function lossColour(loss) {
  const share = Math.max(0, Math.min(1, loss));
  for (let index = 1; index < LOSS.length; index += 1) {
    const [high, above] = LOSS[index];
    if (share > high) continue;
    const [low, below] = LOSS[index - 1];
    const part = (share - low) / (high - low);
    const between = (/** @type {0 | 1 | 2} */ axis) => below[axis] + (above[axis] - below[axis]) * part;
    return [between(0), between(1), between(2)];
  }
  return LOSS[LOSS.length - 1][1];
}

/** @param {Vec3} colour */
export function css([red, green, blue]) {
  return `rgb(${Math.round(red * 255)} ${Math.round(green * 255)} ${Math.round(blue * 255)})`;
}

/** The scale as a CSS gradient. Its stops are those of the scale, drawn by the root of loss, since small losses matter. */
export function lossGradient() {
  return `linear-gradient(to right, ${LOSS.map(([at, colour]) => `${css(colour)} ${Math.sqrt(at) * 100}%`).join(", ")})`;
}

/** Colour and sign of each kind of mark: nobody has to tell them by colour alone. */
export const MARKS = /** @type {Record<string, {colour: string, sign: string, text: string}>} */ ({
  event: { colour: "#56b4e9", sign: "◆", text: "events" },
  down: { colour: "#d55e00", sign: "▼", text: "out of service" },
  quarantine: { colour: "#cc79a7", sign: "□", text: "quarantine" },
  recovery: { colour: "#cc79a7", sign: "▲", text: "recoveries" },
  epoch: { colour: "#cc79a7", sign: "△", text: "epochs" },
  drops: { colour: "#d55e00", sign: "✕", text: "drops" },
  request: { colour: "#009e73", sign: "●", text: "requests" },
  network: { colour: "#009e73", sign: "◉", text: "network" },
  add: { colour: "#009e73", sign: "+", text: "additions" },
  remove: { colour: "#009e73", sign: "−", text: "removals" },
  push: { colour: "#009e73", sign: "➤", text: "pushes" },
  move: { colour: "#009e73", sign: "⇄", text: "moves" },
});

/** How marks look whose kinds the rules of a world bring. */
const LOOKS = /** @type {Record<string, {colour: string, sign: string}>} */ ({
  score: { colour: "#e69f00", sign: "★" },
  start: { colour: "#56b4e9", sign: "○" },
  away: { colour: "#56b4e9", sign: "◇" },
  rest: { colour: "#56b4e9", sign: "–" },
  lost: { colour: "#d55e00", sign: "▽" },
});

/** @param {string | null | undefined} look */
export function lookStyle(look) {
  return look ? LOOKS[look] : undefined;
}

/**
 * Colour, sign and name of a kind of marks; `ofRules` are those that the scene brings.
 * @param {string} kind
 * @param {Record<string, SceneMark>} [ofRules]
 */
export function markStyle(kind, ofRules) {
  const own = ofRules?.[kind];
  const look = lookStyle(own?.look);
  if (own && look) return { ...look, text: own.text };
  return MARKS[kind] ?? { colour: "#8c8c8c", sign: "■", text: own?.text ?? kind };
}
