/**
 * What every view on a canvas needs: its size in css pixels, round ticks, numbers with units, text and colours.
 *
 * Numbers are written as `zwidth.show.units` writes them, so that page, report and terminal say the same.
 */

/**
 * @typedef {object} Surface
 * @property {CanvasRenderingContext2D} context  scaled so that one unit is one css pixel
 * @property {number} width   of the canvas's box [css px]
 * @property {number} height  [css px]
 */

/**
 * Colours by what they are for; any value that a canvas takes.
 *
 * @typedef {object} Palette
 * @property {string} ink        text and lines
 * @property {string} grid       lines behind the data
 * @property {string} surface    what is drawn on
 * @property {string} grey       what stands back
 * @property {string} blue
 * @property {string} vermilion
 * @property {string} green
 * @property {string} purple
 * @property {string} orange
 */

/**
 * Which letters, and where.
 *
 * @typedef {object} TextStyle
 * @property {string} [colour]
 * @property {CanvasTextAlign} [align]        "left" where it is left out
 * @property {CanvasTextBaseline} [baseline]  "alphabetic" where it is left out
 * @property {number} [size]                  [css px], FONT_SIZE where it is left out
 * @property {string} [halo]                  colour round the letters, so that lines behind do not hide them
 * @property {number} [weight]                400 where it is left out
 */

export const FONT_SIZE = 12; // css px
const LINE_HEIGHT = 18; // css px
const SENTENCE_MARGIN = 24; // css px, to either side of a sentence
export const FAMILY = "system-ui, -apple-system, 'Segoe UI', Roboto, 'DejaVu Sans', sans-serif";
const HALO = 4; // css px, width of the line round letters
const MINUS = "\u2212";
const SPACE = "\u00a0";
const THIN = "\u2009";
const UNKNOWN = "\u2013";
const ROUNDING = 1e-9; // share of a step by which a tick may lie beyond the range
const MOST_DECIMALS = 12; // of tick labels

/** @type {Record<string, string>} Okabe and Ito (2008), where the page does not set a colour. */
const COLOURS = {
  ink: "#000000",
  grid: "#e4e4e4",
  surface: "#ffffff",
  grey: "#767676",
  blue: "#0072b2",
  vermilion: "#d55e00",
  green: "#009e73",
  purple: "#cc79a7",
  orange: "#e69f00",
};

/** @type {Record<number, string>} */
const PREFIXES = { "-9": "n", "-6": "µ", "-3": "m", 0: "", 3: "k", 6: "M", 9: "G" };
const ALL = Object.keys(PREFIXES).map(Number);
/** @type {Record<string, number[]>} Powers of ten that a unit takes; one that is not named takes none. */
const TAKES = {
  "N/m": [0, 3, 6],
  "N m/rad": [0, 3, 6],
  Hz: ALL,
  s: ALL,
  m: ALL,
  N: ALL,
  J: ALL,
};

/**
 * Give a canvas as many device pixels as its box covers, and clear it.
 *
 * @param {HTMLCanvasElement} canvas  sized by its style
 * @returns {Surface}
 */
export function fitCanvas(canvas) {
  const width = canvas.clientWidth;
  const height = canvas.clientHeight;
  const ratio = globalThis.devicePixelRatio || 1;
  const across = Math.max(1, Math.round(width * ratio));
  const down = Math.max(1, Math.round(height * ratio));
  if (canvas.width !== across || canvas.height !== down) {
    canvas.width = across;
    canvas.height = down;
  }
  const context = canvas.getContext("2d");
  if (context === null) throw new Error("this browser gives no two-dimensional canvas");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return { context, width, height };
}

/**
 * Step between ticks, 1, 2 or 5 times a power of ten, that divides a range into at most `count` parts.
 *
 * @param {number} range  positive
 * @param {number} count  at least 1
 * @returns {number}
 */
