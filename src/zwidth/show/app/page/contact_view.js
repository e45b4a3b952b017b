/**
 * A contact with the wall: the picture of wall, handle and hand; position and force over time; and the loop of force
 * over position, whose area is the energy that the wall makes in each cycle.
 *
 * The same picture shows a contact that the server simulated and one that is touched now. The upper strip is where
 * the mouse is the hand.
 */

import { axisUnit, drawText, fitCanvas, niceTicks, palette, quantity, tickLabels } from "./canvas.js";
import { COMMAND, HANDLE, OUTPUTS, READING } from "./touch_machine.js";

/** @typedef {{time: Float64Array, position: Float64Array, force: Float64Array, handle: Float64Array}} Motion */
/** @typedef {{x: number, y: number, width: number, height: number}} Area */

const STRIP = 92; // css px of the upper strip
const SPAN = 1.5; // s of a touch that are shown
const LOOP = 0.4; // s of it in the loop
const SPANS = [0.002, 0.005, 0.01, 0.02, 0.05, 0.1]; // m to either side of the wall
const STEP = 0.05; // of the span, by which an arrow key moves the hand

export class ContactView {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {{onTarget: (target: number) => void, onGrab: (held: boolean) => void}} listeners
   */
  constructor(canvas, listeners) {
    this.canvas = canvas;
    this.listeners = listeners;
    /** @type {Motion | null} */
    this.motion = null;
    this.touching = false;
    this.live = ring(0);
    this.filled = 0;
    this.period = 0.001;
    this.span = SPANS[2];
    this.target = 0;
    this.now = 0; // m, where the handle is
    this.units = { x: "m", f: "N" };
    this.listen();
  }

  listen() {
    const { canvas } = this;
    canvas.addEventListener("pointerdown", (event) => {
      if (!this.touching) return;
      canvas.setPointerCapture(event.pointerId);
      this.listeners.onGrab(true);
      this.aim(event.offsetX);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (this.touching && (event.buttons & 1 || event.pointerType === "mouse")) this.aim(event.offsetX);
    });
    canvas.addEventListener("pointerup", () => this.touching && this.listeners.onGrab(false));
    canvas.addEventListener("keydown", (event) => {
      const way = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (!this.touching || !way) return;
      event.preventDefault();
      this.move(this.target + way * STEP * this.span);
    });
  }

  /** @param {number} x  [css px] */
  aim(x) {
    this.move(((2 * x) / this.canvas.clientWidth - 1) * this.span);
  }

  /** @param {number} target  [m] */
  move(target) {
    this.target = Math.min(Math.max(target, -this.span), this.span);
    this.listeners.onTarget(this.target);
  }

  /** @param {number} period  [s] */
  begin(period) {
    this.touching = true;
    this.period = period;
    this.live = ring(Math.ceil(SPAN / period));
    this.filled = 0;
  }

  end() {
    this.touching = false;
  }

  /** Add what was touched, rows of OUTPUTS. @param {Float64Array} outputs */
  add(outputs) {
    const count = outputs.length / OUTPUTS;
    const { size } = this.live;
    for (let k = 0; k < count; k++) {
      const at = this.filled % size;
      this.live.reading[at] = outputs[OUTPUTS * k + READING];
      this.live.force[at] = outputs[OUTPUTS * k + COMMAND];
      this.live.handle[at] = outputs[OUTPUTS * k + HANDLE];
      this.filled++;
    }
    if (count) this.now = outputs[OUTPUTS * (count - 1) + HANDLE];
  }

  /** @param {Motion} motion  simulated by the server */
  setMotion(motion) {
    this.motion = motion;
    this.touching = false;
  }

  /** What is shown, oldest first. @returns {Motion | null} */
  shown() {
    if (!this.touching) return this.motion;
    const { size, reading, force, handle } = this.live;
    const count = Math.min(this.filled, size);
    const order = (/** @type {Float64Array} */ values) => Float64Array.from({ length: count }, (_, i) => values[(this.filled - count + i) % size]);
    const time = Float64Array.from({ length: count }, (_, i) => (i - count) * this.period);
    return { time, position: order(reading), force: order(force), handle: order(handle) };
  }

