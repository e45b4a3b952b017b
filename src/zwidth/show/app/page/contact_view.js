/**
 * A contact with the wall: the picture of wall, handle and hand; position and force over time; and the loop of force
 * over position, whose area is the energy that the wall makes in each cycle.
 *
 * The same picture shows a contact that the server simulated and one that is touched now. The upper strip is where
 * the mouse is the hand.
 */

import { axisUnit, drawText, fitCanvas, niceTicks, palette, quantity, tickLabels } from "./canvas.js";
import { COMMAND, HANDLE, OUTPUTS, READING, TRUTH } from "./touch_machine.js";

/**
 * Samples of a contact.
 *
 * @typedef {object} Motion
 * @property {Float64Array} time     [s]
 * @property {Float64Array} reading  what the computer counts, from the wall on [m]
 * @property {Float64Array} place    the same without steps and noise [m]
 * @property {Float64Array} force    commanded [N]
 * @property {Float64Array} [made]   energy that the wall has made [J]; left out: as much as the loop shows
 * @property {number} delay          from reading to force [samples]
 */
/** @typedef {{stiffness: number, oneSided: boolean}} Spring  the wall's */
/** @typedef {{x: number, y: number, width: number, height: number}} Area */

const STRIP = 92; // css px of the upper strip
const SPAN = 1.5; // s of a touch that are shown
const LOOP = 0.4; // s of it in the loop, where no frequency is known
const CYCLES = 3; // in the loop
const FLATTEST = 0.002; // of its largest value: as little as an axis shows of a signal that hardly changes
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
    this.decays = false; // the simulated motion, so that its first cycles are in the loop, not the last
    this.touching = false;
    this.live = ring(0);
    this.filled = 0;
    this.period = 0.001;
    this.delay = 0;
    /** @type {Spring} */
    this.spring = { stiffness: 0, oneSided: false };
    /** @type {number | null} */
    this.frequency = null; // Hz, of the vibration whose cycles are in the loop
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
      this.live.place[at] = outputs[OUTPUTS * k + TRUTH];
      this.live.force[at] = outputs[OUTPUTS * k + COMMAND];
      this.filled++;
    }
    if (count) this.now = outputs[OUTPUTS * (count - 1) + HANDLE];
  }

  /** @param {Motion} motion  simulated by the server @param {boolean} decays */
  setMotion(motion, decays) {
    this.motion = motion;
    this.decays = decays;
    this.touching = false;
  }

  /** What is shown, oldest first. @returns {Motion | null} */
  shown() {
    if (!this.touching) return this.motion;
    const { size, reading, place, force } = this.live;
    const count = Math.min(this.filled, size);
    const order = (/** @type {Float64Array} */ values) => Float64Array.from({ length: count }, (_, i) => values[(this.filled - count + i) % size]);
    const time = Float64Array.from({ length: count }, (_, i) => (i - count) * this.period);
    return { time, reading: order(reading), place: order(place), force: order(force), delay: this.delay };
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
    this.drawLoop(context, area, motion, colours);
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
    const rows = [
      { name: "Position", values: motion.reading, unit: this.units.x, colour: colours.blue },
      { name: "Force", values: motion.force, unit: this.units.f, colour: colours.vermilion },
      { name: "Energy that the wall made", values: motion.made ?? madeOf(motion, this.spring), unit: "J", colour: colours.purple },
    ];
    const high = (area.height - 24) / rows.length; // below the last are the numbers of the time axis
    rows.forEach((row, n) => {
      const last = n === rows.length - 1;
      const box = { x: area.x + 52, y: area.y + n * high + 18, width: area.width - 62, height: high - 24 };
      plot(context, box, motion.time, row.values, { along: last ? "Time" : "", unit: row.unit, name: row.name, colour: row.colour, colours, timeUnit: "s" });
    });
  }

  /** @param {CanvasRenderingContext2D} context @param {Area} area @param {Motion} motion @param {any} colours */
  drawLoop(context, area, motion, colours) {
    const cycles = this.frequency ? CYCLES / this.frequency : LOOP;
    const part = cut(motion, cycles, this.touching || !this.decays);
    const { place, force } = loopOf(part);
    const box = { x: area.x + 52, y: area.y + 32, width: area.width - 64, height: area.height - 66 };
    plot(context, box, place, force, { along: "Position", unit: this.units.f, name: "Force", colour: colours.vermilion, colours, timeUnit: this.units.x });
    const energies = part.made ?? madeOf(part, this.spring);
    const made = energies[energies.length - 1] - energies[0];
    const during = this.frequency ? `${CYCLES} cycles` : quantity(LOOP, "s", 2);
    drawText(context, `${made < 0 ? "took" : "made"} ${quantity(Math.abs(made), "J", 3)} in ${during}`, area.x + 8, area.y + 12, { colour: colours.purple });
  }
}