export function niceStep(range, count) {
  const rough = range / Math.max(count, 1);
  const power = 10 ** Math.floor(Math.log10(rough) + ROUNDING);
  const times = [1, 2, 5, 10].find((each) => each * power >= rough * (1 - ROUNDING));
  return (times ?? 10) * power;
}

/**
 * Round numbers from low to high, at most `count` + 1 of them; none of a range that is empty or not finite.
 *
 * @param {number} low
 * @param {number} high
 * @param {number} [count]
 * @returns {number[]}
 */
export function niceTicks(low, high, count = 5) {
  if (!(high > low) || !Number.isFinite(high - low)) return [];
  const step = niceStep(high - low, count);
  const first = Math.ceil(low / step - ROUNDING);
  const last = Math.floor(high / step + ROUNDING);
  const decimals = decimalsOf(step);
  return Array.from({ length: last - first + 1 }, (_, i) => Number(((first + i) * step).toFixed(decimals)));
}

/**
 * Ticks as text, all with as many decimals as their step needs.
 *
 * @param {number[]} ticks  evenly spaced
 * @param {number} [scale]  of the unit that they are written in: 1e3 for kN/m
 * @returns {string[]}
 */
export function tickLabels(ticks, scale = 1) {
  const step = ticks.length > 1 ? Math.abs(ticks[1] - ticks[0]) / scale : Math.abs(ticks[0] ?? 1) / scale || 1;
  const decimals = decimalsOf(step);
  return ticks.map((tick) => (tick / scale + 0).toFixed(decimals).replace("-", MINUS));
}

/**
 * Decimals with which multiples of a step are exact.
 *
 * @param {number} step  positive
 * @returns {number}
 */
function decimalsOf(step) {
  for (let decimals = 0; decimals < MOST_DECIMALS; decimals += 1) {
    const shifted = step * 10 ** decimals;
    if (Math.round(shifted) >= 1 && Math.abs(shifted - Math.round(shifted)) < 1e-6 * shifted) return decimals;
  }
  return MOST_DECIMALS;
}

/**
 * Unit of an axis and what its numbers are divided by: {unit: "kN/m", scale: 1000} up to 8000 N/m.
 *
 * @param {number} low
 * @param {number} high
 * @param {string} unit
 * @returns {{unit: string, scale: number}}
 */
export function axisUnit(low, high, unit) {
  const exponent = exponentOf(Math.max(Math.abs(low), Math.abs(high)), unit);
  return { unit: `${PREFIXES[exponent]}${unit}`, scale: 10 ** exponent };
}

/**
 * Power of ten, a multiple of 3, of the prefix with which a value of this unit is written.
 *
 * @param {number} value
 * @param {string} unit
 * @returns {number}
 */
function exponentOf(value, unit) {
  if (value === 0 || !Number.isFinite(value)) return 0;
  const power = 3 * Math.floor(Math.log10(Math.abs(value)) / 3 + 1e-12);
  const exponent = Math.min(Math.max(power, -9), 9);
  return (TAKES[unit] ?? []).includes(exponent) ? exponent : 0;
}

/**
 * A number in so many digits, as a power of ten where it is very large or small; a dash where it is not known.
 *
 * @param {number | null | undefined} value
 * @param {number} [digits]
 * @returns {string}
 */
export function number(value, digits = 4) {
  if (value === null || value === undefined || Number.isNaN(value)) return UNKNOWN;
  if (!Number.isFinite(value)) return value > 0 ? "∞" : `${MINUS}∞`;
  if (value === 0) return "0";
  const [mantissa, power] = value.toExponential(digits - 1).split("e");
  const magnitude = Number(power);
  if (magnitude >= -4 && magnitude < Math.max(digits, 4)) {
    return Number(`${mantissa}e${power}`).toFixed(Math.max(digits - 1 - magnitude, 0)).replace("-", MINUS);
  }
  return `${mantissa.replace("-", MINUS)}${THIN}×${THIN}10${raised(magnitude)}`;
}

