/**
 * The device in its posture, and what is dragged and pressed in its picture.
 *
 * A planar device is seen along the axis in which it is flat, and its handle goes where it is dragged; a spatial one
 * is turned by dragging beside it. What is drawn is in metres; `place` turns that into pixels. While the device is
 * touched, links, joints and handle are drawn as they vibrate.
 */

import { drawText, fitCanvas, inLines, palette, quantity } from "./canvas.js";
import { Labels } from "./labels.js";
import { drawKey, drawMap, drawPlane, drawScale, placeOf } from "./map_drawing.js";
import { ARROW, aroundHandle, cross, drawForces, drawMechanism, linkStyle, nameParts, segmentsOf } from "./mechanism_drawing.js";
import { captionOf, Vibration } from "./vibration.js";

/** @typedef {import("./connection.js").Frame} Frame */
/** @typedef {import("./state.js").Vector} Vector */

// css px round the device: for its key above, if there is a map, and for the base and the numbers of the grid below.
const MARGIN = { side: 34, top: 26, key: 54, bottom: 46 };
const REACH = 22; // css px round the handle, or the arrow's tip, that a pointer grabs
const STEP = 0.001; // m, by which an arrow key moves the handle
const TURN = Math.PI / 36; // by which a key turns the direction or the view
const STEEPEST = 1.5; // rad to which the view is tilted, short of turning over
const NARROW = 24; // letters of a caption's line beside the device
const CHAIN_SCALE = 1e5; // css px per metre of displacement, before it is enlarged or reduced

