/**
 * The device on contact inside the sound card's clock: it owns the state while sound is on.
 *
 * Heard is the handle's velocity, FULL_SCALE being the loudest, so that two walls compare. Where that would be too
 * low or too high for a loudspeaker it is shifted by a factor: two grains of the last moments are read faster or
 * slower than they were written, each fading in while the other fades out.
 */

import { HANDLE_VELOCITY, OUTPUTS, TouchMachine } from "./touch_machine.js";

const FULL_SCALE = 0.2; // m/s of the handle that is a sample of 1
const GRAIN = 0.12; // s
const KEPT = 8192; // velocities, at the last so many samples
const REPORTED = 1 / 60; // s between two reports to the page

class TouchProcessor extends AudioWorkletProcessor {
  /** @param {any} options */
  constructor(options) {
    super();
    const { module, blocks, wall, memory, factor, push } = options.processorOptions;
    this.machine = new TouchMachine(module);
    this.machine.load(blocks);
    if (memory) this.machine.floats(this.machine.at.memory, memory.length).set(memory);
    this.wall = wall;
    this.push = push ?? 0;
    this.factor = factor ?? 1;
    this.time = 0; // s that have been heard
    this.done = 0; // periods gone through
    this.velocities = new Float64Array(KEPT);
    this.ring = new Float32Array(Math.ceil(8 * GRAIN * sampleRate));
    this.written = 0;
    this.phase = 0;
    /** @type {number[]} */
    this.kept = [];
    /** @type {number[]} */
    this.trail = [];
    this.unreported = 0;
    this.ended = false;
    this.port.onmessage = (event) => this.told(event.data);
  }

  /** @param {any} news */
  told(news) {
    if (news.blocks) this.take(news.blocks);
    if (news.wall) this.wall = news.wall;
    if (news.factor) this.factor = news.factor;
    if (typeof news.push === "number") this.push = news.push;
    if (news.reset) this.machine.reset();
    if (news.end) {
      this.port.postMessage({ memory: this.machine.state() });
      this.ended = true;
    }
  }

  /** @param {import("./touch_machine.js").TouchBlocks} blocks */
  take(blocks) {
    if (blocks.period !== this.machine.blocks?.period) {
      this.time = 0;
      this.done = 0;
      this.velocities.fill(0);
    }
    this.machine.load(blocks);
  }

  /** @param {Float32Array[][]} _ @param {Float32Array[][]} outputs */
  process(_, outputs) {
    if (this.ended) return false;
    const channel = outputs[0][0];
    const T = this.machine.blocks?.period ?? 1;
    const end = this.time + channel.length / sampleRate;
    // one period more than has been heard, so that there are velocities on both sides of every moment
    const periods = Math.floor(end / T) + 2 - this.done;
    if (periods > 0) {
      const found = this.machine.run(periods, this.wall, this.push);
      for (let k = 0; k < found.length / OUTPUTS; k++) this.velocities[(this.done + k) % KEPT] = found[OUTPUTS * k + HANDLE_VELOCITY];
      this.done += found.length / OUTPUTS;
      this.kept.push(...found);
      this.trail.push(...this.machine.trail);
    }
    for (let i = 0; i < channel.length; i++) {
      const at = (this.time + i / sampleRate) / T;
      const k = Math.floor(at);
      const [from, to] = [this.velocities[k % KEPT], this.velocities[(k + 1) % KEPT]];
      channel[i] = this.shifted((from + (at - k) * (to - from)) / FULL_SCALE);
    }
    this.time = end;
    this.report(channel.length);
    return true;
  }

  /**
   * Write a sample, and read the one that is heard.
   *
   * @param {number} sample
   */
  shifted(sample) {
    const { ring, factor } = this;
    ring[this.written % ring.length] = Number.isFinite(sample) ? sample : 0;
    this.written++;
    if (factor === 1) return clip(ring[(this.written - 1) % ring.length]);
    const length = GRAIN * sampleRate;
    const away = Math.abs(factor - 1) * length; // by which the reading runs ahead, or falls behind, in one grain
    this.phase = (this.phase + 1 / length) % 1;
    let total = 0;
    for (const shift of [0, 0.5]) {
      const phase = (this.phase + shift) % 1;
      const delay = factor > 1 ? (1 - phase) * away : phase * away;
      const at = this.written - 1 - Math.min(delay, ring.length - 2);
      if (at < 0) continue;
      const k = Math.floor(at);
      const value = ring[k % ring.length] + (at - k) * (ring[(k + 1) % ring.length] - ring[k % ring.length]);
      total += Math.sin(Math.PI * phase) ** 2 * value;
    }
    return clip(total);
  }

  /** @param {number} frames */
  report(frames) {
    this.unreported += frames / sampleRate;
    if (this.unreported < REPORTED) return;
    this.port.postMessage({ outputs: Float64Array.from(this.kept), trail: Float64Array.from(this.trail) });
    this.kept = [];
    this.trail = [];
    this.unreported = 0;
  }
}

/** @param {number} sample */
function clip(sample) {
  return Math.min(Math.max(sample, -1), 1);
}

registerProcessor("touch", TouchProcessor);
