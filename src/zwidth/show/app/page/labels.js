/**
 * Texts of a picture: each is kept clear of those before it, of the points to be avoided, and of the picture's edge.
 */

import { drawText, FONT_SIZE, textWidth } from "./canvas.js";

/** @typedef {import("./canvas.js").TextStyle} TextStyle */
/** @typedef {{x: number, y: number}} Place  css px */
/** @typedef {{left: number, top: number, width: number, height: number}} Box  css px */
/**
 * A text that is drawn, and its box [css px].
 *
 * @typedef {{text: string, left: number, top: number, right: number, bottom: number}} Label
 */

const LINE = 1.25; // height of a line in sizes of its letters
const ASCENT = 0.95; // of that size, above the line that the letters stand on
const EDGE = 2; // css px between a text and the picture's edge
const AROUND = 12; // directions in which a text is tried
const GAPS = [4, 14, 28]; // css px between a text and what it names
// Costs of a place: letters over letters are worst, then a covered joint, then each 8 px of a line, then a long way.
const COST = { text: 100, disc: 50, point: 3, pixel: 0.5, upright: 4, layout: 6, rival: 30 };
const CLEARER = 10; // css px by which a text is nearer to what it names than to another thing that has a name
const KEPT = 10; // what another place must save before a text goes there, so that none jumps to and fro in a drag

export class Labels {
  constructor() {
    /** @type {Label[]} */
    this.written = [];
    /** @type {(Place & {radius: number})[]} */
    this.discs = [];
    /** @type {Place[]} */
    this.points = [];
    /** @type {Map<string, number>} */
    this.chosen = new Map(); // which of its places each has
  }

  /** Begin a picture anew. @param {CanvasRenderingContext2D} context @param {number} width @param {number} height */
  begin(context, width, height) {
    this.context = context;
    this.width = width;
    this.height = height;
    this.written = [];
    this.discs = [];
    this.points = [];
  }

  /** Keep later texts off a disc. @param {Place} place @param {number} radius */
  avoidDisc({ x, y }, radius) {
    this.discs.push({ x, y, radius });
  }

  /** Keep later texts off a line. @param {Place} from @param {Place} to */
  avoidLine(from, to) {
    const count = Math.ceil(Math.hypot(to.x - from.x, to.y - from.y) / 8);
    for (let k = 0; k <= count; k++) {
      const share = count ? k / count : 0;
      this.points.push({ x: from.x + share * (to.x - from.x), y: from.y + share * (to.y - from.y) });
    }
  }

  /** Write a text where it is said, but not if it must be free of others and is not. @param {string} text @param {number} x @param {number} y @param {TextStyle & {free?: boolean}} style */
  write(text, x, y, style) {
    const context = /** @type {CanvasRenderingContext2D} */ (this.context);
    const size = style.size ?? FONT_SIZE;
    const width = textWidth(context, text, style);
    const left = style.align === "right" ? x - width : style.align === "center" ? x - width / 2 : x;
    const label = { text, left, right: left + width, top: y - ASCENT * size, bottom: y + (LINE - ASCENT) * size };
    if (style.free && (this.overlapped(label) || this.outside(label))) return;
    drawText(context, text, x, y, style);
    this.written.push(label);
  }

  /**
   * Write lines beside a disc, where they cover least.
   *
   * @param {string} name  by which its place is remembered
   * @param {string[][]} layouts  the lines, and other lines for the same, the better ones first
   * @param {Place} anchor
   * @param {number} radius  [css px]
   * @param {TextStyle} style
   * @param {Place[]} others  which must not seem to be named
   */
  writeBeside(name, layouts, anchor, radius, style, others) {
    const places = layouts.flatMap((lines, rank) => {
      const { width, height } = this.sizeOf(lines, style);
      return Array.from({ length: AROUND * GAPS.length }, (_, n) => {
        const angle = (2 * Math.PI * n) / AROUND;
        const gap = radius + GAPS[Math.floor(n / AROUND)];
        const [ux, uy] = [Math.cos(angle), Math.sin(angle)];
        const [sx, sy] = [ux, uy].map((u) => (Math.abs(u) > 0.3 ? Math.sign(u) : 0)); // which side of the text is near
        const align = /** @type {CanvasTextAlign} */ (sx < 0 ? "right" : sx ? "left" : "center");
        const box = { left: anchor.x + gap * ux + ((sx - 1) * width) / 2, top: anchor.y + gap * uy + ((sy - 1) * height) / 2, width, height };
        const rivals = others.filter((other) => away(other, box) < away(anchor, box) + CLEARER).length;
        return { lines, align, ...box, cost: COST.pixel * gap + (sx ? 0 : COST.upright) + COST.layout * rank + COST.rival * rivals };
      });
    });
    this.writeIn(name, places, style);
  }

