/**
 * Other faces of the same wall: frequency along the edge, impedance, Nyquist plot, eigenvalues in the unit circle.
 */

import { axisUnit, drawSentence, drawText, fitCanvas, niceTicks, palette, quantity, textWidth, tickLabels } from "./canvas.js";

/** @typedef {import("./connection.js").Frame} Frame */
/** @typedef {{left: number, top: number, right: number, bottom: number}} Box */

const MARGIN = { left: 62, right: 18, top: 30, bottom: 46 };
const SHOWN = 2.2; // distance from the origin that the Nyquist plot shows at least
const MOST = 12; // and at most
const GAP = 14; // css px between names

export class FaceView {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    /** @type {Frame | null} */
    this.frame = null;
    this.face = "edge";
  }

  draw() {
    const { context, width, height } = fitCanvas(this.canvas);
    const colours = palette(this.canvas);
    const frame = this.frame;
    if (!frame) return;
    const reason = frame.head[this.face === "edge" ? "chart" : this.face]?.reason;
    if (reason || (this.face !== "edge" && !frame.head[this.face])) {
      drawSentence(context, reason ?? "", width, height, colours.grey);
      return;
    }
    const box = { left: MARGIN.left, top: MARGIN.top, right: width - MARGIN.right, bottom: height - MARGIN.bottom };
    if (this.face === "edge") this.drawEdge(context, box, frame, colours);
    else if (this.face === "impedance") this.drawImpedance(context, box, frame, colours);
    else this.drawPlane(context, box, frame, colours);
  }

  /** @param {CanvasRenderingContext2D} context @param {Box} box @param {Frame} frame @param {any} colours */
  drawEdge(context, box, frame, colours) {
    const arcs = frame.arrays["chart.arcs"].values;
    const ends = frame.arrays["chart.arcs_ends"].values;
    const unit = frame.head.moments ? "N m/rad" : "N/m";
    let [top, most] = [0, 0];
    for (let i = 0; i < arcs.length; i += 3) {
      if (arcs[i] < 0 || arcs[i + 1] < 0) continue;
      most = Math.max(most, arcs[i]);
      top = Math.max(top, arcs[i + 2]);
    }
    const scale = linear(box, [0, 1.05 * most || 1], [0, 1.08 * top || 1]);
    axes(context, box, scale, { x: "Virtual stiffness K", xUnit: unit, y: "Frequency on the edge", yUnit: "Hz" }, colours);
    context.strokeStyle = colours.blue;
    context.lineWidth = 2;
    let start = 0;
    for (const end of ends) {
      context.beginPath();
      let drawn = false;
      for (let i = start; i < end; i++) {
        const inside = arcs[3 * i] >= 0 && arcs[3 * i + 1] >= 0;
        if (inside && drawn) context.lineTo(scale.x(arcs[3 * i]), scale.y(arcs[3 * i + 2]));
        else if (inside) context.moveTo(scale.x(arcs[3 * i]), scale.y(arcs[3 * i + 2]));
        drawn = inside;
      }
      context.stroke();
      start = end;
    }
    const half = 0.5 / frame.head.chart.sampling_period;
    drawText(context, `half the sampling rate: ${quantity(half, "Hz")}`, box.right, box.top - 10, { align: "right", colour: colours.grey });
  }

  /** @param {CanvasRenderingContext2D} context @param {Box} box @param {Frame} frame @param {any} colours */
  drawImpedance(context, box, frame, colours) {
    const frequency = frame.arrays["impedance.frequency"].values;
    const lines = [
      { name: "felt at the handle", key: "impedance.felt", colour: colours.blue, dash: [] },
      { name: "commanded, K/jω + B", key: "impedance.commanded", colour: colours.vermilion, dash: [7, 3] },
      { name: "free motion", key: "impedance.free", colour: colours.green, dash: [2, 3] },
    ].filter((line) => frame.arrays[line.key]);
    const all = lines.flatMap((line) => [...frame.arrays[line.key].values]).filter((value) => value > 0 && Number.isFinite(value));
    const scale = logarithmic(box, [frequency[0], frequency[frequency.length - 1]], [Math.min(...all), Math.max(...all)]);
    axes(context, box, scale, { x: "Frequency", xUnit: "Hz", y: "Impedance |Z|", yUnit: "N s/m" }, colours);
    const style = { weight: 600 };
    let left = box.left;
    let up = box.top - 10;
    if (lines.reduce((sum, line) => sum + textWidth(context, line.name, style) + GAP, 0) > box.right - box.left) up = box.top - 20;
    for (const line of lines) {
      const values = frame.arrays[line.key].values;
      context.strokeStyle = line.colour;
      context.lineWidth = 2;
      context.setLineDash(line.dash);
      context.beginPath();
      for (let k = 0; k < values.length; k++) {
        if (k) context.lineTo(scale.x(frequency[k]), scale.y(values[k]));
        else context.moveTo(scale.x(frequency[k]), scale.y(values[k]));
      }
      context.stroke();
      context.setLineDash([]);
      const wide = textWidth(context, line.name, style);
      if (left > box.left && left + wide > box.right) [left, up] = [box.left, box.top - 5];
      drawText(context, line.name, left, up, { ...style, colour: line.colour });
      left += wide + GAP;
    }
  }

  /** The complex plane with equal scales. @param {CanvasRenderingContext2D} context @param {Box} box @param {Frame} frame @param {any} colours */
  drawPlane(context, box, frame, colours) {
    const nyquist = this.face === "nyquist";
    const values = frame.arrays[nyquist ? "nyquist.open_loop" : "eigenvalues.z"].values;
    let reach = nyquist ? SHOWN : 1.08;
    if (!nyquist) for (let i = 0; i < values.length; i += 2) reach = Math.max(reach, 1.08 * Math.hypot(values[i], values[i + 1]));
    reach = Math.min(reach, MOST);
    const half = Math.min(box.right - box.left, box.bottom - box.top) / 2;
    const across = (reach * (box.right - box.left)) / (2 * half);
    const up = (reach * (box.bottom - box.top)) / (2 * half);
    const scale = linear(box, [-across, across], [-up, up]);
    axes(context, box, scale, { x: nyquist ? "Real part of L" : "Real part of z", xUnit: "", y: "Imaginary part", yUnit: "" }, colours);
    context.save();
    context.beginPath();
    context.rect(box.left, box.top, box.right - box.left, box.bottom - box.top);
    context.clip();
    if (nyquist) this.drawNyquist(context, scale, frame, colours);
    else this.drawEigenvalues(context, scale, values, colours);
    context.restore();
    const title = nyquist
      ? "open loop L = P (K + B w): " + (frame.head.chart.wall?.verdict ?? "") + (frame.arrays["nyquist.disks"] ? "; disks: any passive hand" : "")
      : "eigenvalues in the unit circle: " + (frame.head.chart.wall?.verdict ?? "");
    drawText(context, title, box.left, box.top - 10, { colour: colours.ink });
  }

  /** @param {CanvasRenderingContext2D} context @param {any} scale @param {Frame} frame @param {any} colours */
  drawNyquist(context, scale, frame, colours) {
    const disks = frame.arrays["nyquist.disks"]?.values ?? [];
    const unit = scale.x(1) - scale.x(0);
    context.fillStyle = colours.blue;
    context.globalAlpha = 0.1;
    for (let i = 0; i < disks.length; i += 4) {
      if (!(disks[i + 2] * unit < 1e5)) continue;
      context.beginPath();
      context.arc(scale.x(disks[i]), scale.y(disks[i + 1]), disks[i + 2] * unit, 0, 2 * Math.PI);
      context.fill();
    }
    context.globalAlpha = 1;
    const values = frame.arrays["nyquist.open_loop"].values;
    context.strokeStyle = colours.blue;
    context.lineWidth = 2;
    for (const sign of [1, -1]) {
      context.setLineDash(sign > 0 ? [] : [4, 4]);
      context.beginPath();
      for (let i = 0; i < values.length; i += 3) {
        const [px, py] = [scale.x(clamp(values[i])), scale.y(clamp(sign * values[i + 1]))];
        if (i) context.lineTo(px, py);
        else context.moveTo(px, py);
      }
      context.stroke();
    }
    context.setLineDash([]);
    context.strokeStyle = colours.vermilion;
    context.lineWidth = 2.5;
    const [px, py] = [scale.x(-1), scale.y(0)];
    context.beginPath();
    context.moveTo(px - 6, py);
    context.lineTo(px + 6, py);
    context.moveTo(px, py - 6);
    context.lineTo(px, py + 6);
    context.stroke();
    drawText(context, "−1", px, py - 10, { align: "center", colour: colours.vermilion, halo: colours.surface, weight: 600 });
  }

  /** @param {CanvasRenderingContext2D} context @param {any} scale @param {ArrayLike<number>} values @param {any} colours */
  drawEigenvalues(context, scale, values, colours) {
    context.strokeStyle = colours.grey;
    context.lineWidth = 1.5;
    context.beginPath();
    context.arc(scale.x(0), scale.y(0), scale.x(1) - scale.x(0), 0, 2 * Math.PI);
    context.stroke();
    context.lineWidth = 2;
    for (let i = 0; i < values.length; i += 2) {
      const outside = Math.hypot(values[i], values[i + 1]) > 1;
      const [px, py] = [scale.x(values[i]), scale.y(values[i + 1])];
      context.strokeStyle = outside ? colours.vermilion : colours.blue;
      context.beginPath();
      if (outside) {
        context.moveTo(px - 5, py - 5);
        context.lineTo(px + 5, py + 5);
        context.moveTo(px - 5, py + 5);
        context.lineTo(px + 5, py - 5);
      } else context.arc(px, py, 5, 0, 2 * Math.PI);
      context.stroke();
    }
  }
}

