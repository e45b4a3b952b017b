/**
 * A class's own paddle beside the chart: connect the board, or replay a record, and trials appear as points.
 */

import { PaddleStream, toCsv } from "./paddle.js";
import { quantity } from "./canvas.js";
import { saveBytes } from "./files.js";

/** @typedef {import("./paddle.js").Trial} Trial */

const SWEEPS = 20; // trials of a sweep, up to 1.3 times the largest stiffness of the chart
const BEYOND = 1.3;

export class PaddlePanel {
  /**
   * @param {HTMLElement} element
   * @param {{onTrials: (trials: Trial[]) => void, wall: () => {stiffness: number, damping: number} | null,
   *   stiffnessMax: () => number}} listeners
   */
  constructor(element, listeners) {
    this.listeners = listeners;
    /** @type {Trial[]} */
    this.trials = [];
    this.note = document.createElement("p");
    this.note.setAttribute("role", "status");
    const tools = document.createElement("div");
    tools.className = "tools";
    tools.append(
      this.button("Connect", "Choose the board's port", () => void this.stream.connectSerial()),
      this.button("Replay", "A recorded stream of a simulated paddle, where no board is", () => void this.replay()),
      this.button("Send wall", "Have the board render the chosen wall", () => void this.sendWall()),
      this.button("Sweep", "Have the board raise the stiffness at the chosen damping until it vibrates", () => void this.sweep()),
      this.button("Stop", "Close the port", () => this.stream.stop()),
      this.button("Save trials", "As a table of measured points (.csv)", () => this.save()),
    );
    element.append(tools, this.note);
    this.stream = new PaddleStream({
      onTrial: (trial) => {
        this.trials.push(trial);
        this.say(`${this.trials.length} trials; the last: ${quantity(trial.stiffness, "N/m")}, ${quantity(trial.damping, "N s/m")}, ${trial.verdict}`);
        this.listeners.onTrials(this.trials);
      },
      onSample: () => {},
      onFault: (sentence) => this.say(sentence),
      onEnd: () => {
        const said = this.note.textContent ?? "";
        this.say(`${said}${said && !said.endsWith(".") ? "." : ""} The stream has ended.`.trim());
      },
    });
  }

  /** @param {string} text @param {string} title @param {() => void} onClick */
  button(text, title, onClick) {
    const made = document.createElement("button");
    made.type = "button";
    made.textContent = text;
    made.title = title;
    made.addEventListener("click", onClick);
    return made;
  }

  /** @param {string} sentence */
  say(sentence) {
    this.note.textContent = sentence;
  }

  async replay() {
    this.trials = [];
    const record = await (await fetch("paddle_record.txt")).text();
    await this.stream.replay(record, 20);
  }

  async sendWall() {
    const wall = this.listeners.wall();
    if (!wall) this.say("choose a wall on the chart first");
    else await this.stream.send(`wall ${wall.stiffness.toPrecision(5)} ${wall.damping.toPrecision(5)}`);
  }

  async sweep() {
    const wall = this.listeners.wall();
    const most = BEYOND * this.listeners.stiffnessMax();
    if (!wall || !(most > 0)) this.say("choose a wall on the chart first; the sweep is at its damping");
    else await this.stream.send(`sweep ${wall.damping.toPrecision(5)} ${(most / SWEEPS).toPrecision(5)} ${most.toPrecision(5)} ${(most / SWEEPS).toPrecision(5)}`);
  }

  save() {
    if (!this.trials.length) this.say("there are no trials yet");
    else saveBytes("trials.csv", new TextEncoder().encode(toCsv(this.trials)));
  }
}
