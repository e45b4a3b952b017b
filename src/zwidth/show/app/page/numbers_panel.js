/**
 * The numbers of the device as sliders and fields, grouped as in its file, or the most influential first.
 *
 * Rows are made once for a device and then only changed, so that a drag never loses its slider. A number that is changed
 * for the first time may bring others with it, as the time constant of a filter brings its type: their rows come when the
 * drag has ended.
 */

import { number, quantity } from "./canvas.js";
import { typedNumber } from "./typed_number.js";

/**
 * @typedef {object} DeviceNumber
 * @property {string} path
 * @property {string[]} group
 * @property {string} name
 * @property {any} value
 * @property {string} unit
 * @property {string} description
 * @property {string} source
 * @property {number | null} low       of the slider
 * @property {number | null} high
 * @property {"linear" | "logarithmic"} scale
 * @property {boolean} whole
 * @property {number | null} lowest    that is allowed
 * @property {number | null} highest
 * @property {string[]} excluded       which of these two are not allowed themselves
 * @property {string[] | null} choices
 * @property {{[choice: string]: {[path: string]: any}}} brings  what each choice sets beside itself; null: removed
 * @property {string[]} also           paths that change with it
 * @property {boolean} given           whether the file gives it
 */
/** @typedef {{path: string, d_ln_stiffness_max_d_ln_value: number | null, unit: string | null}} Sensitivity */
/** @typedef {{path: string, value: number | null, status: string, reason?: string | null}} GoalNumber */

const STEPS = 1000; // of a slider

export class NumbersPanel {
  /**
   * @param {HTMLElement} element
   * @param {{onNumber: (settings: {[path: string]: any}, drag?: string) => void, onRelease: () => void}} listeners
   */
  constructor(element, listeners) {
    this.element = element;
    this.listeners = listeners;
    /** @type {DeviceNumber[]} */
    this.numbers = [];
    /** @type {Map<string, {row: HTMLElement, slider: HTMLInputElement | null, field: HTMLInputElement | HTMLSelectElement,
     *   note: HTMLElement, number: DeviceNumber}>} */
    this.rows = new Map();
    /** @type {{[path: string]: any}} */
    this.settings = {};
    /** @type {Sensitivity[] | null} */
    this.order = null;
    /** @type {Map<string, GoalNumber>} */
    this.goal = new Map();
    this.filter = "";
    this.dragging = false;
    this.computedFor = "{}"; // settings of the order and the goal
    this.late = false; // whether numbers have changed since
    this.outdated = false; // rows that are to be made anew after the drag
  }

  /**
   * @param {DeviceNumber[]} numbers
   * @param {{[path: string]: any}} settings
   * @param {boolean} another  whether the device is another one; otherwise sliders keep their ends
   */
  setNumbers(numbers, settings, another) {
    const before = new Map(another ? [] : this.numbers.map((of) => [of.path, of]));
    this.numbers = numbers.map((of) => before.get(of.path) ?? of);
    this.settings = settings;
    if (before.size === numbers.length && numbers.every((of) => before.has(of.path))) this.update(settings);
    else if (this.dragging) this.outdated = true;
    else this.build();
  }

  /** @param {Sensitivity[] | null} order  null: as in the file @param {object} settings  for which it was computed */
  sortBy(order, settings = this.settings) {
    this.order = order;
    this.computedFor = JSON.stringify(settings);
    this.build();
  }

  /** @param {GoalNumber[]} goal @param {object} settings  for which it was computed */
  setGoal(goal, settings) {
    this.goal = new Map(goal.map((each) => [each.path, each]));
    this.computedFor = JSON.stringify(settings);
    this.writeNotes();
  }

  /** Write what was computed of each number, and whether numbers have changed since. */
  writeNotes() {
    this.late = this.computedFor !== JSON.stringify(this.settings);
    for (const [path, { note, number: of }] of this.rows) this.writeNote(note, path, of);
  }

  /** @param {string} text */
  show(text) {
    this.filter = text.toLowerCase();
    this.build();
  }

  /** Take over changed values; a field that is typed into is left alone. @param {{[path: string]: any}} settings */
  update(settings) {
    this.settings = settings;
    for (const { number: of, slider, field, row } of this.rows.values()) {
      const value = this.valueOf(of);
      if (slider) slider.value = String(toSlider(of, value));
      if (document.activeElement !== field) {
        field.value = of.choices ? value : plain(value);
        field.setCustomValidity("");
      }
      if (slider) slider.setAttribute("aria-valuetext", quantity(value, of.unit));
      row.classList.toggle("changed", of.path in settings);
    }
    if (this.late !== (this.computedFor !== JSON.stringify(settings))) this.writeNotes();
  }