/** @param {number} value */
function clamp(value) {
  return Math.min(Math.max(value, -1e4), 1e4);
}

/** @param {Box} box @param {[number, number]} x @param {[number, number]} y */
function linear(box, x, y) {
  return {
    ranges: { x, y },
    logarithmic: false,
    x: (/** @type {number} */ value) => box.left + ((value - x[0]) / (x[1] - x[0])) * (box.right - box.left),
    y: (/** @type {number} */ value) => box.bottom - ((value - y[0]) / (y[1] - y[0])) * (box.bottom - box.top),
  };
}

/** @param {Box} box @param {[number, number]} x @param {[number, number]} y */
function logarithmic(box, x, y) {
  const share = (/** @type {number} */ value, /** @type {[number, number]} */ [low, high]) => Math.log(value / low) / Math.log(high / low);
  return {
    ranges: { x, y },
    logarithmic: true,
    x: (/** @type {number} */ value) => box.left + share(value, x) * (box.right - box.left),
    y: (/** @type {number} */ value) => box.bottom - share(value, y) * (box.bottom - box.top),
  };
}

/**
 * Grid, numbers and names of both axes.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {Box} box
 * @param {ReturnType<typeof linear>} scale
 * @param {{x: string, xUnit: string, y: string, yUnit: string}} names
 * @param {any} colours
 */