/** @param {number} size */
function ring(size) {
  const values = () => new Float64Array(Math.max(size, 1));
  return { size: Math.max(size, 1), reading: values(), place: values(), force: values() };
}

/**
 * The force that is held, over where the device is meanwhile: steps, whose area is energy. Where a delay has a fraction,
 * the force changes within a period; the place there is that of the cubic through four samples.
 *
 * @param {Motion} motion
 * @returns {{place: Float64Array, force: Float64Array, first: number, points: number}}  from the sample `first` on, at
 *   which a force has arrived, so many points in each period
 */
export function loopOf(motion) {
  const { time, place, force, delay } = motion;
  const whole = Math.floor(delay);
  const share = delay - whole;
  const first = Math.ceil(delay);
  const points = share > 0 ? 4 : 2;
  const count = points * Math.max(time.length - 1 - first, 0);
  const path = { place: new Float64Array(count), force: new Float64Array(count), first, points };
  for (let k = first, at = 0; at < count; k++) {
    const change = between(place, k, share);
    const ends = share > 0 ? [[place[k], change], [change, place[k + 1]]] : [[place[k], place[k + 1]]];
    ends.forEach(([from, to], n) => {
      path.place.set([from, to], at);
      path.force.fill(force[k - first + n], at, at + 2);
      at += 2;
    });
  }
  return path;
}

/** A value after the sample k and a share of the period. @param {Float64Array} values @param {number} k @param {number} share */
function between(values, k, share) {
  const at = Math.min(Math.max(k - 1, 0), values.length - 4);
  if (at < 0) return values[k] + share * (values[k + 1] - values[k]); // too few for a cubic
  const s = k - at + share;
  return (
    (values[at] * (s - 1) * (s - 2) * (s - 3)) / -6 + (values[at + 1] * s * (s - 2) * (s - 3)) / 2 +
    (values[at + 2] * s * (s - 1) * (s - 3)) / -2 + (values[at + 3] * s * (s - 1) * (s - 2)) / 6
  );
}

/**
 * Energy that the wall has made from the first sample to each [J]: what the held force gave, less what the spring had
 * stored at first and has not now. An ideal spring makes none.
 *
 * @param {Motion} motion
 * @param {Spring} spring
 */
export function madeOf(motion, spring) {
  const { place, force, first, points } = loopOf(motion);
  const stored = (/** @type {number} */ at) => 0.5 * spring.stiffness * (spring.oneSided ? Math.max(at, 0) : at) ** 2;
  const made = new Float64Array(motion.time.length);
  const start = stored(motion.place[first] ?? 0);
  let given = 0;
  for (let n = 0; n < place.length; n += 2) {
    given += force[n] * (place[n + 1] - place[n]);
    const sample = first + 1 + Math.floor(n / points);
    made[sample] = given + stored(motion.place[sample]) - start;
  }
  return made;
}

/** The last, or the first, seconds of a motion. @param {Motion} motion @param {number} seconds @param {boolean} last @returns {Motion} */
function cut(motion, seconds, last) {
  const { time } = motion;
  const count = time.length;
  const step = time[1] - time[0];
  const rows = Math.min(count, Math.max(2, Math.round(seconds / step) + Math.ceil(motion.delay) + 1));
  const part = (/** @type {Float64Array} */ values) => (last ? values.subarray(count - rows) : values.subarray(0, rows));
  return { time: part(time), reading: part(motion.reading), place: part(motion.place), force: part(motion.force), made: motion.made && part(motion.made), delay: motion.delay };
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
  const ticks = niceTicks(y0, y1, Math.max(3, Math.floor(box.height / 28)));
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
  const marks = niceTicks(x0, x1, Math.max(3, Math.floor(box.width / 80)));
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
  const least = FLATTEST * Math.max(Math.abs(low), Math.abs(high));
  if (high - low < least) [low, high] = [(low + high - least) / 2, (low + high + least) / 2];
  const more = room ? 0.06 * (high - low) : 0;
  return [low - more, high + more];
}