  draw() {
    const { context, width, height } = fitCanvas(this.canvas);
    const colours = palette(this.canvas);
    const motion = this.shown();
    if (this.touching) this.drawStrip(context, { x: 0, y: 0, width, height: STRIP }, colours);
    const top = this.touching ? STRIP : 0;
    if (!motion || motion.time.length < 2) {
      if (!this.touching) ["choose a wall on the chart,", "then let the device go, or touch it"].forEach((line, n) => drawText(context, line, width / 2, height / 2 + 18 * n, { align: "center", colour: colours.grey }));
      return;
    }
    const wide = width > 420;
    const left = wide ? 0.62 * width : width;
    const high = wide ? height - top : 0.6 * (height - top);
    this.drawTime(context, { x: 0, y: top, width: left, height: high }, motion, colours);
    const area = wide ? { x: left, y: top, width: width - left, height: height - top } : { x: 0, y: top + high, width, height: height - top - high };
    this.drawLoop(context, area, this.touching ? latest(motion, LOOP) : motion, colours);
  }

  /** Wall, handle, spring and hand. @param {CanvasRenderingContext2D} context @param {Area} area @param {any} colours */
  drawStrip(context, area, colours) {
    const x = (/** @type {number} */ metres) => area.width * (0.5 + (0.5 * metres) / this.span);
    const middle = 46;
    const wall = x(0);
    context.strokeStyle = colours.grey;
    context.lineWidth = 1;
    context.save();
    context.beginPath();
    context.rect(wall, 12, Math.max(area.width - wall, 0), 66);
    context.clip();
    context.beginPath();
    for (let at = wall; at < area.width + 60; at += 9) {
      context.moveTo(at, 12);
      context.lineTo(at - 60, 78);
    }
    context.stroke();
    context.restore();
    context.strokeStyle = colours.ink;
    context.lineWidth = 2;
    context.beginPath();
    context.moveTo(wall, 12);
    context.lineTo(wall, 78);
    context.stroke();
    const device = Math.min(Math.max(x(this.now), -20), area.width + 20);
    const hand = x(this.target);
    this.drawSpring(context, device, hand, middle, colours.purple);
    context.fillStyle = colours.blue;
    context.beginPath();
    context.arc(device, middle, 11, 0, 2 * Math.PI);
    context.fill();
    context.fillStyle = colours.purple;
    context.fillRect(hand - 6, middle - 6, 12, 12);
    drawText(context, "wall", area.width - 8, 24, { align: "right", colour: colours.ink, halo: colours.surface });
    drawText(context, "device", device, middle - 17, { align: "center", colour: colours.ink, halo: colours.surface });
    drawText(context, "hand", hand, middle + 24, { align: "center", colour: colours.ink, halo: colours.surface });
    drawText(context, `±${quantity(this.span, this.units.x, 2)}`, 6, 86, { colour: colours.grey });
  }

  /** @param {CanvasRenderingContext2D} context @param {number} from @param {number} to @param {number} y @param {string} colour */
  drawSpring(context, from, to, y, colour) {
    context.strokeStyle = colour;
    context.lineWidth = 1.5;
    context.beginPath();
    context.moveTo(from, y);
    for (let n = 1; n < 16; n++) context.lineTo(from + ((to - from) * n) / 16, y + (n % 2 ? 6 : -6));
    context.lineTo(to, y);
    context.stroke();
  }

  /** @param {CanvasRenderingContext2D} context @param {Area} area @param {Motion} motion @param {any} colours */
  drawTime(context, area, motion, colours) {
    const half = area.height / 2;
    const rows = [
      { name: "Position", values: motion.position, unit: this.units.x, colour: colours.blue },
      { name: "Force", values: motion.force, unit: this.units.f, colour: colours.vermilion },
    ];
    rows.forEach((row, n) => {
      const last = n === rows.length - 1;
      const box = { x: area.x + 52, y: area.y + n * half + 16, width: area.width - 62, height: half - (last ? 50 : 26) };
      plot(context, box, motion.time, row.values, { along: last ? "Time" : "", unit: row.unit, name: row.name, colour: row.colour, colours, timeUnit: "s" });
    });
  }

  /** @param {CanvasRenderingContext2D} context @param {Area} area @param {Motion} motion @param {any} colours */
  drawLoop(context, area, motion, colours) {
    const box = { x: area.x + 52, y: area.y + 32, width: area.width - 64, height: area.height - 66 };
    plot(context, box, motion.position, motion.force, { along: "Position", unit: this.units.f, name: "Force", colour: colours.vermilion, colours, timeUnit: this.units.x });
    drawText(context, `wall gave ${quantity(workOf(motion), "J", 3)}`, box.x, area.y + 12, { colour: colours.ink });
  }
}

