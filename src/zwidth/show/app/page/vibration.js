/**
 * The drawn device as it vibrates: enlarged, in slow motion.
 *
 *     displacement = gain · rates · coordinates · (amplitudes − their slow mean)
 *
 * with the rates of the drawn points and the coordinates of the modes from the server, and the amplitudes of the modes
 * from the touch, or from a device that is let go. The mean goes over whole cycles of the predicted vibration, which it leaves as it is; what the hand
 * moves slowly is taken away. A clip of the last moments is played slowly, then one of the latest moments.
 */

/** @typedef {import("./connection.js").Frame} Frame */
/**
 * What is played: displacements per mode and when.
 *
 * @typedef {object} Clip
 * @property {Float64Array} rows   (count, n) amplitudes without their mean
 * @property {number} count
 * @property {number} largest      row in which a point is farthest from its place
 * @property {number} size         and how far that is [m]
 * @property {number} slower       how many times more slowly it is played
 * @property {number} began        [ms]
 */
/** @typedef {{amplitudes: Float64Array, gain: number, slower: number}} Moment  amplitudes as they are drawn, enlarged */

const SLOWER = 20; // times, at least
const SEEN = 10; // Hz that the eye follows: faster vibrations are played more slowly
const LONGEST = 1; // s of motion that a clip holds at most
const PLAYED = 1; // s in which a clip is played, at least
const CYCLES = 4; // of the predicted vibration in a clip
const AVERAGED = 2; // cycles in the slow mean
const SLOWEST = 4; // Hz, below which the mean and the clip get no longer
const FASTEST = 200; // Hz, above which the mean gets no shorter
const UNPREDICTED = 50; // Hz, where the chart has no frequency
const DRAWN_SIZE = 30; // css px that the largest displacement comes to at most
const MOST = 10000; // times enlarged: what is smaller stays unseen
const [SCENE, RATES] = ["scene.", "_rates"]; // what the rates of points are named, before and after the points
const LOOKED_AT = 200; // rows of a clip in which the largest displacement is looked for

export class Vibration {
  constructor() {
    /** @type {{[name: string]: Float64Array}} */
    this.shapes = {}; // (3 points, n) of each kind of points
    this.modes = 0;
    this.frequency = UNPREDICTED;
    this.step = 0; // s between two rows of the history
    /** @type {number[]} */
    this.history = []; // rows of n amplitudes, the latest last
    /** @type {Clip | null} */
    this.clip = null;
  }

  /** Whether the device's points are known to move. */
  get known() {
    return this.modes > 0;
  }

  /**
   * The modes of another frame, with how the drawn points move; none where it does not say.
   *
   * @param {Frame} frame
   * @param {number | null} predicted  [Hz], null where nothing is
   */
  setFrame(frame, predicted) {
    const { arrays } = frame;
    const moved = Object.keys(arrays).filter((name) => name.startsWith(SCENE) && name.endsWith(RATES));
    const modes = (moved.length && arrays["touch.coordinates"]?.shape[1]) || 0;
    this.shapes = {};
    if (modes !== this.modes) this.clear();
    this.modes = modes;
    if (!modes) return;
    const coordinates = /** @type {Float64Array} */ (arrays["touch.coordinates"].values);
    for (const name of moved) {
      const rates = /** @type {Float64Array} */ (arrays[name].values);
      this.shapes[name.slice(SCENE.length, -RATES.length)] = product(rates, coordinates, modes);
    }
    this.frequency = Math.max(predicted || UNPREDICTED, SLOWEST);
  }

  /** How many times more slowly a clip is played. */
  get slower() {
    return Math.max(SLOWER, roundNumber(this.frequency / SEEN, true));
  }

  clear() {
    this.history = [];
    this.clip = null;
  }

  /** Add what was touched. @param {Float64Array} trail  (k, n) amplitudes @param {number} step  s between its rows */
  add(trail, step) {
    const n = this.modes;
    if (!n || trail.length % n) return;
    if (step !== this.step) this.clear();
    this.step = step;
    for (let row = 0; row < trail.length; row += n) {
      if (Number.isNaN(trail[row])) this.history = []; // the device was put back
      else this.history.push(...trail.subarray(row, row + n));
    }
    const kept = n * Math.ceil((LONGEST + AVERAGED / SLOWEST) / step + 2);
    if (this.history.length > kept) this.history.splice(0, this.history.length - kept);
  }

  /**
   * What is drawn at a moment: displacements of the modes, enlarged by a round number so that a point moves as far as
   * is well seen.
   *
   * @param {number} now     [ms]
   * @param {number} scale   css px per metre
   * @param {boolean} still  the largest displacement alone, for who wants no motion
   * @returns {Moment | null}  null: too little has been touched yet
   */
  at(now, scale, still) {
    const rowAt = (/** @type {Clip} */ clip) => Math.max(now - clip.began, 0) / 1000 / clip.slower / this.step;
    const unseen = this.clip && this.clip.size * scale * MOST < 1;
    if (!this.clip || unseen || rowAt(this.clip) >= this.clip.count - 1) this.clip = this.newClip(now) ?? this.clip;
    const clip = this.clip;
    if (!clip) return null;
    const at = still ? clip.largest : rowAt(clip);
    const row = Math.min(Math.floor(at), clip.count - 2);
    const share = Math.min(at - row, 1);
    const gain = gainFor(clip.size * scale);
    const n = this.modes;
    const amplitudes = Float64Array.from({ length: n }, (_, k) => {
      const [from, to] = [clip.rows[n * row + k], clip.rows[n * (row + 1) + k]];
      return gain * (from + share * (to - from));
    });
    return { amplitudes, gain, slower: clip.slower };
  }

