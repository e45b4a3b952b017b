/**
 * The stability chart: stable walls, all that is switched on beside them, and the wall that was chosen.
 *
 * The axes stay while a number is dragged, so that the chart is seen to grow or shrink; they change when it has left
 * them or fills less than half of them. A wall is chosen by pointer or arrow keys.
 */

import { axisUnit, drawSentence, drawText, fitCanvas, niceTicks, palette, quantity, textWidth, tickLabels } from "./canvas.js";

/** @typedef {import("./connection.js").Frame} Frame */
/** @typedef {import("./state.js").Wall} Wall */
/** @typedef {{K: [number, number], B: [number, number]}} Box */
/** @typedef {{name: string, colour: string, rings: Float64Array, ends: Int32Array, dash: number[]}} Outline */
/** @typedef {{stiffness: number, damping: number, verdict?: string, edge?: string, measured?: string,
 *   spread?: number[]}} Point */

const MARGIN = { left: 58, right: 18, top: 14, bottom: 44 };
const ROOM = 1.08; // of what is stable, that is shown
const FULL = 0.5; // share of the axes below which what is stable is shown larger
const STEP = 0.01; // of the axes, by which an arrow key moves the wall
const NEAR = 14; // css px from the edge within which its frequency is told
const DASHES = [[7, 3], [2, 3], [9, 3, 2, 3], [4, 2], [12, 4], [2, 2, 6, 2]];
const COLOURS = ["blue", "vermilion", "green", "purple", "orange", "grey"];
// Of the frequency along the edge: cividis, dark to light, told apart with any colour vision.
const SHADES = ["#00224e", "#35456c", "#666970", "#948e77", "#c8b866", "#fee838"];

export class ChartView {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {{onWall: (wall: Wall, drag: string) => void, onRelease: () => void}} listeners
   */
  constructor(canvas, listeners) {
    this.canvas = canvas;
    this.listeners = listeners;
    /** @type {Frame | null} */
    this.frame = null;
    /** @type {Frame | null} */
    this.more = null;
    /** @type {Wall | null} */
    this.wall = null;
    /** @type {Set<string>} */
    this.layers = new Set();
    /** @type {{name: string, frame: Frame}[]} */
    this.pinned = [];
    /** @type {Point[]} */
    this.points = [];
    /** @type {Box | null} */
    this.box = null;
    this.whole = false;
    this.held = false;
    /** @type {{x: number, y: number} | null} */
    this.pointer = null;
    this.units = { K: "N/m", B: "N s/m" };
    this.listen();
  }