  /** @param {DeviceNumber} of */
  valueOf(of) {
    const value = this.settings[of.path];
    return value === undefined || value === null ? of.value : value;
  }

  build() {
    this.outdated = false;
    this.rows.clear();
    const focused = this.element.contains(document.activeElement) ? /** @type {HTMLInputElement} */ (document.activeElement) : null;
    const shown = this.numbers.filter((of) => `${of.path} ${of.name} ${of.group.join(" ")}`.toLowerCase().includes(this.filter));
    /** @type {HTMLElement[]} */
    const parts = [];
    if (this.order) {
      const rank = new Map(this.order.map((each, n) => [each.path, { n, each }]));
      const sorted = shown.filter((of) => rank.has(of.path)).sort((a, b) => (rank.get(a.path)?.n ?? 0) - (rank.get(b.path)?.n ?? 0));
      parts.push(this.groupOf("What to change first", sorted, true));
    } else {
      /** @type {Map<string, DeviceNumber[]>} */
      const groups = new Map();
      for (const of of shown) {
        const title = of.group.join(" › ");
        groups.set(title, [...(groups.get(title) ?? []), of]);
      }
      for (const [title, members] of groups) parts.push(this.groupOf(title, members, this.filter !== "" || members[0].group[0] === "loop"));
    }
    if (!shown.length && this.filter) {
      const none = document.createElement("p");
      none.textContent = `No number has “${this.filter}” in its name or group.`;
      parts.splice(0, parts.length, none);
    }
    const open = new Set([...this.element.querySelectorAll("details[open]")].map((each) => each.getAttribute("data-title")));
    this.element.replaceChildren(...parts);
    for (const each of this.element.querySelectorAll("details")) if (open.has(each.getAttribute("data-title"))) each.open = true;
    this.update(this.settings);
    const again = focused?.id ? /** @type {HTMLInputElement | null} */ (document.getElementById(focused.id)) : null;
    again?.focus({ preventScroll: true });
    if (again?.type === "text") again.value = focused?.value ?? ""; // that is being typed
  }

  /** @param {string} title @param {DeviceNumber[]} members @param {boolean} open */
  groupOf(title, members, open) {
    const group = document.createElement("details");
    group.open = open;
    group.dataset.title = title;
    const head = document.createElement("summary");
    head.textContent = title || "device";
    group.append(head, ...members.map((of) => this.rowOf(of)));
    return group;
  }

  /** @param {DeviceNumber} of */
  rowOf(of) {
    const row = document.createElement("div");
    row.className = "number";
    const name = document.createElement("label");
    name.textContent = this.order ? `${of.group.slice(1).join(" ")} ${of.name}`.trim() : of.name;
    name.title = [of.path, of.description, of.source && `source: ${of.source}`].filter(Boolean).join("\n");
    const id = `n-${of.path}`;
    name.htmlFor = id;
    const unit = document.createElement("span");
    unit.className = "unit";
    unit.textContent = of.unit === "1" ? "" : of.unit;
    const note = document.createElement("div");
    note.className = "note";
    const field = of.choices ? this.choiceOf(of) : this.fieldOf(of);
    field.id = id;
    const slider = of.choices || of.low === null || of.high === null ? null : this.sliderOf(of, name.textContent ?? "");
    row.append(name, field, ...(of.choices ? [] : [unit]));
    if (slider) row.append(slider);
    row.append(note);
    this.rows.set(of.path, { row, slider, field, note, number: of });
    this.writeNote(note, of.path, of);
    return row;
  }

  /** @param {HTMLElement} note @param {string} path @param {DeviceNumber} of */
  writeNote(note, path, of) {
    note.replaceChildren();
    const sensitive = this.order?.find((each) => each.path === path)?.d_ln_stiffness_max_d_ln_value;
    if (typeof sensitive === "number") {
      const bar = document.createElement("span");
      bar.className = sensitive < 0 ? "bar negative" : "bar";
      bar.style.setProperty("--share", `${Math.min(100, 30 * Math.abs(sensitive))}%`);
      note.append(bar, `+1 % gives ${sensitive < 0 ? "−" : "+"}${number(Math.abs(sensitive), 3)} % of stiffness`);
    }
    const goal = this.goal.get(path);
    if (this.late && (goal || typeof sensitive === "number")) note.prepend("before the last change: ");
    if (goal) {
      const button = document.createElement("button");
      button.type = "button";
      button.className = "reach";
      if (typeof goal.value === "number" && goal.status === "reached") {
        button.textContent = `goal at ${quantity(goal.value, of.unit)}`;
        const value = goal.value;
        button.addEventListener("click", () => this.listeners.onNumber(this.changeOf(of, value)));
        note.append(button);
      } else note.append(` ${goal.reason ?? "cannot reach the goal"}`);
    }
  }