function axes(context, box, scale, names, colours) {
  const { x, y } = scale.ranges;
  const ticksOf = (/** @type {[number, number]} */ range, /** @type {number} */ count) => (scale.logarithmic ? powers(range) : niceTicks(range[0], range[1], count));
  const unitX = scale.logarithmic ? { unit: names.xUnit, scale: 1 } : axisUnit(x[0], x[1], names.xUnit);
  const unitY = scale.logarithmic ? { unit: names.yUnit, scale: 1 } : axisUnit(y[0], y[1], names.yUnit);
  const acrossTicks = ticksOf(x, Math.max(3, Math.floor((box.right - box.left) / 90)));
  const upTicks = ticksOf(y, Math.max(3, Math.floor((box.bottom - box.top) / 50)));
  const text = (/** @type {number[]} */ ticks, /** @type {number} */ by) => (scale.logarithmic ? ticks.map((tick) => quantity(tick, "", 1)) : tickLabels(ticks, by));
  context.lineWidth = 1;
  text(acrossTicks, unitX.scale).forEach((line, n) => {
    const at = Math.round(scale.x(acrossTicks[n])) + 0.5;
    context.strokeStyle = acrossTicks[n] === 0 ? colours.grey : colours.grid;
    context.beginPath();
    context.moveTo(at, box.top);
    context.lineTo(at, box.bottom);
    context.stroke();
    drawText(context, line, at, box.bottom + 16, { align: "center", colour: colours.ink });
  });
  text(upTicks, unitY.scale).forEach((line, n) => {
    const at = Math.round(scale.y(upTicks[n])) + 0.5;
    context.strokeStyle = upTicks[n] === 0 ? colours.grey : colours.grid;
    context.beginPath();
    context.moveTo(box.left, at);
    context.lineTo(box.right, at);
    context.stroke();
    drawText(context, line, box.left - 7, at, { align: "right", baseline: "middle", colour: colours.ink });
  });
  const named = (/** @type {string} */ name, /** @type {string} */ unit) => (unit ? `${name} [${unit}]` : name);
  drawText(context, named(names.x, unitX.unit), (box.left + box.right) / 2, box.bottom + 37, { align: "center", colour: colours.ink, size: 13 });
  context.save();
  context.translate(14, (box.top + box.bottom) / 2);
  context.rotate(-Math.PI / 2);
  drawText(context, named(names.y, unitY.unit), 0, 0, { align: "center", baseline: "middle", colour: colours.ink, size: 13 });
  context.restore();
}

/** Powers of ten within a range. @param {[number, number]} range */
function powers([low, high]) {
  const found = [];
  for (let n = Math.ceil(Math.log10(low)); 10 ** n <= high; n++) found.push(10 ** n);
  return found;
}
