/** The chosen wall below the chart: its two fields, and its verdict. */

import { number, quantity } from "./canvas.js";
import { typedNumber } from "./typed_number.js";

/** @typedef {import("./state.js").Wall} Wall */

const LARGEST = 1e15; // beyond, the server takes no number

export class WallFields {
  /**
   * @param {{stiffness: HTMLInputElement, damping: HTMLInputElement, stiffnessUnit: HTMLElement, dampingUnit: HTMLElement,
   *   verdict: HTMLElement}} elements
   * @param {{onWall: (wall: Wall | null) => void, say: (sentence: string, wrong: boolean) => void}} listeners
   */
  constructor(elements, listeners) {
    this.elements = elements;
    this.listeners = listeners;
    /** Fields in which something was typed that is no part of a wall yet: an answer that comes meanwhile leaves them. */
    this.typed = new Set();
    this.written = "";
    for (const field of [elements.stiffness, elements.damping]) {
      field.addEventListener("input", () => this.typed.add(field));
      field.addEventListener("change", () => this.read(field));
    }
  }

  /** Take over what was typed; the other field, where it is still empty, is 0. @param {HTMLInputElement} typed */
  read(typed) {
    const { stiffness, damping } = this.elements;
    if (!stiffness.value.trim() && !damping.value.trim()) {
      this.typed.clear();
      this.listeners.onWall(null);
      return;
    }
    const value = (/** @type {HTMLInputElement} */ field) => (field !== typed && !field.value.trim() ? 0 : typedNumber(field.value));
    for (const [field, name, example, unit] of /** @type {[HTMLInputElement, string, string, HTMLElement][]} */ ([
      [stiffness, "K", "4000", this.elements.stiffnessUnit],
      [damping, "B", "10", this.elements.dampingUnit],
    ])) {
      if (Math.abs(value(field)) <= LARGEST) continue;
      this.listeners.say(`${name} of the wall is a number in ${unit.textContent}, such as ${example}, up to 1e15; got "${field.value}"`, true);
      return;
    }
    this.typed.clear();
    this.listeners.onWall({ stiffness: value(stiffness), damping: value(damping) });
  }

  /**
   * @param {Wall | null} wall
   * @param {any} found  what the view says of it
   * @param {{K: string, B: string}} units
   */
  write(wall, found, units) {
    const { stiffness, damping, stiffnessUnit, dampingUnit, verdict } = this.elements;
    const chosen = JSON.stringify(wall);
    if (chosen !== this.written) this.typed.clear();
    this.written = chosen;
    const show = (/** @type {HTMLInputElement} */ field, /** @type {number | undefined} */ value) => {
      if (document.activeElement !== field && !this.typed.has(field)) field.value = value === undefined ? "" : String(Number(value.toPrecision(4)));
    };
    show(stiffness, wall?.stiffness);
    show(damping, wall?.damping);
    stiffnessUnit.textContent = units.K;
    dampingUnit.textContent = units.B;
    verdict.className = found?.verdict ?? "";
    verdict.textContent = !wall ? "choose a wall on the chart" : !found ? "" : sentenceOf(found);
  }
}

/** @param {{verdict: string, frequency: number, spectral_radius: number | null, unheld_positions: number}} found */
function sentenceOf({ verdict, frequency, spectral_radius: radius, unheld_positions: unheld }) {
  const stable = verdict === "stable";
  const motion = verdict === "undecided" ? "on the edge" : frequency > 0 ? `${stable ? "slowest motion" : "oscillates"} at ${quantity(frequency, "Hz")}` : `${stable ? "slowest motion" : "moves away"} without oscillation`;
  return `${verdict}, ${motion}${radius === null ? "" : `, |z| ${number(radius, 5)}`}${unheld ? "; K = 0 holds no position: that root is set aside" : ""}`;
}