  /** @param {DeviceNumber} of @param {any} value */
  changeOf(of, value) {
    return Object.fromEntries([of.path, ...of.also].map((path) => [path, value]));
  }

  /** @param {DeviceNumber} of */
  fieldOf(of) {
    const field = document.createElement("input");
    field.type = "text";
    field.inputMode = "decimal";
    field.autocomplete = "off";
    field.addEventListener("change", () => {
      const value = typedNumber(field.value);
      const wrong = this.fault(of, value, field.value);
      field.setCustomValidity(wrong);
      field.reportValidity();
      if (!wrong) this.listeners.onNumber(this.changeOf(of, value));
    });
    return field;
  }

  /**
   * What is wrong with a number that was typed; the server has the last word.
   *
   * @param {DeviceNumber} of @param {number} value @param {string} text
   */
  fault(of, value, text) {
    const unit = of.unit === "1" ? "" : of.unit;
    const limit = (/** @type {number | null} */ end) => `${end} ${unit}`.trim();
    if (!Number.isFinite(value)) return `${of.name} is a number${unit ? ` in ${unit}` : ""}, such as ${plain(this.valueOf(of))}; got "${text}"`;
    if (of.whole && !Number.isInteger(value)) return `${of.name} is a whole number, got ${text}`;
    const above = of.excluded.includes("lowest");
    const below = of.excluded.includes("highest");
    if (of.lowest !== null && (value < of.lowest || (above && value === of.lowest))) return `${of.name} is ${above ? "above" : "at least"} ${limit(of.lowest)}, got ${text}`;
    if (of.highest !== null && (value > of.highest || (below && value === of.highest))) return `${of.name} is ${below ? "below" : "at most"} ${limit(of.highest)}, got ${text}`;
    return "";
  }

  /** @param {DeviceNumber} of */
  choiceOf(of) {
    const choice = document.createElement("select");
    for (const each of of.choices ?? []) choice.append(new Option(each, each));
    choice.addEventListener("change", () => {
      const there = (/** @type {string} */ path) => path in this.settings || this.numbers.some((each) => each.given && each.path === path);
      const brought = Object.entries(of.brings[choice.value] ?? {}).filter(([path, value]) => value !== null || there(path));
      this.listeners.onNumber({ ...this.changeOf(of, choice.value), ...Object.fromEntries(brought) });
    });
    return choice;
  }

  /** @param {DeviceNumber} of @param {string} label */
  sliderOf(of, label) {
    const slider = document.createElement("input");
    slider.type = "range";
    slider.min = "0";
    slider.max = String(STEPS);
    slider.id = `s-${of.path}`;
    slider.setAttribute("aria-label", label);
    slider.addEventListener("input", () => {
      this.dragging = true;
      this.listeners.onNumber(this.changeOf(of, fromSlider(of, Number(slider.value))), of.path);
    });
    slider.addEventListener("change", () => {
      this.dragging = false;
      this.listeners.onRelease();
      if (this.outdated) this.build();
    });
    return slider;
  }
}

/** @param {DeviceNumber} of @param {number} value */
function toSlider(of, value) {
  const [low, high] = [Number(of.low), Number(of.high)];
  const share = of.scale === "logarithmic" ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low);
  return Math.round(STEPS * Math.min(Math.max(share, 0), 1));
}

/** @param {DeviceNumber} of @param {number} at */
function fromSlider(of, at) {
  const [low, high] = [Number(of.low), Number(of.high)];
  const share = at / STEPS;
  const value = of.scale === "logarithmic" ? low * (high / low) ** share : low + share * (high - low);
  return of.whole ? Math.round(value) : Number(value.toPrecision(5));
}

/** @param {any} value */
function plain(value) {
  return typeof value === "number" ? String(Number(value.toPrecision(7))) : String(value);
}
