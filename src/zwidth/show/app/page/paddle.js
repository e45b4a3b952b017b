/**
 * Measured walls of a paddle: lines from its microcontroller over WebSerial, or from a record of them.
 *
 * The format is text, a line each, SI units; docs/paddle.md describes it:
 *
 *     #zwidth 1 period_s=0.001                        first: version of the format, sampling period [s]
 *     trial 900 1 stable 26.4                         stiffness [N/m], damping [N s/m], verdict, frequency [Hz]
 *     sample 0.25 0.0004 -0.36                        time [s], position of the handle [m], force [N]
 *     # words                                         a comment
 */

/** @typedef {"stable" | "unstable"} Verdict */
/** @typedef {{stiffness: number, damping: number, verdict: Verdict, frequency: number}} Trial */
/** @typedef {{time: number, position: number, force: number}} Sample */
/** @typedef {{kind: "header", version: number, period: number}} HeaderLine */
/** @typedef {{kind: "trial"} & Trial} TrialLine */
/** @typedef {{kind: "sample"} & Sample} SampleLine */
/** @typedef {{kind: "comment", text: string}} CommentLine */
/** @typedef {{kind: "fault", sentence: string}} FaultLine */
/** @typedef {HeaderLine | TrialLine | SampleLine | CommentLine | FaultLine} Line */
/** @typedef {{name: string, unit: string, low: number, high: number}} Range */
/**
 * @typedef {object} Listeners
 * @property {(trial: Trial) => void} onTrial
 * @property {(sample: Sample) => void} onSample
 * @property {(sentence: string) => void} onFault
 * @property {() => void} onEnd
 */

const VERSION = 1;
const LONGEST_LINE = 200; // characters; more without a line's end is another baud rate, or another program
const SHOWN = 40; // characters of a faulty line that its sentence repeats
/** @type {Range} */
const PERIOD = { name: "period_s", unit: "s", low: 1e-5, high: 0.1 };
/** @type {Range[]} */
const TRIAL = [
  { name: "stiffness", unit: "N/m", low: -1e7, high: 1e7 },
  { name: "damping", unit: "N s/m", low: -1e5, high: 1e5 },
  { name: "frequency", unit: "Hz", low: 0, high: 5e4 },
];
/** @type {Range[]} */
const SAMPLE = [
  { name: "time", unit: "s", low: 0, high: 1e7 },
  { name: "position", unit: "m", low: -10, high: 10 },
  { name: "force", unit: "N", low: -1e4, high: 1e4 },
];
const NUMBER = /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i; // not what Number() reads besides: "", "0x10", "Infinity"

/**
 * Read one line of the stream.
 *
 * @param {string} text  without its line's end
 * @returns {Line}       a fault is a sentence that says what, and what is allowed; nothing is thrown
 */
