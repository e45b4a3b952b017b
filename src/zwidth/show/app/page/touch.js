/**
 * Touch and sound: the mouse is a hand on a spring, the device answers in real time.
 *
 * The state of the device has one owner: the page, which goes through the periods of each animation frame, or the
 * sound's own thread while sound is on.
 */

import { FREE, MOST_PERIODS, ONE_SIDED, TouchMachine, TWO_SIDED } from "./touch_machine.js";

/** @typedef {import("./touch_machine.js").TouchBlocks} TouchBlocks */
/** @typedef {import("./connection.js").Frame} Frame */

const LONGEST_FRAME = 0.1; // s that are made up for after a frame that came late
export const LOW = 60; // Hz, below which a vibration is raised to be heard
const RAISED_TO = 110;
const HIGH = 10000;

/**
 * The blocks of a frame's layer `touch`.
 *
 * @param {Frame} frame
 * @returns {TouchBlocks}
 */
export function blocksOf(frame) {
  const { arrays } = frame;
  const head = frame.head.touch;
  return {
    counts: /** @type {Int32Array} */ (arrays["touch.counts"].values),
    numbers: /** @type {Float64Array} */ (arrays["touch.numbers"].values),
    memory: /** @type {Float64Array} */ (arrays["touch.memory"].values),
    noise: /** @type {Float64Array} */ (arrays["touch.noise"].values),
    ports: head.ports,
    port_count: head.port_count,
    period: head.period,
    states_at: head.states_at,
    arm: head.arm,
  };
}

/**
 * By how many times a vibration is played faster, or slower, so that a loudspeaker can follow: whole octaves.
 *
 * @param {number | null} frequency  [Hz]
 */
export function pitchFor(frequency) {
  if (!frequency || !(frequency > 0)) return 1;
  if (frequency < LOW) return 2 ** Math.ceil(Math.log2(RAISED_TO / frequency));
  if (frequency > HIGH) return 2 ** Math.floor(Math.log2(HIGH / frequency));
  return 1;
}

export class Touch {
  /** @param {(outputs: Float64Array, trail: Float64Array, target: number) => void} onMotion  rows of the machine's trail */
  constructor(onMotion) {
    this.onMotion = onMotion;
    /** @type {Promise<WebAssembly.Module>} */
    this.module = WebAssembly.compileStreaming(fetch("touch.wasm"));
    /** @type {TouchMachine | null} */
    this.machine = null;
    /** @type {TouchBlocks | null} */
    this.blocks = null;
    this.wall = { law: FREE, stiffness: 0, damping: 0, position: 0 };
    this.target = 0; // m, where the hand wants to be
    this.before = 0; // the same one frame ago
    this.factor = 1;
    this.running = false;
    this.last = 0;
    this.late = 0;
    /** @type {{context: AudioContext, node: AudioWorkletNode} | null} */
    this.sound = null;
  }

  /** @param {TouchBlocks} blocks */
  load(blocks) {
    this.blocks = blocks;
    if (this.sound) this.sound.node.port.postMessage({ blocks });
    else this.machine?.load(blocks);
  }

  /** @param {{stiffness: number, damping: number} | null} wall @param {boolean} oneSided */
  setWall(wall, oneSided) {
    const law = wall ? (oneSided ? ONE_SIDED : TWO_SIDED) : FREE;
    this.wall = { law, stiffness: wall?.stiffness ?? 0, damping: wall?.damping ?? 0, position: 0 };
    this.sound?.node.port.postMessage({ wall: this.wall });
  }

  /** Begin; `load` comes first. */
  async start() {
    const module = await this.module;
    if (!this.blocks || this.running) return;
    this.machine ??= new TouchMachine(module);
    this.machine.blocks = null;
    this.machine.load(this.blocks);
    this.running = true;
    this.last = performance.now();
    this.late = 0;
    this.before = this.target;
    requestAnimationFrame((now) => this.step(now));
  }

  stop() {
    this.running = false;
    void this.silence();
  }

  /** The push of the hand's spring and damper [N]. @param {number} seconds  since the last */
  push(seconds) {
    const [stiffness, damping] = this.blocks?.arm ?? [0, 0];
    const speed = seconds > 0 ? (this.target - this.before) / seconds : 0;
    this.before = this.target;
    return stiffness * this.target + damping * speed;
  }

  /** @param {number} now  [ms] */
  step(now) {
    if (!this.running || !this.blocks) return;
    requestAnimationFrame((next) => this.step(next));
    const seconds = Math.max(0, (now - this.last) / 1000);
    this.last = now;
    const push = this.push(seconds);
    if (this.sound) {
      this.sound.node.port.postMessage({ push });
      return;
    }
    this.late = Math.min(this.late + seconds, LONGEST_FRAME);
    const periods = Math.min(Math.floor(this.late / this.blocks.period), MOST_PERIODS);
    if (periods < 1 || !this.machine) return;
    this.late -= periods * this.blocks.period;
    const outputs = this.machine.run(periods, this.wall, push);
    this.onMotion(outputs.slice(), Float64Array.from(this.machine.trail), this.target);
  }

  /**
   * Let the sound's own thread go on with the device.
   *
   * @param {AudioContext} [context]  another than the loudspeakers', for a test
   * Throws  Error  with a sentence, where a browser allows no sound
   */
  async listen(context) {
    if (this.sound || !this.blocks) return;
    if (!isSecureContext) throw new Error("sound needs a secure address: https, or 127.0.0.1 on this computer");
    const own = context ?? new AudioContext();
    await own.audioWorklet.addModule("touch_worklet.js");
    const memory = this.machine?.state() ?? null;
    const node = new AudioWorkletNode(own, "touch", {
      numberOfInputs: 0,
      outputChannelCount: [1],
      processorOptions: { module: await this.module, blocks: this.blocks, wall: this.wall, memory, factor: this.factor },
    });
    node.port.onmessage = ({ data }) => {
      if (data.outputs) this.onMotion(data.outputs, data.trail, this.target);
      else if (data.memory && this.machine && data.memory.length === this.blocks?.memory.length) this.machine.floats(this.machine.at.memory, data.memory.length).set(data.memory);
    };
    node.connect(own.destination);
    this.sound = { context: own, node };
    if (own.state === "suspended") await own.resume();
  }

  /** Take the device back from the sound's thread. */
  async silence() {
    const sound = this.sound;
    if (!sound) return;
    this.sound = null;
    sound.node.port.postMessage({ end: true });
    await new Promise((resolve) => setTimeout(resolve, 50));
    sound.node.disconnect();
    await sound.context.close();
  }

  /** @param {number} factor */
  setPitch(factor) {
    if (factor === this.factor) return;
    this.factor = factor;
    this.sound?.node.port.postMessage({ factor });
  }
}