  /** Rows of a clip, and of half of the slow mean. */
  get lengths() {
    const half = Math.max(1, Math.round(AVERAGED / Math.min(this.frequency, FASTEST) / 2 / this.step));
    const played = Math.min(Math.max(CYCLES / this.frequency, PLAYED / this.slower), LONGEST);
    return { half, count: Math.max(2, Math.round(played / this.step)) };
  }

  /** Play the start of a contact again and again. @param {Float64Array} trail  (k, n) amplitudes @param {number} step */
  show(trail, step) {
    this.clear();
    this.step = step;
    const { count, half } = this.lengths;
    this.add(trail.subarray(0, this.modes * (count + 2 * half)), step);
  }

  /** The latest moments around which the mean is known; null: there are not enough. @param {number} now @returns {Clip | null} */
  newClip(now) {
    const [n, { history, slower }] = [this.modes, this];
    const { half, count } = this.lengths;
    const first = history.length / n - half - count;
    if (!n || !(first >= half)) return null;
    const rows = new Float64Array(n * count);
    for (let k = 0; k < n; k++) {
      const value = (/** @type {number} */ row) => history[n * row + k];
      let sum = 0; // of the trapezoidal rule from half before to half after
      for (let row = first - half; row < first + half; row++) sum += (value(row) + value(row + 1)) / 2;
      for (let i = 0; i < count; i++) {
        const row = first + i;
        rows[n * i + k] = value(row) - sum / (2 * half);
        sum += (value(row + half) + value(row + half + 1) - value(row - half) - value(row - half + 1)) / 2;
      }
    }
    let [largest, size] = [0, 0];
    for (let i = 0; i < count; i += Math.ceil(count / LOOKED_AT)) {
      const reached = this.farthest(rows.subarray(n * i, n * (i + 1)));
      if (reached > size) [largest, size] = [i, reached];
    }
    return Number.isFinite(size) ? { rows, count, largest, size, slower, began: now } : null;
  }

  /** The largest displacement of a point [m]. @param {Float64Array} amplitudes */
  farthest(amplitudes) {
    let most = 0;
    for (const name of Object.keys(this.shapes)) {
      const moved = this.displacements(name, amplitudes);
      for (let i = 0; i < moved.length; i += 3) most = Math.max(most, Math.hypot(moved[i], moved[i + 1], moved[i + 2]));
    }
    return most;
  }

  /** Of points of one kind, x, y and z of each [m]. @param {string} name @param {Float64Array} amplitudes */
  displacements(name, amplitudes) {
    return product(this.shapes[name], amplitudes, 1);
  }
}

/**
 * What is said of a picture.
 *
 * @param {number} gain
 * @param {number} slower    0: it does not move
 * @param {string} [most]    the largest displacement, of a picture without a scale
 */
export function captionOf(gain, slower, most) {
  const size = most ? `at most ${most}` : gain === 1 ? "true to size" : gain > 1 ? `enlarged ${gain} times` : `reduced ${Math.round(1 / gain)} times`;
  return `${slower ? `slow motion 1:${slower}` : "largest displacement"}, ${size}`;
}

/** By how much a displacement of so many css px is enlarged, so that it comes to DRAWN_SIZE at most. @param {number} size */
export function gainFor(size) {
  return roundNumber(Math.min(DRAWN_SIZE / size, MOST), false);
}

/** The next of 1, 2, 5, 10, ... above or below a number, or itself. @param {number} value @param {boolean} above */
function roundNumber(value, above) {
  const power = 10 ** Math.floor(Math.log10(value) + 1e-9);
  const around = [1, 2, 5, 10].map((digit) => Number((digit * power).toPrecision(1)));
  const found = above ? around.find((each) => each >= value * (1 - 1e-9)) : around.reverse().find((each) => each <= value * (1 + 1e-9));
  return found ?? around[0];
}

/**
 * A matrix (m, p) times another (p, columns), both row by row.
 *
 * @param {Float64Array} left
 * @param {Float64Array} right
 * @param {number} columns
 */
function product(left, right, columns) {
  const inner = Math.floor(right.length / columns);
  const out = new Float64Array((left.length / inner) * columns);
  for (let i = 0; i < out.length; i++) {
    const [row, column] = [Math.floor(i / columns), i % columns];
    for (let k = 0; k < inner; k++) out[i] += left[inner * row + k] * right[columns * k + column];
  }
  return out;
}
