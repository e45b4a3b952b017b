/**
 * The contact beside its controls: let the device go against the wall, touch it, hear it.
 */

import { ContactView } from "./contact_view.js";
import { number, quantity } from "./canvas.js";
import { blocksOf, pitchFor, Touch } from "./touch.js";
import { TouchMachine } from "./touch_machine.js";

/** @typedef {import("./connection.js").Frame} Frame */
/** @typedef {import("./state.js").Hand} Hand */

// The hand that a mouse is: a light arm on a spring to where the pointer is.
export const MOUSE = { arm_mass: 0.05, arm_stiffness: 300, arm_damping: 4, grasp_stiffness: null, grasp_damping: 0 };
const LONGEST_VIBRATION = 1.6; // s after letting go that a slow motion can be cut from
const TOGETHER = 64; // periods that the machine goes through in one call
const NO_FORCE = "A mouse gives no force: you see and hear what a hand on this spring would feel.";

export class ContactPanel {
  /**
   * @param {{tools: HTMLElement, canvas: HTMLCanvasElement, text: HTMLElement}} elements
   * @param {{onHand: (hand: Hand | null) => void, onSimulate: (options: object) => Promise<Frame | null>,
   *   onVibration: (trail: Float64Array, step: number) => void,
   *   onLetGo: (frame: Frame, trail: Float64Array, step: number) => void, say: (sentence: string, wrong?: boolean) => void}} listeners
   */
  constructor(elements, listeners) {
    this.elements = elements;
    this.listeners = listeners;
    this.view = new ContactView(elements.canvas, {
      onTarget: (target) => {
        this.touch.target = target;
      },
      onGrab: () => {},
    });
    this.touch = new Touch((outputs, trail) => {
      this.view.add(outputs);
      this.view.draw();
      this.listeners.onVibration(trail, this.touch.blocks?.period ?? 0);
    });
    this.go = this.button("Let go", "Simulate the device, let go 1 mm inside the wall");
    this.feel = this.button("Touch", "The mouse becomes a hand on a spring");
    this.hear = this.button("Sound", "Hear the handle's velocity, while the wall is touched");
    this.oneSided = this.check("one-sided", "The wall pushes out and never pulls");
    this.feel.setAttribute("aria-pressed", "false");
    this.hear.setAttribute("aria-pressed", "false");
    this.hear.disabled = true;
    this.go.addEventListener("click", () => void this.simulate());
    this.feel.addEventListener("click", () => this.toggleTouch());
    this.hear.addEventListener("click", () => void this.toggleSound());
    this.oneSided.addEventListener("change", () => this.takeWall(this.wall));
    /** @type {{stiffness: number, damping: number} | null} */
    this.wall = null;
    this.touching = false;
    new ResizeObserver(() => this.view.draw()).observe(elements.canvas);
  }

  /** @param {string} text @param {string} title */
  button(text, title) {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = text;
    button.title = title;
    this.elements.tools.append(button);
    return button;
  }

  /** @param {string} text @param {string} title */
  check(text, title) {
    const label = document.createElement("label");
    const box = document.createElement("input");
    box.type = "checkbox";
    label.title = title;
    label.append(box, text);
    this.elements.tools.append(label);
    return box;
  }

  /** @param {string} sentence */
  write(sentence) {
    this.elements.text.textContent = sentence;
  }

  /** What is touched, one-sided or not. @param {{stiffness: number, damping: number} | null} wall */
  takeWall(wall) {
    this.wall = wall;
    this.touch.setWall(wall, this.oneSided.checked);
    this.view.spring = { stiffness: wall?.stiffness ?? 0, oneSided: this.oneSided.checked };
  }

