/**
 * A mechanism in its posture, farthest parts first: base, links, joints, the wall across the rendered direction, handle.
 *
 * Colours of links have the meaning and the order that they have in the figures of reports.
 */

import { quantity } from "./canvas.js";

/** @typedef {import("./device_view.js").DeviceView} DeviceView */
/** @typedef {import("./state.js").Vector} Vector */
/** @typedef {{x: number, y: number}} Place  css px */
/** @typedef {{link: number, from: number, to: number}} Segment  numbers of a link and of two points of its stroke */
/**
 * A part of the picture.
 *
 * @typedef {object} Part
 * @property {number} depth     [m] towards the eye
 * @property {boolean} beyond   whether it is on the other side of the wall
 * @property {() => void} draw
 */

const COLOURS = ["ink", "blue", "vermilion", "green", "purple", "orange"];
const DASH = [8, 6]; // css px, of links when the colours have been used up
const BAND = 11; // css px, width of a link
const DOT = { joints: 5, driven: 6, handle: 9 }; // css px, radii
const WALL = { half: 50, hatch: 8, deep: 12 }; // css px: half a side, between hatches, and into the wall
const GROUND = { half: 13, below: 13, hatch: 6 }; // css px: half its width, below the joint, and its hatches
const SAME_POINT = 1e-6; // share of the mechanism's size below which points are one
export const ARROW = 74; // css px

/** Colour and dashes of a link. @param {number} style */
export function linkStyle(style) {
  return { colour: COLOURS[style % COLOURS.length], dash: style < COLOURS.length ? [] : DASH };
}

/** Segments of all links. A stroke goes from its link's joint to a place and back, to the next place and back. @param {ArrayLike<number>} ends @returns {Segment[]} */
export function segmentsOf(ends) {
  return Array.from(ends).flatMap((end, link) => {
    const start = link ? ends[link - 1] : 0;
    return Array.from({ length: Math.floor((end - start) / 2) }, (_, k) => ({ link, from: start + 2 * k, to: start + 2 * k + 1 }));
  });
}

/** What is beyond the wall first, and of each side the farthest first. @template {{depth: number, beyond: boolean}} T @param {T[]} parts @returns {T[]} */
export function inOrder(parts) {
  return [...parts].sort((a, b) => Number(b.beyond) - Number(a.beyond) || a.depth - b.depth);
}

/** Draw all of it but the texts, and tell the labels where it is. @param {CanvasRenderingContext2D} context @param {DeviceView} view @param {any} colours */
export function drawMechanism(context, view, colours) {
  const parts = inOrder([...links(context, view, colours), ...dots(context, view, colours)]);
  context.lineCap = "round";
  context.lineJoin = "round";
  drawBase(context, view, colours);
  for (const part of parts) if (part.beyond) part.draw();
  if (!view.scene.turns) drawWall(context, view, colours);
  for (const part of parts) if (!part.beyond) part.draw();
  drawHandle(context, view, colours);
}

/** @param {CanvasRenderingContext2D} context @param {DeviceView} view @param {any} colours @returns {Part[]} */
function links(context, view, colours) {
  const [still, drawn] = [view.points("strokes"), view.drawnPoints("strokes")];
  return segmentsOf(view.points("strokes_ends")).map(({ link, from, to }) => {
    const middle = [0, 1, 2].map((k) => (still[3 * from + k] + still[3 * to + k]) / 2);
    const [a, b] = [view.place(drawn, 3 * from), view.place(drawn, 3 * to)];
    view.labels.avoidLine(view.place(still, 3 * from), view.place(still, 3 * to));
    const { colour, dash } = linkStyle(view.scene.styles[link]);
    const draw = () => {
      // what is farther shows through no link: each covers it before it is tinted
      for (const [stroke, width, alpha] of [[colours.surface, BAND, 1], [colours[colour], BAND, 0.3], [colours[colour], 3, 1]]) {
        context.strokeStyle = stroke;
        context.lineWidth = width;
        context.globalAlpha = alpha;
        context.setLineDash(width === BAND ? [] : dash);
        context.beginPath();
        context.moveTo(a.x, a.y);
        context.lineTo(b.x, b.y);
        context.stroke();
      }
      context.setLineDash([]);
    };
    return { depth: depthOf(view, middle), beyond: isBeyond(view, middle), draw };
  });
}

