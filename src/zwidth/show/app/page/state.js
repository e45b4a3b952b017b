/**
 * What the page shows, its history, and its link.
 *
 * The state is the one that `request.py` checks; all that the page shows follows from it. A drag is one step of the
 * history, however many states it passes.
 */

/** @typedef {{stiffness: number, damping: number}} Wall */
/** @typedef {[number, number, number]} Vector */
/** @typedef {{arm_mass: number, arm_stiffness: number, arm_damping: number, grasp_stiffness?: number | null,
 *   grasp_damping?: number}} Hand */
/**
 * @typedef {object} State
 * @property {string} device
 * @property {boolean} [from_file]
 * @property {{[path: string]: any}} settings
 * @property {Vector | null} [position]
 * @property {Vector | null} [direction]
 * @property {Vector | null} [axis]
 * @property {string | null} [assembly]
 * @property {string | null} [model]
 * @property {string | null} [operator]
 * @property {Hand | null} [hand]
 * @property {Wall | null} [wall]
 */

const MOST_STEPS = 200;
const VERSION = 1;

export class Store {
  /**
   * @param {State} state
   * @param {(state: State) => void} onChange
   */
  constructor(state, onChange) {
    this.state = state;
    this.onChange = onChange;
    /** @type {State[]} */
    this.past = [];
    /** @type {State[]} */
    this.future = [];
    /** @type {string | null} */
    this.dragged = null;
  }

  /**
   * Change the state. Changes of one drag are one step.
   *
   * @param {Partial<State>} change
   * @param {string} [drag]  what is dragged; `release` ends the step
   */
  set(change, drag) {
    if (!drag || drag !== this.dragged) {
      this.past.push(this.state);
      if (this.past.length > MOST_STEPS) this.past.shift();
      this.future = [];
    }
    this.dragged = drag ?? null;
    this.state = { ...this.state, ...change };
    this.onChange(this.state);
  }

  /**
   * Put what can be had in the place of what was chosen, in the same step of the history.
   *
   * @param {Partial<State>} change
   */
  correct(change) {
    this.state = { ...this.state, ...change };
    this.onChange(this.state);
  }

  /**
   * Change one number, or remove its key with null.
   *
   * @param {{[path: string]: any}} settings
   * @param {string} [drag]
   */
  setNumbers(settings, drag) {
    this.set({ settings: { ...this.state.settings, ...settings } }, drag);
  }

  release() {
    this.dragged = null;
  }

  undo() {
    this.move(this.past, this.future);
  }

  redo() {
    this.move(this.future, this.past);
  }

  /**
   * @param {State[]} from
   * @param {State[]} to
   */
  move(from, to) {
    const state = from.pop();
    if (!state) return;
    to.push(this.state);
    this.dragged = null;
    this.state = state;
    this.onChange(state);
  }
}

/**
 * A state, with the files that it needs, as the part of an address behind #.
 *
 * @param {State} state
 * @param {{[name: string]: string}} files
 * @returns {Promise<string>}
 */
export async function linkOf(state, files) {
  const text = JSON.stringify({ v: VERSION, state, files });
  const packed = await through(new Blob([text]), new CompressionStream("deflate-raw"));
  return toBase64(packed);
}

/**
 * The state and files of a link.
 *
 * @param {string} link
 * @returns {Promise<{state: State, files: {[name: string]: string}}>}
 * Throws  Error  with a sentence, for what is no link of this page
 */
export async function readLink(link) {
  try {
    const packed = fromBase64(link);
    const text = new TextDecoder().decode(await through(new Blob([packed]), new DecompressionStream("deflate-raw")));
    const { v, state, files } = JSON.parse(text);
    if (v !== VERSION || typeof state?.device !== "string") throw new Error("another version");
    return { state: { ...state, settings: state.settings ?? {} }, files: files ?? {} };
  } catch {
    throw new Error("this link is cut off or from another version; ask for it again");
  }
}

/**
 * @param {Blob} blob
 * @param {CompressionStream | DecompressionStream} stream
 */
async function through(blob, stream) {
  return new Uint8Array(await new Response(blob.stream().pipeThrough(stream)).arrayBuffer());
}

/** @param {Uint8Array} bytes */
function toBase64(bytes) {
  const letters = Array.from(bytes, (byte) => String.fromCharCode(byte)).join("");
  return btoa(letters).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
}

/** @param {string} text */
function fromBase64(text) {
  const letters = atob(text.replaceAll("-", "+").replaceAll("_", "/"));
  return Uint8Array.from(letters, (letter) => letter.charCodeAt(0));
}