  /** A new view has come. @param {Frame} frame @param {{stiffness: number, damping: number} | null} wall */
  update(frame, wall) {
    this.takeWall(wall);
    const moments = frame.head.moments;
    this.view.units = moments ? { x: "rad", f: "N m" } : { x: "m", f: "N" };
    if (!this.touching) return;
    const found = frame.head.touch;
    if (!found || found.reason) {
      this.stop();
      this.write(`${found?.reason ?? "this device cannot be touched"}. Let it go instead: the server simulates that.`);
      return;
    }
    const first = !this.touch.running;
    this.touch.load(blocksOf(frame));
    const frequency = frame.head.chart.wall?.frequency ?? null;
    this.touch.setPitch(pitchFor(frequency));
    this.view.delay = found.delay_samples;
    this.view.frequency = frame.head.chart.wall?.verdict === "unstable" ? frequency : null;
    const shift = this.touch.factor === 1 ? "" : ` Sound is played ${number(this.touch.factor, 2)} times ${this.touch.factor > 1 ? "higher" : "lower"}.`;
    this.write(`${NO_FORCE} The chart is the one held by this hand (${quantity(found.arm[0], "N/m")}, ${quantity(found.arm[1], "N s/m")}).${shift}`);
    if (first) {
      this.view.begin(found.period);
      void this.touch.start();
    }
  }

  /** Show no contact that has been simulated. */
  forget() {
    if (this.touching) return;
    this.view.motion = null;
    this.write("");
    this.view.draw();
  }

  toggleTouch() {
    if (this.touching) {
      this.stop();
      return;
    }
    this.touching = true;
    this.feel.setAttribute("aria-pressed", "true");
    this.hear.disabled = false;
    this.write(NO_FORCE);
    this.listeners.onHand(MOUSE);
  }

  stop() {
    if (!this.touching) return;
    this.touching = false;
    this.touch.stop();
    this.view.end();
    this.feel.setAttribute("aria-pressed", "false");
    this.hear.setAttribute("aria-pressed", "false");
    this.hear.disabled = true;
    this.write("");
    this.listeners.onHand(null);
    this.view.draw();
  }

  async toggleSound() {
    const on = this.hear.getAttribute("aria-pressed") === "true";
    try {
      if (on) await this.touch.silence();
      else await this.touch.listen();
      this.hear.setAttribute("aria-pressed", String(!on));
    } catch (error) {
      this.listeners.say(/** @type {Error} */ (error).message, true);
    }
  }

  async simulate() {
    this.stop();
    if (!this.wall) {
      this.listeners.say("choose a wall on the chart first", true);
      return;
    }
    const frame = await this.listeners.onSimulate({ one_sided: this.oneSided.checked });
    if (!frame) return;
    const { head, arrays } = frame;
    const values = (/** @type {string} */ name) => /** @type {Float64Array} */ (arrays[name].values);
    this.view.frequency = head.dominant_frequency_Hz;
    const motion = { time: values("time"), reading: values("reading"), place: values("place"), force: values("force"), made: values("made"), delay: head.delay_samples };
    this.view.setMotion(motion, head.stable === true);
    const verdict = head.stable === null ? "undecided" : head.stable ? "stable" : "not stable";
    const unseen = head.touch.reason ? "its vibration is not drawn" : head.scene.still;
    this.write(`${verdict}: ${head.behaviour}; ${quantity(head.dominant_frequency_Hz, "Hz")}, amplitude ${quantity(head.amplitude_m, this.view.units.x)}${unseen ? `; ${unseen}` : ""}`);
    this.view.draw();
    if (!unseen) await this.vibrate(frame);
  }
  /** Go through the start of a contact once more, for its vibration. @param {Frame} frame */
  async vibrate(frame) {
    const blocks = blocksOf(frame);
    const machine = new TouchMachine(await this.touch.module);
    machine.load(blocks);
    /** @type {number[]} */
    const trail = [];
    const periods = Math.min(Math.ceil(LONGEST_VIBRATION / blocks.period), /** @type {Float64Array} */ (frame.arrays.time.values).length);
    for (let done = 0; done < periods; done += TOGETHER) {
      machine.run(Math.min(TOGETHER, periods - done), this.touch.wall, 0);
      if (Number.isNaN(machine.trail[0])) break; // it grew until it was put back
      trail.push(...machine.trail);
    }
    this.listeners.onLetGo(frame, Float64Array.from(trail), blocks.period);
  }
}