/** Joints, each in front of the links that meet there. @param {CanvasRenderingContext2D} context @param {DeviceView} view @param {any} colours @returns {Part[]} */
function dots(context, view, colours) {
  const strokes = view.points("strokes");
  const size = strokes.reduce((most, value) => Math.max(most, Math.abs(value)), 0);
  const segments = segmentsOf(view.points("strokes_ends"));
  return /** @type {("joints" | "driven")[]} */ (["joints", "driven"]).flatMap((name) => {
    const [still, drawn] = [view.points(name), view.drawnPoints(name)];
    return Array.from({ length: still.length / 3 }, (_, n) => {
      const point = [...still.subarray(3 * n, 3 * n + 3)];
      const ends = (/** @type {number} */ i) => Math.hypot(...point.map((value, k) => value - strokes[3 * i + k])) <= SAME_POINT * size;
      const meeting = segments.filter(({ from, to }) => ends(from) || ends(to));
      const middles = meeting.map(({ from, to }) => point.map((_, k) => (strokes[3 * from + k] + strokes[3 * to + k]) / 2));
      view.labels.avoidDisc(view.place(still, 3 * n), DOT[name]);
      return {
        depth: Math.max(...[point, ...middles].map((p) => depthOf(view, p))),
        beyond: [point, ...middles].every((p) => isBeyond(view, p)),
        draw: () => disc(context, view.place(drawn, 3 * n), DOT[name], name === "driven" ? colours.blue : colours.surface, colours.ink, 1.5),
      };
    });
  });
}

/** How far a point lies towards the eye [m]. @param {DeviceView} view @param {ArrayLike<number>} p */
function depthOf(view, p) {
  const eye = view.view()[2];
  return eye[0] * p[0] + eye[1] * p[1] + eye[2] * p[2];
}

/** Whether the wall, if there is one, lies between a point and the eye. @param {DeviceView} view @param {ArrayLike<number>} p */
function isBeyond(view, p) {
  if (view.scene.turns) return false;
  const [handle, normal] = [view.points("handle"), view.points("direction")];
  const distance = normal.reduce((sum, value, k) => sum + value * (p[k] - handle[k]), 0);
  const faced = depthOf(view, normal);
  return Math.abs(faced) > SAME_POINT && distance * Math.sign(faced) < -SAME_POINT;
}

/** The ground under the joints that it holds. @param {CanvasRenderingContext2D} context @param {DeviceView} view @param {any} colours */
function drawBase(context, view, colours) {
  const { half, below, hatch } = GROUND;
  const base = view.points("base");
  for (const { x, y } of gathered(Array.from({ length: base.length / 3 }, (_, n) => view.place(base, 3 * n)))) {
    const ground = y + below;
    context.strokeStyle = colours.grey;
    context.lineWidth = 1;
    context.beginPath();
    for (let at = x - half; at < x + half - 1; at += hatch) {
      context.moveTo(at + hatch, ground);
      context.lineTo(at, ground + hatch);
    }
    context.stroke();
    context.lineWidth = 1.5;
    context.beginPath();
    context.moveTo(x - half, ground);
    context.lineTo(x + half, ground);
    context.moveTo(x - 0.6 * half, ground);
    context.lineTo(x, y);
    context.lineTo(x + 0.6 * half, ground);
    context.stroke();
    for (const side of [-half, half]) view.labels.avoidDisc({ x: x + side, y: ground + hatch / 2 }, hatch);
  }
}

/** Places without those that are seen at another one. @template {Place} T @param {T[]} places @returns {(T & {all: T[]})[]}  the first of each group, with all of them */
export function gathered(places) {
  /** @type {(T & {all: T[]})[]} */
  const groups = [];
  for (const place of places) {
    const group = groups.find(({ x, y }) => Math.hypot(place.x - x, place.y - y) < DOT.driven);
    if (group) group.all.push(place);
    else groups.push({ ...place, all: [place] });
  }
  return groups;
}

