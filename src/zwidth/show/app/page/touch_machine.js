/**
 * The device on contact, as Python simulates it: the same kernel, compiled to WebAssembly.
 *
 * Blocks of numbers lie in the module's own memory; `touch_step.py` has their layout. What the device is can be
 * changed while it moves: its state stays as long as it has the same parts.
 */

/**
 * @typedef {object} TouchBlocks
 * @property {Int32Array} counts
 * @property {Float64Array} numbers
 * @property {Float64Array} memory     at the start
 * @property {Float64Array} noise      standard deviation of each encoder's noise [m]
 * @property {{[name: string]: number}} ports
 * @property {number} port_count
 * @property {number} period           [s]
 * @property {number} states_at
 * @property {number[]} arm            stiffness [N/m] and damping [N s/m] to where the hand wants to be
 */
/** @typedef {{law: number, stiffness: number, damping: number, position: number}} WallLaw */

export const FREE = 0;
export const TWO_SIDED = 1;
export const ONE_SIDED = 2;
export const OUTPUTS = 7;
export const READING = 0;
export const TRUTH = 1;
export const COMMAND = 3;
export const HANDLE = 4;
export const HANDLE_VELOCITY = 5;
export const ENERGY = 6;
export const MOST_PERIODS = 4096; // in one call

const PAGE = 65536; // bytes of a page of WebAssembly's memory
const LOST = 1.0; // m from the wall, beyond which the device is put back: a run that grew without bounds

export class TouchMachine {
  /** @param {WebAssembly.Module} module  of touch.wasm */
  constructor(module) {
    const { exports } = new WebAssembly.Instance(module, {});
    this.kernel = /** @type {any} */ (exports);
    /** @type {TouchBlocks | null} */
    this.blocks = null;
    this.at = { counts: 0, numbers: 0, memory: 0, ports: 0, noise: 0, outputs: 0 };
    this.random = 0x9e3779b9;
    this.push = 0;
    /** @type {number[]} */
    this.trail = []; // amplitudes after each period of the last `run`, row by row; NaN: put back to the start
  }

  /**
   * Take over a device.
   *
   * @param {TouchBlocks} blocks
   */
  load(blocks) {
    const before = this.blocks && this.state();
    const same = before !== null && this.blocks !== null && String(this.blocks.counts) === String(blocks.counts);
    this.blocks = blocks;
    const encoders = blocks.noise.length;
    let end = Number(this.kernel.__heap_base.value);
    const room = (/** @type {number} */ count) => {
      const start = Math.ceil(end / 8) * 8;
      end = start + 8 * count;
      return start;
    };
    this.at = {
      counts: room(blocks.counts.length),
      numbers: room(blocks.numbers.length),
      memory: room(blocks.memory.length),
      ports: room(blocks.port_count),
      noise: room(MOST_PERIODS * Math.max(encoders, 1)),
      outputs: room(MOST_PERIODS * OUTPUTS),
    };
    const missing = end - this.kernel.memory.buffer.byteLength;
    if (missing > 0) this.kernel.memory.grow(Math.ceil(missing / PAGE));
    new BigInt64Array(this.kernel.memory.buffer, this.at.counts, blocks.counts.length).set(Array.from(blocks.counts, BigInt));
    this.floats(this.at.numbers, blocks.numbers.length).set(blocks.numbers);
    this.floats(this.at.memory, blocks.memory.length).set(same ? before : blocks.memory);
    this.floats(this.at.ports, blocks.port_count).fill(0);
    this.floats(this.at.noise, MOST_PERIODS * Math.max(encoders, 1)).fill(0);
  }

  /** Put the device back to its start. */
  reset() {
    if (this.blocks) this.floats(this.at.memory, this.blocks.memory.length).set(this.blocks.memory);
    this.push = 0;
    this.trail = Array(this.blocks?.counts[0] ?? 0).fill(NaN);
  }

  /** The memory of the device: states, queue, estimates. */
  state() {
    return this.floats(this.at.memory, this.blocks?.memory.length ?? 0).slice();
  }

  /** Modal amplitudes of the plant now. */
  amplitudes() {
    const blocks = /** @type {TouchBlocks} */ (this.blocks);
    return this.floats(this.at.memory + 8 * blocks.states_at, blocks.counts[0]).slice();
  }

  /** @param {number} at @param {number} count */
  floats(at, count) {
    return new Float64Array(this.kernel.memory.buffer, at, count);
  }

  /**
   * Go through sampling periods; the push grows evenly from what it was to `push`.
   *
   * @param {number} periods
   * @param {WallLaw} wall
   * @param {number} push  [N]
   * @returns {Float64Array}  (periods, OUTPUTS), a view that the next call overwrites
   */
  run(periods, wall, push) {
    const blocks = /** @type {TouchBlocks} */ (this.blocks);
    const count = Math.min(periods, MOST_PERIODS);
    const ports = this.floats(this.at.ports, blocks.port_count);
    ports[blocks.ports.law] = wall.law;
    ports[blocks.ports.stiffness] = wall.stiffness;
    ports[blocks.ports.damping] = wall.damping;
    ports[blocks.ports.wall_position] = wall.position;
    this.drawNoise(count);
    const { counts, numbers, memory, noise, outputs } = this.at;
    const before = this.push;
    this.trail = [];
    for (let done = 0; done < count; done++) {
      ports[blocks.ports.push] = before + ((push - before) * done) / count;
      ports[blocks.ports.last_push] = before + ((push - before) * (done + 1)) / count;
      this.kernel.touch_periods(counts, numbers, memory, this.at.ports, noise + 8 * blocks.noise.length * done, outputs + 8 * OUTPUTS * done, 1);
      this.trail.push(...this.amplitudes());
    }
    this.push = push;
    const found = this.floats(outputs, OUTPUTS * count);
    const last = found[OUTPUTS * (count - 1) + READING];
    if (!(Math.abs(last) < LOST)) this.reset();
    return found;
  }

  /** @param {number} periods */
  drawNoise(periods) {
    const blocks = /** @type {TouchBlocks} */ (this.blocks);
    const encoders = blocks.noise.length;
    if (!blocks.noise.some((deviation) => deviation > 0)) return;
    const noise = this.floats(this.at.noise, periods * encoders);
    for (let i = 0; i < noise.length; i++) noise[i] = blocks.noise[i % encoders] * this.normal();
  }

  /** A normally distributed number, by Box and Muller's method from a generator of 32 bits (xorshift). */
  normal() {
    const even = () => {
      this.random ^= this.random << 13;
      this.random ^= this.random >>> 17;
      this.random ^= this.random << 5;
      return ((this.random >>> 0) + 0.5) / 4294967296;
    };
    return Math.sqrt(-2 * Math.log(even())) * Math.cos(2 * Math.PI * even());
  }
}
