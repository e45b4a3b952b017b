/**
 * The device in its posture: links, joints, handle, the rendered direction and the wall across it.
 *
 * A planar device is seen along the axis in which it is flat, and its handle goes where it is dragged; a spatial one
 * is turned by dragging beside it. What is drawn is in metres; `place` turns that into pixels. While the device is
 * touched, links, joints and handle are drawn as they vibrate.
 */

import { axisUnit, drawText, fitCanvas, niceStep, niceTicks, palette, quantity, tickLabels } from "./canvas.js";
import { captionOf, Vibration } from "./vibration.js";

/** @typedef {import("./connection.js").Frame} Frame */
/** @typedef {import("./state.js").Vector} Vector */
/** @typedef {{x: Float64Array, y: Float64Array, values: Float64Array, unit: string, name: string}} Grid */

const MARGIN = 34;
const REACH = 22; // css px round the handle, or the arrow's tip, that a pointer grabs
const ARROW = 74; // css px
const STEP = 0.001; // m, by which an arrow key moves the handle
const TURN = Math.PI / 36; // by which [ and ] turn the direction
const CHAIN_SCALE = 1e5; // css px per metre of displacement, before it is enlarged or reduced
const OUTSIDE = 0.05; // share of the cells at each end of a map that have the colour of the end
const COLOURS = ["ink", "blue", "vermilion", "green", "purple", "orange"];
// Of a map, dark to light: cividis, told apart with any colour vision.
const SHADES = [[0, 34, 78], [53, 69, 108], [102, 105, 112], [148, 142, 119], [200, 184, 102], [254, 232, 56]];

export class DeviceView {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {{onPosition: (position: Vector, drag: string) => void, onDirection: (direction: Vector, drag: string) => void,
   *   onRelease: () => void}} listeners
   */
  constructor(canvas, listeners) {
    this.canvas = canvas;
    this.listeners = listeners;
    /** @type {Frame | null} */
    this.frame = null;
    /** @type {Grid | null} */
    this.map = null;
    this.turned = 0.6; // rad about z
    this.tilted = 0.4; // rad
    this.scale = 1; // css px per metre
    /** @type {Vector} */
    this.middle = [0, 0, 0];
    /** @type {"handle" | "tip" | "view" | null} */
    this.held = null;
    this.last = { x: 0, y: 0 };
    this.kept = ""; // device whose scale is kept
    this.vibration = new Vibration();
    /** @type {import("./vibration.js").Moment | null} */
    this.moment = null; // of the vibration that is drawn
    /** @type {Float64Array | null} */
    this.replayed = null; // the contact that is drawn again and again
    this.calm = matchMedia("(prefers-reduced-motion: reduce)");
    this.listen();
  }

  get scene() {
    return this.frame?.head.scene ?? null;
  }

  /** @param {string} name */
  points(name) {
    return /** @type {Float64Array} */ (this.frame?.arrays[`scene.${name}`]?.values ?? new Float64Array());
  }

  /** Rows of the view: where x, y and z go, right, up and towards the eye. @returns {Vector[]} */
  view() {
    const scene = this.scene;
    if (scene?.planar) {
      const [i, j] = scene.flat;
      const unit = (/** @type {number} */ k) => /** @type {Vector} */ ([0, 1, 2].map((n) => (n === k ? 1 : 0)));
      return [unit(i), unit(j), unit(3 - i - j)];
    }
    const [c, s, ct, st] = [Math.cos(this.turned), Math.sin(this.turned), Math.cos(this.tilted), Math.sin(this.tilted)];
    return [
      [c, s, 0],
      [-s * st, c * st, ct],
      [-s * ct, c * ct, -st],
    ];
  }

  /** Pixels of a point [m]. @param {ArrayLike<number>} p @param {number} [at] */
  place(p, at = 0) {
    const [right, up] = this.view();
    const along = (/** @type {Vector} */ axis) => axis[0] * (p[at] - this.middle[0]) + axis[1] * (p[at + 1] - this.middle[1]) + axis[2] * (p[at + 2] - this.middle[2]);
    return { x: this.canvas.clientWidth / 2 + this.scale * along(right), y: this.canvas.clientHeight / 2 - this.scale * along(up) };
  }

