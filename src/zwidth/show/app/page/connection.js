/**
 * The socket to the server: requests with numbers, answers as frames, and a new socket where one was lost.
 *
 * The page holds everything that it needs to go on: after a loss its files are sent once more, and whoever listens to
 * `onOpen` asks anew for what is shown.
 */

/** @typedef {{type: string, shape: number[], values: Float64Array | Int32Array | Uint8Array}} FrameArray */
/** @typedef {{[key: string]: any}} Head */
/** @typedef {{head: Head, arrays: {[name: string]: FrameArray}}} Frame */
/** @typedef {{resolve: (frame: Frame) => void, reject: (error: Error) => void, kind: string, progress?: Progress}} Waiting */
/** @typedef {(stage: string, done: number, of: number) => void} Progress */

const SHORTEST_WAIT = 250; // ms before a lost socket is opened again, doubled each time
const LONGEST_WAIT = 5000;
export const LARGEST_FILE = 5_000_000; // characters, as the server has it

/**
 * Head and arrays of a message; the arrays are views of the message itself.
 *
 * @param {ArrayBuffer} message
 * @returns {Frame}
 */
export function unpackFrame(message) {
  const length = new DataView(message).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(message, 4, length)));
  /** @type {{[name: string]: FrameArray}} */
  const arrays = {};
  for (const [name, [type, shape, at]] of Object.entries(head.arrays)) {
    const count = shape.reduce((/** @type {number} */ a, /** @type {number} */ b) => a * b, 1);
    const start = 4 + length + at;
    const values =
      type === "f64"
        ? new Float64Array(message, start, count)
        : type === "i32"
          ? new Int32Array(message, start, count)
          : new Uint8Array(message, start, count);
    arrays[name] = { type, shape, values };
  }
  return { head, arrays };
}

/** An answer that is a failure: its sentences are for people. */
export class Refusal extends Error {
  /** @param {Head} head */
  constructor(head) {
    super(head.sentences.join("; "));
    this.status = head.status;
  }
}

/** @param {string} sentence */
export function refusal(sentence) {
  return new Refusal({ sentences: [sentence], status: "bad input" });
}

/** A request that a newer one of its kind replaced, or whose socket was lost. */
export class Dropped extends Error {}

export class Connection {
  /**
   * @param {string} token
   * @param {{onOpen: () => void, onLost: () => void}} listeners
   */
  constructor(token, listeners) {
    this.token = token;
    this.listeners = listeners;
    /** @type {Map<number, Waiting>} */
    this.waiting = new Map();
    /** @type {Map<string, string>} */
    this.files = new Map();
    this.number = 0;
    this.pause = SHORTEST_WAIT;
    /** @type {WebSocket | null} */
    this.socket = null;
    this.open();
  }

  get connected() {
    return this.socket?.readyState === WebSocket.OPEN;
  }

  open() {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    const query = this.token ? `?token=${encodeURIComponent(this.token)}` : "";
    const socket = new WebSocket(`${scheme}://${location.host}/socket${query}`);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    socket.addEventListener("open", () => {
      this.pause = SHORTEST_WAIT;
      for (const [name, text] of this.files) void this.sendFile(name, text).catch(() => {});
      this.listeners.onOpen();
    });
    socket.addEventListener("message", (event) => this.receive(unpackFrame(event.data)));
    socket.addEventListener("close", () => {
      for (const each of this.waiting.values()) each.reject(new Dropped("the connection was lost"));
      this.waiting.clear();
      this.listeners.onLost();
      setTimeout(() => this.open(), this.pause);
      this.pause = Math.min(2 * this.pause, LONGEST_WAIT);
    });
  }

  /** @param {Frame} frame */
  receive(frame) {
    const { head } = frame;
    const waiting = this.waiting.get(head.id);
    if (!waiting) {
      if (head.kind === "view") this.confirm();
      return;
    }
    if (head.kind === "progress") {
      waiting.progress?.(head.stage, head.done, head.of);
      return;
    }
    this.waiting.delete(head.id);
    for (const [number, each] of this.waiting) {
      if (each.kind === head.kind && number < head.id && head.kind !== "file") {
        this.waiting.delete(number);
        each.reject(new Dropped("a newer request took its place"));
      }
    }
    if (head.ok) waiting.resolve(frame);
    else {
      if (head.kind === "view") this.confirm();
      waiting.reject(new Refusal(head));
    }
  }

  /**
   * Ask; a request of the same kind that still waits is dropped, since the server drops it too. Of views each that is
   * answered is shown, so that the picture follows a hand that moves faster than they are computed.
   *
   * @param {string} kind
   * @param {object} content
   * @param {Progress} [progress]
   * @returns {Promise<Frame>}
   */
  ask(kind, content, progress) {
    const id = ++this.number;
    for (const [number, each] of this.waiting) {
      if (each.kind === kind && kind !== "file" && kind !== "view") {
        this.waiting.delete(number);
        each.reject(new Dropped("a newer request took its place"));
      }
    }
    return new Promise((resolve, reject) => {
      if (!this.connected) {
        reject(new Dropped("the connection is lost"));
        return;
      }
      this.waiting.set(id, { resolve, reject, kind, progress });
      this.socket?.send(JSON.stringify({ id, kind, ...content }));
    });
  }

  /**
   * Give the server a file that the user has opened. One that it refuses is not kept, and one that is too large is not
   * sent: the server would close the socket, at every attempt to open it again.
   *
   * @param {string} name
   * @param {string} text
   */
  async sendFile(name, text) {
    const most = LARGEST_FILE.toLocaleString("en");
    if (text.length > LARGEST_FILE) throw refusal(`${name} has ${text.length.toLocaleString("en")} characters; at most ${most} are read`);
    if (JSON.stringify(text).length > 2 * LARGEST_FILE) throw refusal(`${name} is no text`);
    this.files.set(name, text);
    try {
      return await this.ask("file", { name, text });
    } catch (error) {
      if (error instanceof Refusal) this.files.delete(name);
      throw error;
    }
  }

  /** Tell the server that a view has been drawn: it sends no more than two that have not. */
  confirm() {
    if (this.connected) this.socket?.send('{"kind":"shown"}');
  }

  /** Have the server stop what it computes for this page. */
  stop() {
    if (this.connected) this.socket?.send('{"kind":"stop"}');
  }
}
