/** What lies around a mechanism: the map of a measure and a grid of a planar one, axes and a length of a spatial one. */

import { axisUnit, niceStep, niceTicks, quantity, textWidth, tickLabels } from "./canvas.js";
import { arrow, line } from "./mechanism_drawing.js";

/** @typedef {import("./device_view.js").DeviceView} DeviceView */
/**
 * A measure over a plane.
 *
 * @typedef {object} Grid
 * @property {Float64Array} x        coordinates of the columns along `first` [m]
 * @property {Float64Array} y        of the rows along `second` [m]
 * @property {Float64Array} values   row by row; NaN: not known there
 * @property {Float64Array} first    unit vector in the plane;   second, another;   through  where both coordinates are 0
 * @property {Float64Array} second
 * @property {Float64Array} through
 * @property {string} unit
 * @property {string} name
 */

const OUTSIDE = 0.05; // share of the cells at each end of a map that have the colour of the end
// Of a map, dark to light: cividis, told apart with any colour vision.
const SHADES = [[0, 34, 78], [53, 69, 108], [102, 105, 112], [148, 142, 119], [200, 184, 102], [254, 232, 56]];
const AROUND = [[0, 0], [1, 0], [1, 1], [0, 1]]; // the corners of a cell
const AXIS = 26; // css px, of the axes beside a spatial device
const SEEN = 0.15; // share of its length that is seen of an axis with an arrow; another one points at the eye, or away
const KEY = { width: 150, height: 48 }; // css px, of a map's key in the upper right corner

/** The values to which a map's colours go, and whether there are others; null where none is known. @param {Grid} map */
function rangeOf({ values }) {
  const known = values.filter((value) => Number.isFinite(value)).sort();
  if (!known.length) return null;
  // colours for nine cells of ten: near a singular posture single cells are thousands of times the others
  const [low, high] = [known[Math.floor(OUTSIDE * known.length)], known[Math.ceil((1 - OUTSIDE) * known.length) - 1]];
  return { low, high, below: low > known[0], above: high < known[known.length - 1] };
}

/** A place of a map's plane in the base frame [m]. @param {Grid} map @param {number} x @param {number} y */
export function placeOf({ first, second, through }, x, y) {
  return [0, 1, 2].map((k) => through[k] + x * first[k] + y * second[k]);
}

/** @param {CanvasRenderingContext2D} context @param {DeviceView} view @param {Grid} map */
export function drawMap(context, view, map) {
  const range = rangeOf(map);
  if (!range) return;
  const { low, high } = range;
  const { x, y, values } = map;
  const [dx, dy] = [x[1] - x[0], y[1] - y[0]];
  // cells share their corners, whole pixels, and are drawn without gaps on a canvas of their own, which is then laid
  // under the device as a whole: where two transparent cells touched or overlapped a line would be seen
  const own = new OffscreenCanvas(context.canvas.width, context.canvas.height);
  const cells = /** @type {OffscreenCanvasRenderingContext2D} */ (own.getContext("2d"));
  cells.setTransform(context.getTransform());
  const corner = (/** @type {number} */ across, /** @type {number} */ up) => {
    const at = view.place(placeOf(map, x[0] + (across - 0.5) * dx, y[0] + (up - 0.5) * dy));
    return [Math.round(at.x), Math.round(at.y)];
  };
  for (let row = 0; row < y.length; row++) {
    for (let column = 0; column < x.length; column++) {
      const value = values[row * x.length + column];
      if (!Number.isFinite(value)) continue;
      cells.fillStyle = shade(high > low ? (value - low) / (high - low) : 0.5);
      cells.strokeStyle = cells.fillStyle;
      cells.beginPath();
      for (const [across, up] of AROUND) {
        const [px, py] = corner(column + across, row + up);
        cells.lineTo(px, py);
      }
      cells.closePath();
      cells.fill();
      cells.stroke();
    }
  }
  context.save();
  context.globalAlpha = 0.75;
  context.resetTransform();
  context.drawImage(own, 0, 0);
  context.restore();
}

/** What a map's colours mean; how far down it goes [css px]. @param {CanvasRenderingContext2D} context @param {DeviceView} view @param {Grid} map @param {number} width @param {any} colours */
export function drawKey(context, view, map, width, colours) {
  const range = rangeOf(map);
  if (!range) return 0;
  const low = `${range.below ? "≤ " : ""}${quantity(range.low, map.unit, 3)}`;
  const high = `${range.above ? "≥ " : ""}${quantity(range.high, map.unit, 3)}`;
  const length = Math.max(KEY.width, textWidth(context, low) + textWidth(context, high) + 12, textWidth(context, map.name));
  const left = width - length - 8;
  context.fillStyle = colours.surface;
  context.globalAlpha = 0.85;
  context.fillRect(left - 6, 2, length + 12, KEY.height);
  context.globalAlpha = 1;
  for (let k = 0; k < length; k++) {
    context.fillStyle = shade(k / length);
    context.fillRect(left + k, 20, 1.5, 9);
  }
  view.labels.write(map.name, left, 15, { colour: colours.ink });
  view.labels.write(low, left, 43, { colour: colours.ink });
  view.labels.write(high, left + length, 43, { align: "right", colour: colours.ink });
  return KEY.height;
}