  listen() {
    const { canvas } = this;
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      this.held = true;
      this.choose(event);
    });
    canvas.addEventListener("pointermove", (event) => {
      this.pointer = { x: event.offsetX, y: event.offsetY };
      if (this.held) this.choose(event);
      else this.draw();
    });
    canvas.addEventListener("pointerup", () => this.letGo());
    canvas.addEventListener("pointercancel", () => this.letGo());
    canvas.addEventListener("pointerleave", () => {
      this.pointer = null;
      this.draw();
    });
    canvas.addEventListener("dblclick", () => this.fit());
    canvas.addEventListener(
      "wheel",
      (event) => {
        event.preventDefault();
        this.zoom(Math.exp(0.0015 * event.deltaY), event.offsetX, event.offsetY);
      },
      { passive: false },
    );
    canvas.addEventListener("keydown", (event) => this.key(event));
    canvas.addEventListener("keyup", () => this.letGo());
  }

  letGo() {
    if (this.held) this.listeners.onRelease();
    this.held = false;
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const step = event.shiftKey ? 10 * STEP : STEP;
    /** @type {{[key: string]: [number, number]}} */
    const moves = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, step], ArrowDown: [0, -step] };
    const move = moves[event.key];
    const box = this.box;
    if (move && box) {
      event.preventDefault();
      const { stiffness, damping } = this.wall ?? { stiffness: (box.K[0] + box.K[1]) / 2, damping: (box.B[0] + box.B[1]) / 2 };
      const wall = {
        stiffness: stiffness + move[0] * (box.K[1] - box.K[0]),
        damping: damping + move[1] * (box.B[1] - box.B[0]),
      };
      this.held = true;
      this.listeners.onWall(wall, "wall");
    } else if (event.key === "+" || event.key === "-") {
      this.zoom(event.key === "+" ? 0.8 : 1.25);
    } else if (event.key === "0") {
      this.fit();
    }
  }

  /** @param {PointerEvent} event */
  choose(event) {
    const wall = this.wallAt(event.offsetX, event.offsetY);
    if (wall) this.listeners.onWall(wall, "wall");
  }

  /**
   * @param {number} x  [css px]
   * @param {number} y
   * @returns {Wall | null}
   */
  wallAt(x, y) {
    if (!this.box) return null;
    const { K, B } = this.box;
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const across = (x - MARGIN.left) / (width - MARGIN.left - MARGIN.right);
    const up = (height - MARGIN.bottom - y) / (height - MARGIN.top - MARGIN.bottom);
    return { stiffness: K[0] + across * (K[1] - K[0]), damping: B[0] + up * (B[1] - B[0]) };
  }

  /**
   * @param {number} factor
   * @param {number} [x]
   * @param {number} [y]
   */
  zoom(factor, x = this.canvas.clientWidth / 2, y = this.canvas.clientHeight / 2) {
    const at = this.wallAt(x, y);
    if (!at || !this.box) return;
    const about = (/** @type {[number, number]} */ [low, high], /** @type {number} */ middle) =>
      /** @type {[number, number]} */ ([middle + factor * (low - middle), middle + factor * (high - middle)]);
    this.box = { K: about(this.box.K, at.stiffness), B: about(this.box.B, at.damping) };
    this.draw();
  }

  /** Show all of what is stable, of its part with K and B above 0 or of all. */
  fit() {
    this.box = null;
    this.follow();
    this.draw();
  }

  /** @param {boolean} whole */
  showWhole(whole) {
    this.whole = whole;
    this.fit();
  }

  /** Choose axes, or keep those that still suit. */
  follow() {
    const chart = this.frame?.head.chart;
    if (!chart) return;
    if (chart.reason) {
      this.box = null;
      return;
    }
    const [K0, K1, B0, B1] = chart.box;
    const others = this.pinned.map((each) => each.frame.head.chart.box);
    const top = Math.max(K1, ...others.map((box) => box[1]), ...this.points.map((point) => point.stiffness));
    const high = Math.max(B1, ...others.map((box) => box[3]), ...this.points.map((point) => point.damping));
    const wanted = this.whole
      ? { K: /** @type {[number, number]} */ ([K0, top]), B: /** @type {[number, number]} */ ([B0, high]) }
      : { K: /** @type {[number, number]} */ ([0, ROOM * Math.max(top, 1e-9)]), B: /** @type {[number, number]} */ ([0, ROOM * Math.max(high, 1e-12)]) };
    const suits = (/** @type {[number, number]} */ now, /** @type {[number, number]} */ next) =>
      next[1] <= now[1] * (1 + 1e-9) && next[1] - next[0] >= FULL * (now[1] - now[0]) && (!this.whole || next[0] >= now[0]);
    const box = this.box;
    this.box = {
      K: box && suits(box.K, wanted.K) ? box.K : wanted.K,
      B: box && suits(box.B, wanted.B) ? box.B : wanted.B,
    };
  }

  /** @param {Frame} frame */
  setFrame(frame) {
    this.frame = frame;
    const moments = frame.head.moments;
    this.units = moments ? { K: "N m/rad", B: "N m s/rad" } : { K: "N/m", B: "N s/m" };
    this.follow();
  }

  draw() {
    const surface = fitCanvas(this.canvas);
    const { context, width, height } = surface;
    const frame = this.frame;
    const box = this.box;
    const reason = frame?.head.chart.reason;
    if (reason) drawSentence(context, reason, width, height, palette(this.canvas).grey);
    if (!frame || !box) return;
    const colours = { ...palette(this.canvas), stable: getComputedStyle(this.canvas).getPropertyValue("--stable") };
    const x = (/** @type {number} */ K) => MARGIN.left + ((K - box.K[0]) / (box.K[1] - box.K[0])) * (width - MARGIN.left - MARGIN.right);
    const y = (/** @type {number} */ B) => height - MARGIN.bottom - ((B - box.B[0]) / (box.B[1] - box.B[0])) * (height - MARGIN.top - MARGIN.bottom);
    const place = { x, y, width, height };
    this.drawAxes(context, place, colours);
    context.save();
    context.beginPath();
    context.rect(MARGIN.left, MARGIN.top, width - MARGIN.left - MARGIN.right, height - MARGIN.top - MARGIN.bottom);
    context.clip();
    const { values: rings } = frame.arrays["chart.rings"];
    const { values: ends } = frame.arrays["chart.rings_ends"];
    this.trace(context, place, rings, ends, 2);
    context.fillStyle = colours.stable;
    context.fill();
    for (const one of this.outlines(colours)) {
      this.trace(context, place, one.rings, one.ends, 2);
      context.strokeStyle = one.colour;
      context.lineWidth = 1.5;
      context.setLineDash(one.dash);
      context.stroke();
      context.setLineDash([]);
    }
    this.drawBounds(context, place, colours);
    this.drawEdge(context, place, colours);
    this.drawPoints(context, place, colours);
    context.restore();
    this.drawWall(context, place, colours);
    this.drawHover(context, place, colours);
    if (!ends.length) drawText(context, "no wall is stable", width / 2, height / 2, { align: "center", colour: colours.grey, size: 14 });
  }

  /**
   * Names and colours of the outlines that are switched on, for the legend too.
   *
   * @param {{[name: string]: string}} colours
   * @returns {Outline[]}
   */
  outlines(colours) {
    /** @type {Outline[]} */
    const found = [];
    /** @param {Frame} frame @param {string} name @param {string} key */
    const add = (frame, name, key) => {
      const rings = frame.arrays[`${key}.rings`];
      if (!rings) return;
      const n = found.length;
      found.push({
        name,
        colour: colours[COLOURS[n % COLOURS.length]],
        rings: /** @type {Float64Array} */ (rings.values),
        ends: /** @type {Int32Array} */ (frame.arrays[`${key}.rings_ends`].values),
        dash: DASHES[(n + Math.floor(n / COLOURS.length)) % DASHES.length], // another one at each round of colours
      });
    };
    for (const each of this.pinned) add(each.frame, each.name, "chart");
    for (const frame of [this.frame, this.more]) {
      if (!frame) continue;
      const { decay, models, hands, guarantees } = frame.head;
      if (this.layers.has("decay")) (decay?.radii ?? []).forEach((/** @type {number} */ radius, /** @type {number} */ n) => add(frame, `|z| < ${radius.toFixed(4)}`, `decay.${n}`));
      if (this.layers.has("models")) Object.keys(models?.charts ?? {}).forEach((name) => add(frame, `${name} model`, `models.${name}`));
      if (this.layers.has("hands")) Object.keys(hands?.charts ?? {}).forEach((name) => add(frame, name, `hands.${name}`));
      if (this.layers.has("guarantees")) Object.keys(guarantees?.regions ?? {}).forEach((name) => add(frame, `${GUARANTEES[name] ?? name}${guarantees.regions[name].reason ? ": none" : ""}`, `guarantees.${name}`));
    }
    return found;
  }

  /**
   * The published conditions that have a line in view.
   *
   * @param {{[name: string]: string}} colours
   * @returns {{name: string, colour: string, dash: number[], values: Float64Array, source: string, holds: boolean}[]}
   */
  bounds(colours) {
    const frame = this.more;
    if (!frame?.head.bounds?.conditions || !this.layers.has("bounds")) return [];
    let n = 0;
    return frame.head.bounds.conditions
      .filter((/** @type {any} */ one) => one.stiffness_max > 0)
      .map((/** @type {any} */ one, /** @type {number} */ k) => {
        const holds = !one.violated.length;
        return {
          name: one.name,
          source: one.source,
          holds,
          colour: holds ? colours[COLOURS[n++ % COLOURS.length]] : colours.grey, // grey: its assumptions are not met
          dash: holds ? [] : DASHES[k % DASHES.length],
          values: frame.arrays[one.array].values,
        };
      });
  }

  /** @param {CanvasRenderingContext2D} context @param {any} place @param {any} colours */
  drawBounds(context, place, colours) {
    const lines = this.bounds(colours);
    if (!lines.length || !this.more) return;
    const damping = this.more.arrays["bounds.damping"].values;
    for (const line of lines) {
      context.beginPath();
      let drawn = false;
      for (let i = 0; i < damping.length; i++) {
        const K = line.values[i];
        if (!(K > 0)) drawn = false;
        else {
          if (drawn) context.lineTo(place.x(K), place.y(damping[i]));
          else context.moveTo(place.x(K), place.y(damping[i]));
          drawn = true;
        }
      }
      context.strokeStyle = line.colour;
      context.lineWidth = line.holds ? 1.5 : 1;
      context.setLineDash(line.dash);
      context.stroke();
      context.setLineDash([]);
    }
  }

  /** @param {CanvasRenderingContext2D} context @param {any} place @param {any} colours */
  drawAxes(context, place, colours) {
    const { x, y, width, height } = place;
    const box = /** @type {Box} */ (this.box);
    const right = width - MARGIN.right;
    const bottom = height - MARGIN.bottom;
    context.lineWidth = 1;
    for (const [range, unit, along] of /** @type {[[number, number], string, string][]} */ ([[box.K, this.units.K, "x"], [box.B, this.units.B, "y"]])) {
      const ticks = niceTicks(range[0], range[1], along === "x" ? Math.max(3, Math.floor(width / 90)) : 6);
      const axis = axisUnit(range[0], range[1], unit);
      const labels = tickLabels(ticks, axis.scale);
      ticks.forEach((tick, i) => {
        const at = Math.round(along === "x" ? x(tick) : y(tick)) + 0.5;
        context.strokeStyle = tick === 0 ? colours.grey : colours.grid;
        context.beginPath();
        if (along === "x") {
          context.moveTo(at, MARGIN.top);
          context.lineTo(at, bottom);
        } else {
          context.moveTo(MARGIN.left, at);
          context.lineTo(right, at);
        }
        context.stroke();
        if (along === "x") drawText(context, labels[i], at, bottom + 16, { align: "center", colour: colours.ink });
        else drawText(context, labels[i], MARGIN.left - 7, at, { align: "right", baseline: "middle", colour: colours.ink });
      });
      if (along === "x") drawText(context, `Virtual stiffness K [${axis.unit}]`, (MARGIN.left + right) / 2, bottom + 36, { align: "center", colour: colours.ink, size: 13 });
      else {
        context.save();
        context.translate(14, (MARGIN.top + bottom) / 2);
        context.rotate(-Math.PI / 2);
        drawText(context, `Virtual damping B [${axis.unit}]`, 0, 0, { align: "center", baseline: "middle", colour: colours.ink, size: 13 });
        context.restore();
      }
    }
  }

  /**
   * A path of rings or arcs, rows of `stride` numbers that begin with K and B.
   *
   * @param {CanvasRenderingContext2D} context
   * @param {any} place
   * @param {ArrayLike<number>} rows
   * @param {ArrayLike<number>} ends
   * @param {number} stride
   */
  trace(context, place, rows, ends, stride) {
    context.beginPath();
    let start = 0;
    for (let part = 0; part < ends.length; part++) {
      for (let i = start; i < ends[part]; i++) {
        const px = place.x(rows[stride * i]);
        const py = place.y(rows[stride * i + 1]);
        if (i === start) context.moveTo(px, py);
        else context.lineTo(px, py);
      }
      start = ends[part];
    }
  }

  /** @param {CanvasRenderingContext2D} context @param {any} place @param {any} colours */
  drawEdge(context, place, colours) {
    const frame = /** @type {Frame} */ (this.frame);
    const arcs = frame.arrays["chart.arcs"].values;
    const ends = frame.arrays["chart.arcs_ends"].values;
    context.lineWidth = 2;
    context.lineJoin = "round";
    if (!this.layers.has("frequency")) {
      this.trace(context, place, arcs, ends, 3);
      context.strokeStyle = colours.ink;
      context.stroke();
      return;
    }
    const top = this.highestFrequency();
    context.lineWidth = 4;
    let start = 0;
    for (let part = 0; part < ends.length; part++) {
      for (let i = start; i + 1 < ends[part]; i++) {
        context.beginPath();
        context.moveTo(place.x(arcs[3 * i]), place.y(arcs[3 * i + 1]));
        context.lineTo(place.x(arcs[3 * i + 3]), place.y(arcs[3 * i + 4]));
        context.strokeStyle = shade(arcs[3 * i + 2] / top);
        context.stroke();
      }
      start = ends[part];
    }
    this.drawScale(context, place, colours, top);
  }

  /** Highest frequency on the edge with K and B above 0 [Hz]. */
  highestFrequency() {
    const arcs = /** @type {Frame} */ (this.frame).arrays["chart.arcs"].values;
    let top = 1e-9;
    for (let i = 0; i < arcs.length; i += 3) if (arcs[i] >= 0 && arcs[i + 1] >= 0) top = Math.max(top, arcs[i + 2]);
    return top;
  }

  /** @param {CanvasRenderingContext2D} context @param {any} place @param {any} colours @param {number} top */
  drawScale(context, place, colours, top) {
    const length = Math.min(140, place.width / 4);
    const left = place.width - MARGIN.right - length - 10;
    const up = MARGIN.top + 12;
    for (let i = 0; i < length; i++) {
      context.fillStyle = shade(i / length);
      context.fillRect(left + i, up, 1.5, 8);
    }
    drawText(context, "0 Hz", left, up + 22, { colour: colours.ink, halo: colours.surface });
    drawText(context, quantity(top, "Hz", 3), left + length, up + 22, { align: "right", colour: colours.ink, halo: colours.surface });
  }

  /** @param {CanvasRenderingContext2D} context @param {any} place @param {any} colours */
  drawPoints(context, place, colours) {
    for (const point of this.points) {
      const px = place.x(point.stiffness);
      const py = place.y(point.damping);
      context.strokeStyle = colours.vermilion;
      context.fillStyle = colours.surface;
      context.lineWidth = 1.6;
      const [low, high, left, right] = point.spread ?? [];
      context.beginPath();
      if (Number.isFinite(low) && Number.isFinite(high)) {
        context.moveTo(px, place.y(low));
        context.lineTo(px, place.y(high));
      }
      if (Number.isFinite(left) && Number.isFinite(right)) {
        context.moveTo(place.x(left), py);
        context.lineTo(place.x(right), py);
      }
      context.stroke();
      context.beginPath();
      if (point.measured === "unstable") {
        context.moveTo(px - 4, py - 4);
        context.lineTo(px + 4, py + 4);
        context.moveTo(px - 4, py + 4);
        context.lineTo(px + 4, py - 4);
        context.stroke();
      } else {
        context.arc(px, py, 4, 0, 2 * Math.PI);
        context.fill();
        context.stroke();
      }
    }
  }

  /** @param {CanvasRenderingContext2D} context @param {any} place @param {any} colours */
  drawWall(context, place, colours) {
    const chart = this.frame?.head.chart;
    if (chart?.stiffness_max > 0) {
      const px = place.x(chart.stiffness_max);
      const py = place.y(chart.damping_at_stiffness_max);
      context.fillStyle = colours.ink;
      context.beginPath();
      context.arc(px, py, 3.5, 0, 2 * Math.PI);
      context.fill();
    }
    if (!this.wall) return;
    // a wall beyond the axes stands at their end
    const px = Math.min(Math.max(place.x(this.wall.stiffness), MARGIN.left), place.width - MARGIN.right);
    const py = Math.min(Math.max(place.y(this.wall.damping), MARGIN.top), place.height - MARGIN.bottom);
    const beyond = Math.hypot(px - place.x(this.wall.stiffness), py - place.y(this.wall.damping)) > 1;
    if (beyond) drawText(context, "beyond the axes", px - 14, py - 10, { align: "right", colour: colours.ink, halo: colours.surface });
    const verdict = chart?.wall?.verdict;
    context.strokeStyle = verdict === "stable" ? colours.green : colours.vermilion;
    context.lineWidth = 2.5;
    context.fillStyle = colours.surface;
    context.beginPath();
    context.arc(px, py, 8, 0, 2 * Math.PI);
    context.fill();
    context.stroke();
    context.beginPath(); // a sign beside the colour: a bar for stable, a cross for not
    if (verdict === "stable") {
      context.moveTo(px - 4, py);
      context.lineTo(px - 1, py + 3);
      context.lineTo(px + 4, py - 4);
    } else {
      context.moveTo(px - 3, py - 3);
      context.lineTo(px + 3, py + 3);
      context.moveTo(px - 3, py + 3);
      context.lineTo(px + 3, py - 3);
    }
    context.lineWidth = 2;
    context.stroke();
  }

  /** @param {CanvasRenderingContext2D} context @param {any} place @param {any} colours */
  drawHover(context, place, colours) {
    if (!this.pointer || this.held || !this.frame) return;
    const arcs = this.frame.arrays["chart.arcs"].values;
    let best = NEAR * NEAR;
    let at = -1;
    for (let i = 0; i < arcs.length; i += 3) {
      const dx = place.x(arcs[i]) - this.pointer.x;
      const dy = place.y(arcs[i + 1]) - this.pointer.y;
      if (dx * dx + dy * dy < best) {
        best = dx * dx + dy * dy;
        at = i;
      }
    }
    if (at < 0) return;
    const lines = [`oscillates at ${quantity(arcs[at + 2], "Hz")}`, `K ${quantity(arcs[at], this.units.K)}, B ${quantity(arcs[at + 1], this.units.B)}`];
    const wide = Math.max(...lines.map((line) => textWidth(context, line))) + 16;
    const left = Math.min(Math.max(this.pointer.x + 14, MARGIN.left), place.width - wide - 4);
    const up = Math.max(this.pointer.y - 46, 4);
    context.fillStyle = colours.surface;
    context.strokeStyle = colours.grey;
    context.lineWidth = 1;
    context.beginPath();
    context.roundRect(left, up, wide, 40, 5);
    context.fill();
    context.stroke();
    lines.forEach((line, n) => drawText(context, line, left + 8, up + 16 + 16 * n, { colour: colours.ink }));
  }
}

/** @type {{[name: string]: string}} */
const GUARANTEES = {
  passive: "every passive hand",
  "passive-at-actuator": "passive, at the actuator",
  "spring-stable": "every spring",
  "nyquist-spring": "Nyquist spring",
  stable: "stable",
};

/**
 * Colour of a share of the scale.
 *
 * @param {number} share
 */
function shade(share) {
  const at = Math.min(Math.max(share, 0), 1) * (SHADES.length - 1);
  const n = Math.min(Math.floor(at), SHADES.length - 2);
  const part = (/** @type {number} */ k) => {
    const [a, b] = [SHADES[n], SHADES[n + 1]].map((hex) => parseInt(hex.slice(1 + 2 * k, 3 + 2 * k), 16));
    return Math.round(a + (at - n) * (b - a));
  };
  return `rgb(${part(0)} ${part(1)} ${part(2)})`;
}