  /** @param {Frame} frame @param {string} device */
  setFrame(frame, device) {
    this.frame = frame;
    this.vibration.setFrame(frame, frame.head.chart.wall?.frequency ?? null);
    if (device !== this.kept || this.replayed) this.vibration.clear();
    this.replayed = null;
    if (!this.vibration.clip) this.moment = null;
    if (this.scene?.kind === "mechanism" && (device !== this.kept || !this.fits())) this.fit(device);
  }

  /**
   * Draw the device as it vibrates now.
   *
   * @param {Float64Array} trail  (k, n) amplitudes of the modes of the frame's layer `touch`
   * @param {number} step         s between two rows, a sampling period
   */
  setVibration(trail, step) {
    if (!this.vibration.known) return;
    this.vibration.add(trail, step);
    const before = this.vibration.clip;
    this.moment = this.vibration.at(performance.now(), this.pace, this.calm.matches);
    if (!this.calm.matches || this.vibration.clip !== before) this.draw();
  }

  /**
   * Draw the start of a contact in slow motion, again and again, until another view comes.
   *
   * @param {Frame} frame         the contact, with the modes and the rates of the drawn points
   * @param {Float64Array} trail  (k, n) amplitudes from the start on
   * @param {number} step         s between two rows, a sampling period
   */
  replay(frame, trail, step) {
    this.vibration.setFrame(frame, frame.head.dominant_frequency_Hz);
    this.vibration.show(trail, step);
    this.replayed = trail;
    const next = () => {
      if (this.replayed !== trail) return;
      this.moment = this.vibration.at(performance.now(), this.pace, this.calm.matches);
      this.draw();
      if (!this.calm.matches) requestAnimationFrame(next);
    };
    next();
  }

  /** Pixels per metre of displacement that count as true to size; a row of masses has no scale. */
  get pace() {
    return this.scene?.kind === "chain" ? CHAIN_SCALE : this.scale;
  }

  /** Points as they are drawn: those of the posture, displaced by the vibration. @param {string} name */
  drawnPoints(name) {
    const points = this.points(name);
    if (!this.moment) return points;
    const moved = this.vibration.displacements(name, this.moment.amplitudes);
    return points.map((value, i) => value + moved[i]);
  }