/** Grid lines of the plane, and where the number of each goes. @param {CanvasRenderingContext2D} context @param {DeviceView} view @param {number} width @param {number} height @param {any} colours */
function drawGrid(context, view, width, height, colours) {
  const [across, up] = view.scene.flat.map((/** @type {number} */ k, /** @type {number} */ n) => {
    const size = n ? height : width;
    const [low, high] = [view.middle[k] - size / 2 / view.scale, view.middle[k] + size / 2 / view.scale];
    return { k, low, high, ticks: niceTicks(low, high, Math.max(3, Math.floor(size / 80))) };
  });
  const axis = axisUnit(across.low, across.high, "m");
  context.strokeStyle = colours.grid;
  context.lineWidth = 1;
  context.globalAlpha = view.map ? 0.35 : 1;
  context.beginPath();
  const numbers = [across, up].flatMap(({ k, ticks }) => {
    const texts = tickLabels(ticks, axis.scale);
    return ticks.map((/** @type {number} */ tick, /** @type {number} */ t) => {
      const { x, y } = view.place(view.middle.map((value, n) => (n === k ? tick : value)));
      if (k === up.k) line(context, { x: 0, y: Math.round(y) + 0.5 }, { x: width, y: Math.round(y) + 0.5 });
      else line(context, { x: Math.round(x) + 0.5, y: 0 }, { x: Math.round(x) + 0.5, y: height });
      return { text: texts[t], ...(k === up.k ? { x: 4, y: y - 3 } : { x: x + 3, y: height - 5 }) };
    });
  });
  context.stroke();
  context.globalAlpha = 1;
  return { across: `${"xyz"[across.k]} → [${axis.unit}]`, up: `↑ ${"xyz"[up.k]} [${axis.unit}]`, numbers };
}

/** The grid behind a planar device. @param {CanvasRenderingContext2D} context @param {DeviceView} view @param {number} width @param {number} height @param {any} colours */
export function drawPlane(context, view, width, height, colours) {
  const { across, up, numbers } = drawGrid(context, view, width, height, colours);
  const style = { colour: colours.grey, halo: colours.surface };
  view.labels.write(across, width - 6, height - 5, { align: "right", ...style });
  view.labels.write(up, 4, 13, style);
  for (const { text, x, y } of numbers) view.labels.write(text, x, y, { ...style, free: true });
}

/** Axes and a length to measure by, of a spatial device. @param {CanvasRenderingContext2D} context @param {DeviceView} view @param {number} width @param {number} height @param {any} colours */
export function drawScale(context, view, width, height, colours) {
  const length = niceStep(width / view.scale, 10);
  const [from, to] = [{ x: 10, y: height - 10 }, { x: 10 + view.scale * length, y: height - 10 }];
  context.strokeStyle = colours.ink;
  context.lineWidth = 2;
  context.beginPath();
  line(context, from, to);
  context.stroke();
  view.labels.avoidLine(from, to);
  view.labels.write(quantity(length, "m", 2), 10, height - 16, { colour: colours.ink });
  const size = 2 * (AXIS + 14);
  const [right, bottom, middle] = [width - size, height - size, (height - size) / 2];
  const places = [[right, bottom], [right, 0], [0, 0], [right, middle], [0, middle]];
  const { left, top } = view.labels.choose("axes", places.map(([left, top], n) => ({ left, top, width: size, height: size, cost: 5 * n })));
  const at = { x: left + size / 2, y: top + size / 2 };
  [0, 1, 2].forEach((k) => {
    const shift = view.shift([0, 1, 2].map((n) => (n === k ? 1 : 0)));
    const end = { x: at.x + AXIS * shift.x, y: at.y + AXIS * shift.y };
    if (Math.hypot(shift.x, shift.y) > SEEN) arrow(context, at, end, colours.grey, 1.5);
    view.labels.avoidLine(at, end);
    view.labels.write("xyz"[k], end.x + 8 * shift.x, end.y + 8 * shift.y + 4, { align: "center", colour: colours.grey, halo: colours.surface });
  });
}

/** @param {number} share */
function shade(share) {
  const at = Math.min(Math.max(share, 0), 1) * (SHADES.length - 1);
  const n = Math.min(Math.floor(at), SHADES.length - 2);
  const [r, g, b] = SHADES[n].map((value, k) => Math.round(value + (at - n) * (SHADES[n + 1][k] - value)));
  return `rgb(${r} ${g} ${b})`;
}