export function parseLine(text) {
  const line = text.trim();
  if (line.length > LONGEST_LINE) return fault(line, `is longer than ${LONGEST_LINE} characters`);
  if (/^#zwidth(\s|$)/.test(line)) return parseHeader(line);
  if (line === "" || line.startsWith("#")) return { kind: "comment", text: line.slice(1).trim() };
  const [word, ...cells] = line.split(/\s+/);
  if (word === "trial") return parseTrial(line, cells);
  if (word === "sample") return parseSample(line, cells);
  return fault(line, "must begin with trial, sample or #");
}

/**
 * @param {string} line
 * @returns {Line}
 */
function parseHeader(line) {
  const found = /^#zwidth\s+(\d+)\s+period_s=(\S+)$/.exec(line);
  if (!found) return fault(line, `must read #zwidth ${VERSION} period_s=0.001`);
  const version = Number(found[1]);
  if (version !== VERSION) return fault(line, `is of version ${version}, but this page reads version ${VERSION}`);
  const [[period], wrong] = numbersOf([found[2]], [PERIOD]);
  return wrong ? fault(line, wrong) : { kind: "header", version, period };
}

/**
 * @param {string} line
 * @param {string[]} cells
 * @returns {Line}
 */
function parseTrial(line, cells) {
  if (cells.length !== 4) return fault(line, `has ${cells.length} values after trial, not K B verdict frequency_Hz`);
  const [stiff, damp, verdict, often] = cells;
  if (verdict !== "stable" && verdict !== "unstable") {
    return fault(line, `has the verdict ${shown(verdict)}, but it must be stable or unstable`);
  }
  const [[stiffness, damping, frequency], wrong] = numbersOf([stiff, damp, often], TRIAL);
  return wrong ? fault(line, wrong) : { kind: "trial", stiffness, damping, verdict, frequency };
}

/**
 * @param {string} line
 * @param {string[]} cells
 * @returns {Line}
 */
function parseSample(line, cells) {
  if (cells.length !== 3) return fault(line, `has ${cells.length} values after sample, not t x f`);
  const [[time, position, force], wrong] = numbersOf(cells, SAMPLE);
  return wrong ? fault(line, wrong) : { kind: "sample", time, position, force };
}

/**
 * Numbers of cells, and what is wrong with the first that is none or out of its range ("" if nothing).
 *
 * @param {string[]} cells
 * @param {Range[]} ranges
 * @returns {[number[], string]}
 */
function numbersOf(cells, ranges) {
  const numbers = cells.map((cell) => (NUMBER.test(cell) ? Number(cell) : NaN));
  for (const [k, { name, unit, low, high }] of ranges.entries()) {
    if (Number.isNaN(numbers[k])) return [numbers, `has ${shown(cells[k])} as ${name}, which is no number`];
    if (numbers[k] < low || numbers[k] > high) {
      return [numbers, `has ${shown(cells[k])} as ${name}, but it must be from ${low} to ${high} ${unit}`];
    }
  }
  return [numbers, ""];
}

/**
 * @param {string} line
 * @param {string} wrong
 * @returns {FaultLine}
 */
function fault(line, wrong) {
  return { kind: "fault", sentence: `The line ${shown(line)} ${wrong}.` };
}

/**
 * Text between quotes, cut where it is long, without characters that cannot be shown.
 *
 * @param {string} text
 */
function shown(text) {
  const cut = text.length > SHOWN ? `${text.slice(0, SHOWN)}...` : text;
  return `"${cut.replace(/[^\x20-\x7e]/g, "?")}"`;
}

/**
 * Trials as a CSV file that zwidth reads: `zwidth experiment device.toml --measured trials.csv`.
 *
 * @param {Trial[]} trials
 */
export function toCsv(trials) {
  const rows = trials.map(({ stiffness, damping, verdict }) => `${stiffness},${damping},${verdict}\n`);
  return `stiffness_N_per_m,damping_Ns_per_m,verdict\n${rows.join("")}`;
}

const BAUD = 115200;
const MOST_FAULTS = 20; // lines in a row, after which a stream is something else
const LONGEST_WAIT = 5; // s of a replay without a line, however long the record was silent

/**
 * Why lines cannot be read from a serial port here; "" if they can.
 *
 * @param {{isSecureContext?: boolean, navigator?: object}} scope  the page's window
 */
export function serialMissing(scope = globalThis) {
  if (scope.isSecureContext === false) {
    return "A serial port can be read only from a secure address: open the workbench at 127.0.0.1 or over https.";
  }
  if (scope.navigator && "serial" in scope.navigator) return "";
  return "This browser cannot read a serial port (WebSerial): use Chrome, Edge or Opera on a computer, or replay a record.";
}

/**
 * Trials and samples of a paddle as they come, from a port or a record; one at a time.
 *
 * What goes wrong is a sentence for `onFault`. `onEnd` is called once for each start, however it ends.
 */
export class PaddleStream {
  /** @param {Listeners} listeners */
  constructor(listeners) {
    this.listeners = listeners;
    this.rest = ""; // characters of a line that has not ended
    this.overlong = false; // `rest` was given up; its line has not ended
    this.lines = 0;
    this.faults = 0; // in a row
    this.period = NaN; // s, as the header says
    /** @type {object | null} */
    this.source = null; // what is read now; another one once it was stopped
    /** @type {any} */
    this.reader = null;
    /** @type {any} */
    this.port = null;
    /** @type {Promise<void>} */
    this.closing = Promise.resolve(); // settled when the port of before is free again
  }

  /** Ask the person for a port and read it until `stop`, or until it is unplugged. Must follow a click. */
  async connectSerial() {
    const missing = serialMissing();
    const source = this.begin();
    const ended = this.closing;
    let release = () => {};
    this.closing = new Promise((resolve) => (release = resolve));
    try {
      if (missing) this.listeners.onFault(missing);
      else await this.readPort(source, ended);
    } catch (error) {
      this.listeners.onFault(sentenceOf(error));
    } finally {
      release();
      this.end(source);
    }
  }

  /**
   * @param {object} source
   * @param {Promise<void>} ended
   */
  async readPort(source, ended) {
    const port = await /** @type {any} */ (navigator).serial.requestPort();
    await ended;
    if (source !== this.source) return;
    await port.open({ baudRate: BAUD });
    this.port = port;
    const decoder = new TextDecoder();
    try {
      // after a framing or parity error the port offers another stream, and the reading goes on
      while (source === this.source && port.readable) {
        this.reader = port.readable.getReader();
        try {
          for (let read = await this.reader.read(); !read.done; read = await this.reader.read()) {
            if (source !== this.source) break;
            this.take(decoder.decode(read.value));
          }
        } catch (error) {
          if (source === this.source) this.hear({ kind: "fault", sentence: sentenceOf(error) });
        } finally {
          this.reader.releaseLock();
          this.reader = null;
        }
      }
    } finally {
      if (this.port === port) this.port = null;
      await port.close().catch(() => {}); // unplugged: it is closed
    }
  }

  /**
   * Send a command to the paddle: `wall K B`, `sweep B K0 K1 STEP` or `stop`.
   *
   * @param {string} command
   */
  async send(command) {
    if (!this.port?.writable) {
      this.listeners.onFault("No paddle is connected, so nothing was sent.");
      return;
    }
    try {
      const writer = this.port.writable.getWriter();
      const sent = writer.write(new TextEncoder().encode(`${command}\n`));
      writer.releaseLock(); // at once, so that a command can follow before this one is sent
      await sent;
    } catch (error) {
      this.listeners.onFault(sentenceOf(error));
    }
  }

  /**
   * Hand out the lines of a record at the pace at which they came.
   *
   * @param {string} text   lines of the format
   * @param {number} speed  1: as it happened; Infinity: at once
   */
  async replay(text, speed) {
    const source = this.begin();
    if (!(speed > 0)) {
      this.listeners.onFault(`The speed of a replay must be positive, got ${speed}.`);
      this.end(source);
      return;
    }
    let last = NaN;
    let due = performance.now();
    for (const line of text.split(/\r\n|\n|\r/)) {
      const found = parseLine(line);
      if (found.kind === "sample") {
        // a clock that goes back is a board that was started again
        const passed = Math.min(Math.max(found.time - last, 0) / speed, LONGEST_WAIT);
        due += Number.isNaN(last) ? 0 : 1000 * passed;
        last = found.time;
        const wait = due - performance.now();
        if (wait > 4) await new Promise((resolve) => setTimeout(resolve, wait)); // browsers wait no shorter
      }
      if (source !== this.source) return;
      this.hear(found);
    }
    this.end(source);
  }

  /** End what is read now; the port is free for other programs. */
  stop() {
    if (this.source) this.end(this.source);
  }

  /** Begin a source, after the one of before was ended. */
  begin() {
    this.stop();
    this.rest = "";
    this.overlong = false;
    this.lines = 0;
    this.faults = 0;
    this.period = NaN;
    this.source = {};
    return this.source;
  }

  /** @param {object} source */
  end(source) {
    if (source !== this.source) return;
    this.source = null;
    void this.reader?.cancel().catch(() => {});
    this.listeners.onEnd();
  }

  /**
   * Take characters as they come; lines may be cut anywhere.
   *
   * @param {string} text
   */
  take(text) {
    const lines = (this.rest + text).split("\n");
    this.rest = lines.pop() ?? "";
    for (const line of lines) {
      if (this.source === null) return;
      // the first line of a port may have begun before it was opened
      const found = this.overlong ? null : parseLine(line);
      this.overlong = false;
      if (found && (this.lines > 0 || found.kind !== "fault")) this.hear(found);
      this.lines += 1;
    }
    if (this.rest.length > LONGEST_LINE) {
      if (!this.overlong) this.hear(fault(this.rest, `is longer than ${LONGEST_LINE} characters`));
      this.overlong = true;
      this.rest = "";
    }
  }

  /** @param {Line} line */
  hear(line) {
    const { onTrial, onSample, onFault } = this.listeners;
    if (line.kind === "header") this.period = line.period;
    this.faults = line.kind === "fault" ? this.faults + 1 : 0;
    if (line.kind === "sample") onSample({ time: line.time, position: line.position, force: line.force });
    if (line.kind === "trial") {
      const { stiffness, damping, verdict, frequency } = line;
      if (frequency > 0.5 / this.period) {
        onFault(`A trial has ${frequency} Hz, but samples every ${this.period} s show at most ${0.5 / this.period} Hz.`);
      } else onTrial({ stiffness, damping, verdict, frequency });
    }
    if (line.kind === "fault") onFault(line.sentence);
    if (this.faults === MOST_FAULTS) {
      onFault(`${MOST_FAULTS} lines in a row could not be read: the paddle must send lines of zwidth at ${BAUD} baud.`);
      this.stop();
    }
  }
}

/**
 * What a browser says went wrong with a port, for people.
 *
 * @param {unknown} error
 */
function sentenceOf(error) {
  const { name, message } = error instanceof Error ? error : { name: "", message: String(error) };
  if (name === "NotFoundError") return "No port was chosen.";
  if (name === "NetworkError") return `The port cannot be read: ${message} Is it unplugged, or open in another program?`;
  if (name === "InvalidStateError") return "The port is open already.";
  return `The port gave a fault: ${message}`;
}