/** @param {number} size */
function ring(size) {
  return { size: Math.max(size, 1), reading: new Float64Array(Math.max(size, 1)), force: new Float64Array(Math.max(size, 1)), handle: new Float64Array(Math.max(size, 1)) };
}

/**
 * The work of the commanded force on the handle, held from sample to sample [J]: the area of its loops.
 *
 * @param {Motion} motion
 */
export function workOf(motion) {
  let work = 0;
  for (let k = 0; k + 1 < motion.time.length; k++) work += motion.force[k] * (motion.position[k + 1] - motion.position[k]);
  return work;
}

/** @param {Motion} motion @param {number} seconds @returns {Motion} */
function latest(motion, seconds) {
  const end = motion.time[motion.time.length - 1];
  const first = motion.time.findIndex((time) => time >= end - seconds);
  const cut = (/** @type {Float64Array} */ values) => values.subarray(Math.max(first, 0));
  return { time: cut(motion.time), position: cut(motion.position), force: cut(motion.force), handle: cut(motion.handle) };
}

/**
 * A line in a box with axes.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {Area} box
 * @param {Float64Array} across
 * @param {Float64Array} up
 * @param {{along: string, unit: string, name: string, colour: string, colours: any, timeUnit: string}} style
 */
export function plot(context, box, across, up, style) {
  const { colours } = style;
  const [x0, x1] = rangeOf(across);
  const [y0, y1] = rangeOf(up, true);
  const x = (/** @type {number} */ value) => box.x + ((value - x0) / (x1 - x0)) * box.width;
  const y = (/** @type {number} */ value) => box.y + box.height - ((value - y0) / (y1 - y0)) * box.height;
  context.lineWidth = 1;
  const upward = axisUnit(y0, y1, style.unit);
  const ticks = niceTicks(y0, y1, Math.max(2, Math.floor(box.height / 28)));
  const labels = tickLabels(ticks, upward.scale);
  ticks.forEach((tick, n) => {
    context.strokeStyle = tick === 0 ? colours.grey : colours.grid;
    context.beginPath();
    context.moveTo(box.x, Math.round(y(tick)) + 0.5);
    context.lineTo(box.x + box.width, Math.round(y(tick)) + 0.5);
    context.stroke();
    drawText(context, labels[n], box.x - 6, y(tick), { align: "right", baseline: "middle", colour: colours.ink, size: 11 });
  });
  drawText(context, `${style.name} [${upward.unit}]`, box.x, box.y - 5, { colour: style.colour, size: 12 });
  const along = axisUnit(x0, x1, style.timeUnit);
  const marks = niceTicks(x0, x1, Math.max(2, Math.floor(box.width / 80)));
  const names = tickLabels(marks, along.scale);
  marks.forEach((tick, n) => {
    context.strokeStyle = colours.grid;
    context.beginPath();
    context.moveTo(Math.round(x(tick)) + 0.5, box.y);
    context.lineTo(Math.round(x(tick)) + 0.5, box.y + box.height);
    context.stroke();
    if (style.along) drawText(context, names[n], x(tick), box.y + box.height + 14, { align: "center", colour: colours.ink, size: 11 });
  });
  if (style.along) drawText(context, `${style.along} [${along.unit}]`, box.x + box.width / 2, box.y + box.height + 29, { align: "center", colour: colours.ink, size: 12 });
  context.strokeStyle = style.colour;
  context.lineWidth = 1.5;
  context.lineJoin = "round";
  context.beginPath();
  for (let k = 0; k < across.length; k++) {
    if (k) context.lineTo(x(across[k]), y(up[k]));
    else context.moveTo(x(across[k]), y(up[k]));
  }
  context.stroke();
}

/** @param {Float64Array} values @param {boolean} [room] @returns {[number, number]} */
function rangeOf(values, room = false) {
  let low = Infinity;
  let high = -Infinity;
  for (const value of values) {
    if (value < low) low = value;
    if (value > high) high = value;
  }
  if (!(high > low)) return Number.isFinite(low) ? [low - 1e-6, low + 1e-6] : [0, 1];
  const more = room ? 0.06 * (high - low) : 0;
  return [low - more, high + more];
}