  /** Whether all of the device is in the picture, and fills it well. */
  fits() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const strokes = this.points("strokes");
    let far = 0;
    for (let i = 0; i < strokes.length; i += 3) {
      const { x, y } = this.place(strokes, i);
      if (x < 4 || y < 4 || x > width - 4 || y > height - 4) return false;
      far = Math.max(far, Math.abs(x - width / 2) / width, Math.abs(y - height / 2) / height);
    }
    return far > 0.12;
  }

  /** @param {string} device */
  fit(device) {
    const strokes = [...this.points("strokes"), ...this.points("handle"), 0, 0, 0];
    const [right, up] = this.view();
    const direction = this.points("direction");
    const size = Math.max(...strokes.map(Math.abs));
    const handle = this.points("handle");
    strokes.push(...[0, 1, 2].map((k) => handle[k] + 0.25 * size * direction[k])); // room for the arrow
    const spread = (/** @type {Vector} */ axis) => {
      let [low, high] = [Infinity, -Infinity];
      for (let i = 0; i < strokes.length; i += 3) {
        const value = axis[0] * strokes[i] + axis[1] * strokes[i + 1] + axis[2] * strokes[i + 2];
        [low, high] = [Math.min(low, value), Math.max(high, value)];
      }
      return { size: Math.max(high - low, 1e-3), middle: (low + high) / 2 };
    };
    const [a, b] = [spread(right), spread(up)];
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height) return;
    this.scale = 0.8 * Math.min((width - 2 * MARGIN) / a.size, (height - 2 * MARGIN) / b.size);
    this.middle = /** @type {Vector} */ ([0, 1, 2].map((k) => a.middle * right[k] + b.middle * up[k]));
    this.kept = device;
  }

  listen() {
    const { canvas } = this;
    canvas.addEventListener("pointerdown", (event) => {
      if (this.scene?.kind !== "mechanism") return;
      canvas.setPointerCapture(event.pointerId);
      this.held = this.under(event.offsetX, event.offsetY);
      this.last = { x: event.offsetX, y: event.offsetY };
    });
    canvas.addEventListener("pointermove", (event) => this.drag(event));
    const release = () => {
      if (this.held === "handle" || this.held === "tip") this.listeners.onRelease();
      this.held = null;
    };
    canvas.addEventListener("pointerup", release);
    canvas.addEventListener("pointercancel", release);
    canvas.addEventListener("keyup", () => this.listeners.onRelease());
    canvas.addEventListener("keydown", (event) => this.key(event));
    canvas.addEventListener("dblclick", () => {
      this.fit(this.kept);
      this.draw();
    });
  }

  /** @param {number} x @param {number} y @returns {"handle" | "tip" | "view"} */
  under(x, y) {
    const tip = this.tip();
    const handle = this.place(this.points("handle"));
    const [toTip, toHandle] = [Math.hypot(tip.x - x, tip.y - y), Math.hypot(handle.x - x, handle.y - y)];
    if (Math.min(toTip, toHandle) > REACH) return "view";
    return toHandle <= toTip ? "handle" : "tip";
  }

  /** Where the arrow of the rendered direction ends [css px]. */
  tip() {
    const handle = this.place(this.points("handle"));
    const direction = this.points("direction");
    const [right, up] = this.view();
    const along = (/** @type {Vector} */ axis) => axis[0] * direction[0] + axis[1] * direction[1] + axis[2] * direction[2];
    return { x: handle.x + ARROW * along(right), y: handle.y - ARROW * along(up) };
  }

  /** @param {PointerEvent} event */
  drag(event) {
    if (!this.held) {
      if (this.scene?.kind === "mechanism") this.canvas.style.cursor = this.under(event.offsetX, event.offsetY) === "view" ? "default" : "grab";
      return;
    }
    const [dx, dy] = [event.offsetX - this.last.x, event.offsetY - this.last.y];
    this.last = { x: event.offsetX, y: event.offsetY };
    if (this.held === "handle") this.move(dx / this.scale, -dy / this.scale);
    else if (this.held === "tip") this.aim(event.offsetX, event.offsetY);
    else if (!this.scene.planar) {
      this.turned -= 0.01 * dx;
      this.tilted = Math.min(Math.max(this.tilted + 0.01 * dy, -1.5), 1.5);
      this.draw();
    }
  }

  /** Move the handle in the plane of the picture. @param {number} across  [m] @param {number} up */
  move(across, up) {
    const handle = this.wanted ?? this.points("handle");
    const [right, upward] = this.view();
    const position = /** @type {Vector} */ ([0, 1, 2].map((k) => handle[k] + across * right[k] + up * upward[k]));
    this.wanted = position;
    this.listeners.onPosition(position, "handle");
  }

  /** Where the handle was wanted last, while it is dragged; null takes it from the frame. @type {Vector | null} */
  wanted = null;

  /** Turn the rendered direction towards a pixel. @param {number} x @param {number} y */
  aim(x, y) {
    const handle = this.place(this.points("handle"));
    const [right, up] = this.view();
    const [a, b] = [x - handle.x, handle.y - y];
    const length = Math.hypot(a, b);
    if (length < 4) return;
    const direction = /** @type {Vector} */ ([0, 1, 2].map((k) => (a * right[k] + b * up[k]) / length));
    this.listeners.onDirection(direction, "direction");
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    if (this.scene?.kind !== "mechanism") return;
    const step = event.shiftKey ? 10 * STEP : STEP;
    /** @type {{[key: string]: [number, number]}} */
    const moves = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, step], ArrowDown: [0, -step] };
    if (moves[event.key]) {
      event.preventDefault();
      this.move(...moves[event.key]);
    } else if (event.key === "[" || event.key === "]") {
      const turn = event.key === "[" ? -TURN : TURN;
      const [right, up] = this.view();
      const d = this.points("direction");
      const along = (/** @type {Vector} */ axis) => axis[0] * d[0] + axis[1] * d[1] + axis[2] * d[2];
      const angle = Math.atan2(along(up), along(right)) + turn;
      const direction = /** @type {Vector} */ ([0, 1, 2].map((k) => Math.cos(angle) * right[k] + Math.sin(angle) * up[k]));
      this.listeners.onDirection(direction, "direction");
    }
  }

  draw() {
    const { context, width, height } = fitCanvas(this.canvas);
    const colours = /** @type {any} */ (palette(this.canvas));
    const scene = this.scene;
    if (!scene) return;
    if (scene.kind === "chain") this.drawChain(context, width, height, colours);
    else if (scene.kind !== "mechanism") drawText(context, scene.reason ?? "a device without a picture: it is given by numbers or by a response", width / 2, height / 2, { align: "center", colour: colours.grey });
    else this.drawMechanism(context, width, height, colours);
  }

  /** @param {CanvasRenderingContext2D} context @param {number} width @param {number} height @param {any} colours */
  drawMechanism(context, width, height, colours) {
    if (this.map && this.scene.planar) this.drawMap(context, width, height, colours);
    if (this.scene.planar) this.drawGrid(context, width, height, colours);
    this.drawWall(context, colours);
    const strokes = this.drawnPoints("strokes");
    const ends = this.points("strokes_ends");
    let start = 0;
    context.lineCap = "round";
    context.lineJoin = "round";
    for (let link = 0; link < ends.length; link++) {
      const colour = colours[COLOURS[this.scene.styles[link] % COLOURS.length]];
      for (const [wide, alpha] of [[11, 0.3], [3, 1]]) {
        context.strokeStyle = colour;
        context.globalAlpha = alpha;
        context.lineWidth = wide;
        context.beginPath();
        for (let i = start; i < ends[link]; i++) {
          const { x, y } = this.place(strokes, 3 * i);
          if (i === start) context.moveTo(x, y);
          else context.lineTo(x, y);
        }
        context.stroke();
      }
      context.globalAlpha = 1;
      start = ends[link];
    }
    this.dots(context, "joints", 5, colours.surface, colours.ink);
    this.dots(context, "driven", 6, colours.blue, colours.ink);
    this.drawHandle(context, colours);
    this.drawForces(context, width, colours);
    this.drawScale(context, width, height, colours);
    this.drawCaption(context, width, height, colours);
  }

  /** What has been done to the picture of a vibration, or why there is none. @param {CanvasRenderingContext2D} context @param {number} width @param {number} height @param {any} colours */
  drawCaption(context, width, height, colours) {
    const line = this.caption();
    if (line) drawText(context, line, width / 2, height - 24, { align: "center", colour: colours.ink, halo: colours.surface, size: 11 });
  }

  /** The line below the device. */
  caption() {
    if (this.scene?.still) return this.scene.still;
    if (!this.moment) return "";
    const size = this.vibration.clip?.size ?? 0;
    const most = this.scene.kind === "chain" ? quantity(size, this.scene.turns ? "rad" : "m", 2) : "";
    return captionOf(this.moment.gain, this.calm.matches ? 0 : this.moment.slower, most);
  }

  /** @param {CanvasRenderingContext2D} context @param {string} name @param {number} radius @param {string} fill @param {string} line */
  dots(context, name, radius, fill, line) {
    const points = this.drawnPoints(name);
    context.fillStyle = fill;
    context.strokeStyle = line;
    context.lineWidth = 1.5;
    for (let i = 0; i < points.length; i += 3) {
      const { x, y } = this.place(points, i);
      context.beginPath();
      context.arc(x, y, radius, 0, 2 * Math.PI);
      context.fill();
      context.stroke();
    }
  }

  /** The wall across the direction, hatched behind it. @param {CanvasRenderingContext2D} context @param {any} colours */
  drawWall(context, colours) {
    if (this.scene.turns) return;
    const handle = this.place(this.points("handle"));
    const tip = this.tip();
    const length = Math.hypot(tip.x - handle.x, tip.y - handle.y);
    if (length < 8) return;
    const [ux, uy] = [(tip.x - handle.x) / length, (tip.y - handle.y) / length];
    const half = 62;
    context.save();
    context.translate(handle.x, handle.y);
    context.rotate(Math.atan2(uy, ux));
    context.strokeStyle = colours.grey;
    context.lineWidth = 1;
    context.beginPath();
    for (let at = -half; at < half; at += 8) {
      context.moveTo(0, at + 8);
      context.lineTo(12, at);
    }
    context.stroke();
    context.lineWidth = 2;
    context.strokeStyle = colours.ink;
    context.beginPath();
    context.moveTo(0, -half);
    context.lineTo(0, half);
    context.stroke();
    context.restore();
  }

  /** @param {CanvasRenderingContext2D} context @param {any} colours */
  drawHandle(context, colours) {
    const handle = this.place(this.points("handle"));
    const tip = this.tip();
    const drawn = this.place(this.drawnPoints("handle"));
    arrow(context, handle, tip, colours.vermilion, 2.5);
    context.fillStyle = colours.vermilion;
    context.strokeStyle = colours.surface;
    context.lineWidth = 2;
    context.beginPath();
    context.arc(drawn.x, drawn.y, 9, 0, 2 * Math.PI);
    context.fill();
    context.stroke();
    const name = this.scene.turns ? "axis of moments" : "rendered direction";
    drawText(context, name, tip.x + (tip.x < handle.x ? -8 : 8), tip.y + (tip.y < handle.y ? -8 : 16), { align: tip.x < handle.x ? "right" : "left", colour: colours.vermilion, halo: colours.surface });
  }

  /** Gravity and the hand's force, where they are given. @param {CanvasRenderingContext2D} context @param {number} width @param {any} colours */
  drawForces(context, width, colours) {
    const load = this.scene.load;
    if (!load) return;
    const [right, up] = this.view();
    const at = { x: width - 60, y: 40 };
    for (const [name, value, unit, colour] of [["load", load.force, "N", colours.purple], ["gravity", load.gravity, "m/s²", colours.orange]]) {
      if (!value) continue;
      const size = Math.hypot(...value);
      if (!size) continue;
      const along = (/** @type {Vector} */ axis) => (axis[0] * value[0] + axis[1] * value[1] + axis[2] * value[2]) / size;
      arrow(context, at, { x: at.x + 34 * along(right), y: at.y - 34 * along(up) }, colour, 2);
      drawText(context, `${name} ${quantity(size, unit, 3)}`, at.x - 8, at.y, { align: "right", colour, halo: colours.surface });
      at.y += 26;
    }
  }

  /** @param {CanvasRenderingContext2D} context @param {number} width @param {number} height @param {any} colours */
  drawGrid(context, width, height, colours) {
    const [i, j] = this.scene.flat;
    const low = [this.middle[i] - width / 2 / this.scale, this.middle[j] - height / 2 / this.scale];
    const high = [this.middle[i] + width / 2 / this.scale, this.middle[j] + height / 2 / this.scale];
    const axis = axisUnit(low[0], high[0], "m");
    for (const [n, k] of [[0, i], [1, j]]) {
      const ticks = niceTicks(low[n], high[n], Math.max(3, Math.floor((n ? height : width) / 80)));
      const labels = tickLabels(ticks, axis.scale);
      ticks.forEach((tick, t) => {
        const p = [...this.middle];
        p[k] = tick;
        const { x, y } = this.place(p);
        context.strokeStyle = colours.grid;
        context.globalAlpha = this.map ? 0.35 : 1;
        context.lineWidth = 1;
        context.beginPath();
        if (n) {
          context.moveTo(0, Math.round(y) + 0.5);
          context.lineTo(width, Math.round(y) + 0.5);
        } else {
          context.moveTo(Math.round(x) + 0.5, 0);
          context.lineTo(Math.round(x) + 0.5, height);
        }
        context.stroke();
        context.globalAlpha = 1;
        if (n && y > 16 && y < height - 26) drawText(context, labels[t], 4, y - 3, { colour: colours.grey, size: 11, halo: colours.surface });
        else if (!n && x > 40 && x < width - 80) drawText(context, labels[t], x + 3, height - 5, { colour: colours.grey, size: 11, halo: colours.surface });
      });
    }
    drawText(context, `${"xyz"[i]} → [${axis.unit}]`, width - 6, height - 5, { align: "right", colour: colours.grey, size: 11, halo: colours.surface });
    drawText(context, `↑ ${"xyz"[j]} [${axis.unit}]`, 4, 12, { colour: colours.grey, size: 11, halo: colours.surface });
  }

  /** Axes and a length to measure by, of a spatial device. @param {CanvasRenderingContext2D} context @param {number} width @param {number} height @param {any} colours */
  drawScale(context, width, height, colours) {
    if (this.scene.planar) return;
    const length = niceStep(width / this.scale, 5);
    context.strokeStyle = colours.ink;
    context.lineWidth = 2;
    context.beginPath();
    context.moveTo(10, height - 10);
    context.lineTo(10 + this.scale * length, height - 10);
    context.stroke();
    drawText(context, quantity(length, "m", 2), 10, height - 16, { colour: colours.ink });
    const [right, up] = this.view();
    const at = { x: width - 44, y: height - 40 };
    [0, 1, 2].forEach((k) => {
      const end = { x: at.x + 26 * right[k], y: at.y - 26 * up[k] };
      arrow(context, at, end, colours.grey, 1.5);
      drawText(context, "xyz"[k], end.x + 4 * Math.sign(right[k]), end.y - 3, { align: "center", colour: colours.grey, halo: colours.surface });
    });
  }

  /** @param {CanvasRenderingContext2D} context @param {number} width @param {number} height @param {any} colours */
  drawMap(context, width, height, colours) {
    const map = /** @type {Grid} */ (this.map);
    const { x, y, values } = map;
    const known = values.filter((value) => Number.isFinite(value)).sort();
    if (!known.length) return;
    // colours for nine cells of ten: near a singular posture single cells are thousands of times the others
    const [low, high] = [known[Math.floor(OUTSIDE * known.length)], known[Math.ceil((1 - OUTSIDE) * known.length) - 1]];
    context.globalAlpha = 0.75;
    const [i, j] = this.scene.flat;
    const [dx, dy] = [x[1] - x[0], y[1] - y[0]];
    for (let row = 0; row < y.length; row++) {
      for (let column = 0; column < x.length; column++) {
        const value = values[row * x.length + column];
        if (!Number.isFinite(value)) continue;
        const p = [...this.middle];
        p[i] = x[column] - dx / 2;
        p[j] = y[row] + dy / 2;
        const at = this.place(p);
        // from one pixel's edge to another: a gap or an overlap would be seen as a line
        const [left, top] = [Math.round(at.x), Math.round(at.y)];
        const [right, bottom] = [Math.round(at.x + dx * this.scale), Math.round(at.y + dy * this.scale)];
        context.fillStyle = shade(high > low ? (value - low) / (high - low) : 0.5);
        context.fillRect(left, top, right - left, bottom - top);
      }
    }
    context.globalAlpha = 1;
    const length = Math.min(150, width / 3);
    for (let k = 0; k < length; k++) {
      context.fillStyle = shade(k / length);
      context.fillRect(width - length - 12 + k, 8, 1.5, 9);
    }
    drawText(context, `${low > known[0] ? "≤ " : ""}${quantity(low, map.unit, 3)}`, width - length - 12, 30, { colour: colours.ink, halo: colours.surface, size: 11 });
    drawText(context, `${high < known[known.length - 1] ? "≥ " : ""}${quantity(high, map.unit, 3)}`, width - 12, 30, { align: "right", colour: colours.ink, halo: colours.surface, size: 11 });
    drawText(context, map.name, width - 12, 44, { align: "right", colour: colours.ink, halo: colours.surface, size: 11 });
  }

  /** Masses in a row with springs and dampers. @param {CanvasRenderingContext2D} context @param {number} width @param {number} height @param {any} colours */
  drawChain(context, width, height, colours) {
    const [mass, stiffness, damping] = [this.points("mass"), this.points("stiffness"), this.points("damping")];
    const n = mass.length;
    const gap = (width - 60) / (2 * n + 1);
    const y = height / 2;
    const moved = this.moment && this.vibration.known ? this.vibration.displacements("masses", this.moment.amplitudes) : null;
    const shift = (/** @type {number} */ k) => CHAIN_SCALE * (moved?.[3 * k] ?? 0);
    for (let k = 0; k <= n; k++) {
      if (!(stiffness[k] > 0 || damping[k] > 0)) continue;
      const from = 30 + gap * 2 * k;
      const ends = [from + (k > 0 ? shift(k - 1) : 0), from + gap + (k < n ? shift(k) : 0)];
      const both = stiffness[k] > 0 && damping[k] > 0;
      if (stiffness[k] > 0) spring(context, ends[0], ends[1], both ? y - 12 : y, colours.ink);
      if (damping[k] > 0) damper(context, ends[0], ends[1], both ? y + 12 : y, colours.ink);
      const lines = [stiffness[k] > 0 ? quantity(stiffness[k], "N/m") : "", damping[k] > 0 ? quantity(damping[k], "Ns/m") : ""].filter(Boolean);
      lines.forEach((line, row) => drawText(context, line, from + gap / 2, y + 34 + 16 * row, { align: "center", colour: colours.ink }));
      if (k === 0 || k === n) {
        const at = k === 0 ? from : from + gap;
        context.strokeStyle = colours.grey;
        context.lineWidth = 3;
        context.beginPath();
        context.moveTo(at, y - 30);
        context.lineTo(at, y + 30);
        context.stroke();
      }
    }
    for (let k = 0; k < n; k++) {
      const left = 30 + gap * (2 * k + 1) + shift(k);
      context.fillStyle = colours.blue;
      context.globalAlpha = 0.25;
      context.fillRect(left, y - 26, gap, 52);
      context.globalAlpha = 1;
      context.strokeStyle = colours.blue;
      context.lineWidth = 2;
      context.strokeRect(left, y - 26, gap, 52);
      drawText(context, quantity(mass[k], "kg"), left + gap / 2, y, { align: "center", baseline: "middle", colour: colours.ink });
    }
    this.drawCaption(context, width, height, colours);
  }
}