/**
 * A value with its unit and the prefix that suits it: "7.849 kN/m"; a dash where it is not known.
 *
 * @param {number | null | undefined} value
 * @param {string} unit
 * @param {number} [digits]
 * @returns {string}
 */
export function quantity(value, unit, digits = 4) {
  if (value === null || value === undefined || Number.isNaN(value)) return UNKNOWN;
  if (!Number.isFinite(value)) return `${number(value)}${SPACE}${unit}`.trim();
  const rounded = Number(value.toExponential(digits - 1)); // so that 999.996 becomes 1.000 k, not 1000
  const exponent = exponentOf(rounded, unit);
  return `${number(rounded / 10 ** exponent, digits)}${SPACE}${PREFIXES[exponent]}${unit.replaceAll(" ", SPACE)}`.trim();
}

/**
 * @param {number} power
 * @returns {string}
 */
function raised(power) {
  return String(power).replace(/[-0-9]/g, (sign) => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(sign)]);
}

/**
 * The page's colours, read anew so that they follow a change to dark mode.
 *
 * @param {Element} element  whose style has --ink, --grid, --surface, --grey, --blue, --vermilion, --green, ...
 * @returns {Palette}
 */
export function palette(element) {
  const style = getComputedStyle(element);
  const entries = Object.entries(COLOURS).map(([name, otherwise]) => {
    return [name, style.getPropertyValue(`--${name}`).trim() || otherwise];
  });
  return /** @type {Palette} */ (Object.fromEntries(entries));
}

/**
 * Letters for a context's `font`.
 *
 * @param {number} [size]    [css px]
 * @param {number} [weight]
 * @returns {string}
 */
export function font(size = FONT_SIZE, weight = 400) {
  return `${weight} ${size}px ${FAMILY}`;
}

/**
 * Write a line of text.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {string} line
 * @param {number} x
 * @param {number} y
 * @param {TextStyle} [style]
 */
export function drawText(context, line, x, y, style = {}) {
  context.save();
  context.font = font(style.size, style.weight);
  context.textAlign = style.align ?? "left";
  context.textBaseline = style.baseline ?? "alphabetic";
  if (style.halo !== undefined) {
    context.strokeStyle = style.halo;
    context.lineWidth = HALO;
    context.lineJoin = "round";
    context.strokeText(line, x, y);
  }
  if (style.colour !== undefined) context.fillStyle = style.colour;
  context.fillText(line, x, y);
  context.restore();
}

/**
 * A text in lines, broken between its words.
 *
 * @param {string} text
 * @param {(line: string) => boolean} fits  whether a line is short enough; a word alone may be longer
 * @returns {string[]}
 */
export function inLines(text, fits) {
  /** @type {string[]} */
  const lines = [];
  for (const word of text.split(" ")) {
    const longer = `${lines.at(-1)} ${word}`;
    if (lines.length && fits(longer)) lines[lines.length - 1] = longer;
    else lines.push(word);
  }
  return lines;
}

/**
 * Write a sentence in the middle of a canvas, in as many lines as it takes.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {string} sentence
 * @param {number} width   of the canvas [css px]
 * @param {number} height
 * @param {string} colour
 */
export function drawSentence(context, sentence, width, height, colour) {
  const lines = inLines(sentence, (line) => textWidth(context, line) < width - 2 * SENTENCE_MARGIN);
  const top = height / 2 - (LINE_HEIGHT * (lines.length - 1)) / 2;
  lines.forEach((line, n) => drawText(context, line, width / 2, top + LINE_HEIGHT * n, { align: "center", baseline: "middle", colour }));
}

/**
 * Width of a line of text [css px].
 *
 * @param {CanvasRenderingContext2D} context
 * @param {string} line
 * @param {TextStyle} [style]
 * @returns {number}
 */
export function textWidth(context, line, style = {}) {
  context.save();
  context.font = font(style.size, style.weight);
  const { width } = context.measureText(line);
  context.restore();
  return width;
}