  /** Write lines in that of some boxes in which they cover least. @param {string} name @param {(Box & {lines: string[], align: CanvasTextAlign, cost: number})[]} places @param {TextStyle} style */
  writeIn(name, places, style) {
    const { lines, align, left, top, width } = this.choose(name, places);
    const size = style.size ?? FONT_SIZE;
    const x = align === "right" ? left + width : align === "center" ? left + width / 2 : left;
    lines.forEach((line, row) => this.write(line, x, top + (LINE * row + ASCENT) * size, { ...style, align }));
  }

  /** Width and height of lines [css px]. @param {string[]} lines @param {TextStyle} style */
  sizeOf(lines, style) {
    const context = /** @type {CanvasRenderingContext2D} */ (this.context);
    return { width: Math.max(...lines.map((line) => textWidth(context, line, style))), height: LINE * (style.size ?? FONT_SIZE) * lines.length };
  }

  /**
   * Of the boxes in which something may be drawn that which covers least, moved into the picture.
   *
   * @template {Box & {cost: number}} T
   * @param {string} name  by which the choice is remembered
   * @param {T[]} places   with what each costs even if it covers nothing
   * @returns {T}
   */
  choose(name, places) {
    const tried = places.map((place, n) => {
      const left = Math.max(Math.min(place.left, /** @type {number} */ (this.width) - EDGE - place.width), EDGE);
      const top = Math.max(Math.min(place.top, /** @type {number} */ (this.height) - EDGE - place.height), EDGE);
      const moved = Math.hypot(left - place.left, top - place.top);
      const box = { left, top, right: left + place.width, bottom: top + place.height };
      const cut = this.outside(box) ? COST.text : 0; // it is larger than the picture
      return { ...place, left, top, n, cost: place.cost + COST.pixel * moved + this.covered(box) + cut - (this.chosen.get(name) === n ? KEPT : 0) };
    });
    const best = tried.reduce((one, other) => (other.cost < one.cost ? other : one));
    this.chosen.set(name, best.n);
    return best;
  }

  /** What a text in this box would hide. @param {Omit<Label, "text">} box */
  covered(box) {
    const near = (/** @type {Place} */ { x, y }, /** @type {number} */ radius) => x > box.left - radius && x < box.right + radius && y > box.top - radius && y < box.bottom + radius;
    const discs = this.discs.filter((disc) => near(disc, disc.radius)).length;
    const points = this.points.filter((point) => near(point, 4)).length;
    return COST.text * this.overlapped(box) + COST.disc * discs + COST.point * points;
  }

  /** How many texts lie in a box. @param {Omit<Label, "text">} box */
  overlapped(box) {
    return this.written.filter((one) => one.left < box.right + 2 && one.right > box.left - 2 && one.top < box.bottom && one.bottom > box.top).length;
  }

  /** @param {Omit<Label, "text">} box */
  outside(box) {
    return box.left < 0 || box.top < 0 || box.right > /** @type {number} */ (this.width) || box.bottom > /** @type {number} */ (this.height);
  }
}

/** How far a place is from a box [css px]. @param {Place} place @param {Box} box */
function away({ x, y }, { left, top, width, height }) {
  return Math.hypot(Math.max(left - x, x - left - width, 0), Math.max(top - y, y - top - height, 0));
}