/** @param {CanvasRenderingContext2D} context @param {{x: number, y: number}} from @param {{x: number, y: number}} to @param {string} colour @param {number} width */
function arrow(context, from, to, colour, width) {
  const length = Math.hypot(to.x - from.x, to.y - from.y);
  if (length < 3) {
    context.strokeStyle = colour;
    context.beginPath();
    context.arc(from.x, from.y, 15, 0, 2 * Math.PI);
    context.stroke();
    return;
  }
  const [ux, uy] = [(to.x - from.x) / length, (to.y - from.y) / length];
  const head = Math.min(11, length / 2);
  context.strokeStyle = colour;
  context.fillStyle = colour;
  context.lineWidth = width;
  context.beginPath();
  context.moveTo(from.x, from.y);
  context.lineTo(to.x - head * ux, to.y - head * uy);
  context.stroke();
  context.beginPath();
  context.moveTo(to.x, to.y);
  context.lineTo(to.x - head * ux - 0.5 * head * uy, to.y - head * uy + 0.5 * head * ux);
  context.lineTo(to.x - head * ux + 0.5 * head * uy, to.y - head * uy - 0.5 * head * ux);
  context.fill();
}

/** @param {CanvasRenderingContext2D} context @param {number} from @param {number} to @param {number} y @param {string} colour */
function spring(context, from, to, y, colour) {
  context.strokeStyle = colour;
  context.lineWidth = 1.5;
  context.beginPath();
  context.moveTo(from, y);
  for (let n = 1; n < 12; n++) context.lineTo(from + ((to - from) * n) / 12, y + (n % 2 ? 8 : -8));
  context.lineTo(to, y);
  context.stroke();
}

/** @param {CanvasRenderingContext2D} context @param {number} from @param {number} to @param {number} y @param {string} colour */
function damper(context, from, to, y, colour) {
  const middle = (from + to) / 2;
  const half = Math.min(9, (to - from) / 4);
  context.strokeStyle = colour;
  context.lineWidth = 1.5;
  context.beginPath();
  context.moveTo(from, y); // rod and piston
  context.lineTo(middle, y);
  context.moveTo(middle, y - 5);
  context.lineTo(middle, y + 5);
  context.moveTo(middle - half, y - 8); // cylinder and its rod
  context.lineTo(middle + half, y - 8);
  context.lineTo(middle + half, y + 8);
  context.lineTo(middle - half, y + 8);
  context.moveTo(middle + half, y);
  context.lineTo(to, y);
  context.stroke();
}

/** @param {number} share */
function shade(share) {
  const at = Math.min(Math.max(share, 0), 1) * (SHADES.length - 1);
  const n = Math.min(Math.floor(at), SHADES.length - 2);
  const [r, g, b] = SHADES[n].map((value, k) => Math.round(value + (at - n) * (SHADES[n + 1][k] - value)));
  return `rgb(${r} ${g} ${b})`;
}