export class DeviceView {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {HTMLElement} legend  a list of links
   * @param {{onPosition: (position: Vector, drag: string) => void, onDirection: (direction: Vector, drag: string) => void,
   *   onRelease: () => void}} listeners
   */
  constructor(canvas, legend, listeners) {
    this.canvas = canvas;
    this.legend = legend;
    this.listeners = listeners;
    /** @type {Frame | null} */
    this.frame = null;
    /** @type {import("./map_drawing.js").Grid | null} */
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
    /** @type {{size: string, map: import("./map_drawing.js").Grid | null}} */
    this.fitted = { size: "", map: null }; // canvas and map that it was made for
    this.labels = new Labels();
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
      return [unit(i), unit(j), cross(unit(i), unit(j))];
    }
    const [c, s, ct, st] = [Math.cos(this.turned), Math.sin(this.turned), Math.cos(this.tilted), Math.sin(this.tilted)];
    const [right, up] = /** @type {Vector[]} */ ([[c, s, 0], [-s * st, c * st, ct]]);
    return [right, up, cross(right, up)];
  }

  /** Pixels of a point [m]. @param {ArrayLike<number>} p @param {number} [at] */
  place(p, at = 0) {
    const [right, up] = this.view();
    const along = (/** @type {Vector} */ axis) => axis[0] * (p[at] - this.middle[0]) + axis[1] * (p[at + 1] - this.middle[1]) + axis[2] * (p[at + 2] - this.middle[2]);
    return { x: this.canvas.clientWidth / 2 + this.scale * along(right), y: this.canvas.clientHeight / 2 - this.scale * along(up) };
  }

  /** Pixels by which one goes on the picture along a vector of one pixel. @param {ArrayLike<number>} vector */
  shift(vector) {
    const [x, y] = this.view().map((axis) => axis[0] * vector[0] + axis[1] * vector[1] + axis[2] * vector[2]);
    return { x, y: -y };
  }

  /** @param {Frame} frame @param {string} device */
  setFrame(frame, device) {
    this.frame = frame;
    this.vibration.setFrame(frame, frame.head.chart.wall?.frequency ?? null);
    if (device !== this.kept || this.replayed) this.vibration.clear();
    this.replayed = null;
    if (!this.vibration.clip) this.moment = null;
    this.writeLegend(); // before the fit: it takes a part of the canvas's height
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
    const tip = this.tip(); // while it is dragged, the picture stays
    if (this.held !== "tip" && (tip.x < 0 || tip.y < 0 || tip.x > width || tip.y > height)) return false;
    return far > 0.12;
  }

  /** Make the device, its wall, the direction's arrow and the map, if there is one, fill the picture. @param {string} device */
  fit(device) {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height) return;
    const { map } = this;
    const points = [...this.points("strokes"), ...this.points("base"), 0, 0, 0];
    for (const x of map ? [map.x[0], map.x.at(-1) ?? 0] : []) {
      for (const y of map ? [map.y[0], map.y.at(-1) ?? 0] : []) points.push(...placeOf(/** @type {import("./map_drawing.js").Grid} */ (map), x, y));
    }
    const handle = this.points("handle");
    const round = aroundHandle(this); // in pixels, so that their share of the picture follows from the scale that is sought
    const spread = (/** @type {Vector} */ axis) => {
      const along = (/** @type {ArrayLike<number>} */ p, at = 0) => axis[0] * p[at] + axis[1] * p[at + 1] + axis[2] * p[at + 2];
      const values = round.map((shift) => along(handle) + along(shift) / this.scale);
      for (let i = 0; i < points.length; i += 3) values.push(along(points, i));
      const [low, high] = [Math.min(...values), Math.max(...values)];
      return { size: Math.max(high - low, 1e-3), middle: (low + high) / 2 };
    };
    const [right, up] = this.view();
    const top = map ? MARGIN.key : MARGIN.top;
    const room = { width: Math.max(width - 2 * MARGIN.side, 1.5 * ARROW), height: Math.max(height - top - MARGIN.bottom, 1.5 * ARROW) };
    this.scale = Math.min(room.width, room.height) / Math.max(...points.map(Math.abs), 1e-3);
    for (let n = 0; n < 20; n++) this.scale = Math.min(room.width / spread(right).size, room.height / spread(up).size);
    const [a, b] = [spread(right), spread(up)];
    b.middle += (top - MARGIN.bottom) / 2 / this.scale;
    this.middle = /** @type {Vector} */ ([0, 1, 2].map((k) => a.middle * right[k] + b.middle * up[k]));
    this.kept = device;
    this.fitted = { size: `${width} ${height}`, map };
  }

  /** Which link has which colour, where there is more than one that is seen. */
  writeLegend() {
    const { names, styles } = this.scene ?? {};
    const seen = this.scene?.kind === "mechanism" ? [...new Set(segmentsOf(this.points("strokes_ends")).map(({ link }) => link))] : [];
    /** @type {Map<string, {colour: string, dash: number[]}>} */
    const links = new Map(seen.map((link) => [names[link], linkStyle(styles[link])]));
    this.legend.replaceChildren(...(links.size > 1 ? [...links] : []).map(([name, { colour, dash }]) => {
      const item = document.createElement("li");
      const swatch = document.createElement("span");
      swatch.style.borderTop = `3px ${dash.length ? "dashed" : "solid"} var(--${colour})`;
      item.append(swatch, name);
      return item;
    }));
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
    const shift = this.shift(this.points("direction"));
    return { x: handle.x + ARROW * shift.x, y: handle.y + ARROW * shift.y };
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
    else this.turn(-0.01 * dx, 0.01 * dy);
  }

  /** Turn a spatial device about z, and tilt it. @param {number} turned  [rad] @param {number} tilted */
  turn(turned, tilted) {
    if (this.scene.planar) return;
    this.turned += turned;
    this.tilted = Math.min(Math.max(this.tilted + tilted, -STEEPEST), STEEPEST);
    this.draw();
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
    /** @type {{[key: string]: [number, number]}} */
    const turns = { ",": [TURN, 0], ".": [-TURN, 0], "<": [0, -TURN], ">": [0, TURN] };
    if (moves[event.key]) {
      event.preventDefault();
      this.move(...moves[event.key]);
    } else if (turns[event.key]) {
      this.turn(...turns[event.key]);
    } else if (event.key === "[" || event.key === "]") {
      const turn = event.key === "[" ? -TURN : TURN;
      const [right, up] = this.view();
      const { x, y } = this.shift(this.points("direction"));
      const angle = Math.atan2(-y, x) + turn;
      const direction = /** @type {Vector} */ ([0, 1, 2].map((k) => Math.cos(angle) * right[k] + Math.sin(angle) * up[k]));
      this.listeners.onDirection(direction, "direction");
    }
  }

  draw() {
    const { context, width, height } = fitCanvas(this.canvas);
    const colours = /** @type {any} */ (palette(this.canvas));
    const scene = this.scene;
    if (!scene) return;
    this.labels.begin(context, width, height);
    if (scene.kind === "chain") this.drawChain(context, width, height, colours);
    else if (scene.kind !== "mechanism") drawText(context, scene.reason ?? "a device without a picture: it is given by numbers or by a response", width / 2, height / 2, { align: "center", colour: colours.grey });
    else this.drawPosture(context, width, height, colours);
  }

  /** @param {CanvasRenderingContext2D} context @param {number} width @param {number} height @param {any} colours */
  drawPosture(context, width, height, colours) {
    const { planar } = this.scene;
    const another = this.map && this.map !== this.fitted.map; // a map that goes leaves the device where it is
    if (another || this.fitted.size !== `${width} ${height}`) this.fit(this.kept);
    if (this.map) drawMap(context, this, this.map);
    if (planar) drawPlane(context, this, width, height, colours);
    const top = this.map ? drawKey(context, this, this.map, width, colours) : 0;
    drawMechanism(context, this, colours);
    drawForces(context, this, width, top, colours);
    if (!planar) drawScale(context, this, width, height, colours);
    this.writeCaption(width, height, top, colours);
    nameParts(this, colours);
  }

  /** @param {number} width @param {number} height @param {number} top  where the canvas is free @param {any} colours */
  writeCaption(width, height, top, colours) {
    const caption = this.caption();
    const layouts = caption ? [[caption], inLines(caption, (line) => line.length <= NARROW)] : [];
    const style = { colour: colours.ink, halo: colours.surface };
    const places = layouts.flatMap((lines, rank) => {
      const size = this.labels.sizeOf(lines, style);
      const at = /** @type {[number, number, CanvasTextAlign][]} */ ([[(width - size.width) / 2, height - 21 - size.height, "center"], [4, this.scene.planar ? 20 : 2, "left"], [width, top + 2, "right"]]);
      return at.map(([left, top, align], n) => ({ lines, align, left, top, ...size, cost: 3 * rank + n }));
    });
    if (caption) this.labels.writeIn("caption", places, style);
  }

  /** What has been done to the picture of a vibration, or why there is none. */
  caption() {
    if (this.scene?.still) return this.scene.still;
    if (!this.moment) return "";
    const size = this.vibration.clip?.size ?? 0;
    const most = this.scene.kind === "chain" ? quantity(size, this.scene.turns ? "rad" : "m", 2) : "";
    return captionOf(this.moment.gain, this.calm.matches ? 0 : this.moment.slower, most);
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
      const lines = [stiffness[k] > 0 ? quantity(stiffness[k], "N/m") : "", damping[k] > 0 ? quantity(damping[k], "N s/m") : ""].filter(Boolean);
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
    this.writeCaption(width, height, 0, colours);
  }
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