/** Two unit vectors across another one. @param {ArrayLike<number>} normal @returns {[Vector, Vector]} */
export function tangents(normal) {
  const sizes = Array.from(normal, Math.abs);
  const k = sizes.lastIndexOf(Math.min(...sizes)); // the axis that is farthest from the normal
  const rest = [0, 1, 2].map((n) => (n === k ? 1 : 0) - normal[k] * normal[n]);
  const first = /** @type {Vector} */ (rest.map((value) => value / Math.hypot(...rest)));
  return [first, cross(/** @type {Vector} */ (Array.from(normal)), first)];
}

/** @param {Vector} a @param {Vector} b @returns {Vector} */
export function cross(a, b) {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

/** What is drawn round the handle in its own size: the ends of the arrow and of the wall [css px]. @param {DeviceView} view @returns {Vector[]} */
export function aroundHandle(view) {
  const normal = /** @type {Vector} */ ([...view.points("direction")]);
  const times = (/** @type {Vector} */ vector, /** @type {number} */ factor) => /** @type {Vector} */ (vector.map((value) => factor * value));
  const wall = view.scene.turns ? [] : tangents(normal).flatMap((one) => [times(one, WALL.half), times(one, -WALL.half)]);
  return [[0, 0, 0], times(normal, ARROW), ...wall];
}

/** A square of the wall at the handle, hatched, with its depth behind it. @param {CanvasRenderingContext2D} context @param {DeviceView} view @param {any} colours */
function drawWall(context, view, colours) {
  const normal = /** @type {Vector} */ ([...view.points("direction")]);
  const { half, hatch, deep } = WALL;
  const handle = view.place(view.points("handle"));
  const shifts = [...tangents(normal), normal].map((vector) => view.shift(vector));
  const [along, across] = shifts.slice(0, 2).sort((a, b) => Math.hypot(b.x, b.y) - Math.hypot(a.x, a.y)); // seen longest first
  const at = (/** @type {number} */ a, /** @type {number} */ b, into = 0) => ({ x: handle.x + a * along.x + b * across.x + into * shifts[2].x, y: handle.y + a * along.y + b * across.y + into * shifts[2].y });
  const polygon = (/** @type {Place[]} */ corners) => {
    context.beginPath();
    corners.forEach(({ x, y }, n) => (n ? context.lineTo(x, y) : context.moveTo(x, y)));
    context.closePath();
  };
  const corners = [at(-half, -half), at(half, -half), at(half, half), at(-half, half)];
  polygon(corners);
  context.fillStyle = colours.surface;
  context.globalAlpha = view.map ? 0.15 : 0.6; // links beyond it are seen through it, and a map all the more
  context.fill();
  context.globalAlpha = 1;
  context.strokeStyle = colours.grey;
  context.lineWidth = 1;
  context.beginPath();
  for (const side of [-half, half]) {
    for (let a = -half; a < half; a += hatch) line(context, at(a + hatch, side), at(a, side, deep));
  }
  context.stroke();
  context.globalAlpha = 0.5;
  context.beginPath();
  for (let a = 2 * hatch - 2 * half; a < 2 * half; a += 2 * hatch) {
    const [low, high] = [Math.max(-half, a - half), Math.min(half, a + half)]; // where a + b = a diagonal leaves the square
    line(context, at(low, a - low), at(high, a - high));
  }
  context.stroke();
  context.globalAlpha = 1;
  corners.forEach((corner, n) => view.labels.avoidLine(corner, corners[(n + 1) % 4]));
  polygon(corners);
  context.strokeStyle = colours.ink;
  context.lineWidth = 2;
  context.stroke();
}

/** @param {CanvasRenderingContext2D} context @param {DeviceView} view @param {any} colours */
function drawHandle(context, view, colours) {
  const handle = view.place(view.points("handle"));
  arrow(context, handle, view.tip(), colours.vermilion, 2.5);
  disc(context, view.place(view.drawnPoints("handle")), DOT.handle, colours.vermilion, colours.surface, 2);
  view.labels.avoidDisc(handle, DOT.handle);
  view.labels.avoidLine(handle, view.tip());
}

/** Names of the direction and, at their joints, of the drives. @param {DeviceView} view @param {any} colours */
export function nameParts(view, colours) {
  const { scene, labels } = view;
  const words = scene.turns ? ["axis", "of moments"] : ["rendered", "direction"];
  labels.writeBeside("direction", [[words.join(" ")], words], view.tip(), 4, { colour: colours.vermilion, halo: colours.surface }, []);
  const driven = view.points("driven");
  const places = scene.drives.map((/** @type {string} */ name, /** @type {number} */ n) => ({ ...view.place(driven, 3 * n), name }));
  const groups = gathered(places);
  for (const group of groups) {
    const names = group.all.map((one, n, all) => /** @type {any} */ (one).name + (n < all.length - 1 ? "," : ""));
    const halves = [names.slice(0, Math.ceil(names.length / 2)), names.slice(Math.ceil(names.length / 2))].map((half) => half.join(" "));
    const layouts = names.length > 2 ? [[names.join(" ")], halves, names] : [[names.join(" ")], names];
    labels.writeBeside(names.join(" "), layouts.slice(0, names.length), group, DOT.driven, { colour: colours.ink, halo: colours.surface }, groups.filter((other) => other !== group));
  }
}

/** Gravity and the hand's force, where they are given, one below the other. @param {CanvasRenderingContext2D} context @param {DeviceView} view @param {number} right  [css px] @param {number} top @param {any} colours */
export function drawForces(context, view, right, top, colours) {
  const load = view.scene.load;
  if (!load) return;
  const at = { x: right - 22, y: top + 18 };
  for (const [name, value, unit, colour] of [["load", load.force, "N", colours.purple], ["gravity", load.gravity, "m/s²", colours.orange]]) {
    const size = value ? Math.hypot(...value) : 0;
    if (!size) continue;
    const shift = view.shift(value.map((/** @type {number} */ each) => each / size));
    arrow(context, { x: at.x - 16 * shift.x, y: at.y - 16 * shift.y }, { x: at.x + 16 * shift.x, y: at.y + 16 * shift.y }, colour, 2);
    view.labels.write(`${name} ${quantity(size, unit, 3)}`, at.x - 20, at.y + 4, { align: "right", colour, halo: colours.surface });
    at.y += 38;
  }
}

/** @param {CanvasRenderingContext2D} context @param {Place} from @param {Place} to */
export function line(context, from, to) {
  context.moveTo(from.x, from.y);
  context.lineTo(to.x, to.y);
}

/** @param {CanvasRenderingContext2D} context @param {Place} place @param {number} radius @param {string} fill @param {string} edge @param {number} width */
function disc(context, { x, y }, radius, fill, edge, width) {
  context.fillStyle = fill;
  context.strokeStyle = edge;
  context.lineWidth = width;
  context.globalAlpha = 1;
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  context.fill();
  context.stroke();
}

/** @param {CanvasRenderingContext2D} context @param {Place} from @param {Place} to @param {string} colour @param {number} width */
export function arrow(context, from, to, colour, width) {
  const length = Math.hypot(to.x - from.x, to.y - from.y);
  context.strokeStyle = colour;
  context.fillStyle = colour;
  context.lineWidth = width;
  if (length < 3) {
    context.beginPath();
    context.arc(from.x, from.y, 15, 0, 2 * Math.PI);
    context.stroke();
    return;
  }
  const [ux, uy] = [(to.x - from.x) / length, (to.y - from.y) / length];
  const head = Math.min(11, length / 2);
  context.beginPath();
  line(context, from, { x: to.x - head * ux, y: to.y - head * uy });
  context.stroke();
  context.beginPath();
  context.moveTo(to.x, to.y);
  context.lineTo(to.x - head * ux - 0.5 * head * uy, to.y - head * uy + 0.5 * head * ux);
  context.lineTo(to.x - head * ux + 0.5 * head * uy, to.y - head * uy - 0.5 * head * ux);
  context.fill();
}
