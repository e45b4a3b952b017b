/**
 * The page: one state, three views of it, and the numbers beside them.
 *
 *     a change of the state ──▶ request ──▶ frame ──▶ drawn on the next animation frame ──▶ confirmed
 *
 * Whatever is asked for is asked for in `ask`; whatever is drawn is drawn in `draw`.
 */

import { quantity } from "./canvas.js";
import { ChartView } from "./chart_view.js";
import { Connection, Dropped, Refusal } from "./connection.js";
import { linkOf, readLink, Store } from "./state.js";
import { NumbersPanel } from "./numbers_panel.js";
import { DeviceView } from "./device_view.js";
import { FaceView } from "./face_view.js";
import { ContactPanel } from "./contact_panel.js";
import { PaddlePanel } from "./paddle_panel.js";
import { writeLegend } from "./legend.js";
import { WallFields } from "./wall_fields.js";
import { writeChoices } from "./device_choices.js";
import { typedNumber } from "./typed_number.js";
import { Tour } from "./tour.js";
import { listenToDrops, newTab, readTexts, responseDevice, saveBytes, showReport } from "./files.js";

/** @typedef {import("./connection.js").Frame} Frame */
/** @typedef {import("./state.js").State} State */

const FAST = ["frequency", "decay", "models", "hands"]; // layers that come with every view
const SLOW = ["guarantees", "bounds"]; // and those that follow when the hand rests
const RESTS = 250; // ms without a change after which they are asked for

const LOST = "The connection to zwidth is lost; the page keeps its numbers and tries again.";
// Columns by which a table of measurements is a response and not a list of walls.
const RESPONSE = /real_m_per_N|force_command_N/;
// A state that says nothing but which device.
const NOWHERE = { from_file: false, settings: {}, position: null, direction: null, axis: null, assembly: null, model: null, operator: null, hand: null };

/** @param {string} id @returns {any} */
const byId = (id) => document.getElementById(id);

export class App {
  /**
   * @param {string} token
   * @param {State} state
   * @param {{[name: string]: string}} files
   * @param {boolean} local  whether the server is on this computer
   */
  constructor(token, state, files, local) {
    this.local = local;
    this.store = new Store({ ...state, settings: state.settings ?? {} }, (next) => this.changed(next));
    /** @type {any} */
    this.device = null;
    /** @type {Frame | null} */
    this.view = null;
    this.opened = "";
    this.shown = ""; // device whose view is drawn
    /** @type {Set<string>} */
    this.own = new Set(); // device files that have been opened
    this.keys = "";
    this.mapped = ""; // of what the map is
    this.waits = false; // something is to be drawn on the next frame
    this.undrawn = 0; // views that have come and are not confirmed yet
    this.rests = 0;
    this.face = "chart";
    this.unreached = false; // whether the handle is dragged to where it cannot be
    /** @type {import("./state.js").Vector | null} */
    this.reached = null; // where it was last
    this.chart = new ChartView(byId("chart"), {
      onWall: (wall, drag) => this.store.set({ wall }, drag),
      onRelease: () => this.store.release(),
    });
    this.faceView = new FaceView(byId("face"));
    this.deviceView = new DeviceView(byId("scene"), byId("links"), {
      onPosition: (position, drag) => this.store.set({ position }, drag),
      onDirection: (direction, drag) => this.store.set({ direction, axis: null }, drag),
      onRelease: () => {
        this.deviceView.wanted = null;
        this.store.release();
        if (this.unreached) this.store.set({ position: this.reached });
      },
    });
    this.numbers = new NumbersPanel(byId("number-list"), {
      onNumber: (settings, drag) => this.store.setNumbers(settings, drag),
      onRelease: () => this.store.release(),
    });
    this.wallFields = new WallFields(
      { stiffness: byId("wall-stiffness"), damping: byId("wall-damping"), stiffnessUnit: byId("wall-stiffness-unit"), dampingUnit: byId("wall-damping-unit"), verdict: byId("verdict") },
      { onWall: (wall) => this.store.set({ wall }), say: (sentence, wrong) => this.say(sentence, wrong) },
    );
    /** @type {import("./state.js").Hand | null} */
    this.hand = null; // that touches now; not part of the history
    this.contact = new ContactPanel(
      { tools: byId("contact-tools"), canvas: byId("motion"), text: byId("contact-text") },
      {
        onHand: (hand) => {
          this.hand = this.held ? null : hand;
          void this.ask();
        },
        onSimulate: async (options) => {
          try {
            const frame = await this.connection.ask("contact", { state: this.sent(), ...options }, this.progress);
            this.say("");
            this.tour.look(this.state, undefined, frame.head.stable === true);
            return frame;
          } catch (error) {
            this.fail(error);
            return null;
          }
        },
        onVibration: (trail, step) => this.deviceView.setVibration(trail, step),
        onLetGo: (frame, trail, step) => this.deviceView.replay(frame, trail, step),
        say: (sentence, wrong) => this.say(sentence, wrong),
      },
    );
    this.paddle = new PaddlePanel(byId("paddle"), {
      onTrials: (trials) => {
        this.chart.points = trials.map((trial) => ({ stiffness: trial.stiffness, damping: trial.damping, measured: trial.verdict }));
        this.chart.follow();
        this.drawSoon();
      },
      wall: () => this.state.wall ?? null,
      stiffnessMax: () => this.view?.head.chart.stiffness_max ?? 0,
    });
    this.tour = new Tour(byId("card"), {
      onState: (next) => this.store.set({ ...NOWHERE, ...next }),
      onEnd: () => byId("tour").focus(),
    });
    this.connection = new Connection(token, {
      onOpen: () => this.refresh(),
      onLost: () => this.say(LOST, true),
    });
    for (const [name, text] of Object.entries(files)) this.connection.files.set(name, text);
    this.listen();
  }

  /** Whether an operator of the file, or one that was chosen, holds the handle. */
  get held() {
    return this.state.operator ? this.state.operator !== "none" : Boolean(this.device?.operator);
  }

  /** The state as the server takes it: without what is not set, held by the hand that touches. */
  sent(hand = this.hand) {
    const state = hand ? { ...this.state, operator: null, hand } : this.state;
    return Object.fromEntries(Object.entries(state).filter(([, value]) => value !== null && value !== undefined));
  }

  get state() {
    return this.store.state;
  }

  // --- asking -----------------------------------------------------------------------------------------

  /** Ask anew for everything that is shown. */
  refresh() {
    this.undrawn = 0;
    this.opened = "";
    this.changed(this.state);
  }

  /** @param {State} state */
  changed(state) {
    const opened = `${state.from_file ? "file" : "bundled"} ${state.device}`;
    const keys = `${opened} ${JSON.stringify(Object.entries(state.settings).filter(([, value]) => typeof value !== "number"))} ${Object.keys(state.settings).sort()} ${state.operator} ${state.assembly}`;
    if (keys !== this.keys || !this.opened) {
      this.keys = keys;
      void this.openDevice(opened);
    }
    // a map of other numbers goes, and comes anew when the hand rests
    const mapped = JSON.stringify([state.device, state.settings, state.direction, state.axis, state.assembly, state.model]);
    if (mapped !== this.mapped) this.deviceView.map = null;
    this.mapped = mapped;
    this.numbers.update(state.settings);
    this.chart.wall = state.wall ?? null;
    byId("undo").disabled = !this.store.past.length;
    byId("redo").disabled = !this.store.future.length;
    this.writeWall();
    void this.ask();
  }

  /** @param {string} opened */
  async openDevice(opened) {
    const another = opened !== this.opened;
    this.opened = opened;
    if (this.shown !== opened) {
      this.contact.forget(); // it was another device's
      this.say(`computing the chart of ${this.state.device}…`); // until its view has come
    }
    try {
      const { head } = await this.connection.ask("open", { state: this.sent(null) });
      this.device = head;
      this.writeDevice(head, another);
    } catch (error) {
      this.fail(error);
    }
  }

  /** Ask for the view of the present state, and later for what takes longer. */
  async ask() {
    clearTimeout(this.rests);
    this.rests = setTimeout(() => void this.askMore(), RESTS);
    const state = this.state;
    const layers = ["chart", "scene", ...FAST.filter((name) => name !== "frequency" && this.chart.layers.has(name)), ...this.faceLayers(), ...(this.contact.touching ? ["touch"] : [])];
    try {
      const frame = await this.connection.ask("view", { state: this.sent(), layers, nearest: this.store.dragged === "handle" });
      this.view = frame;
      this.shown = this.opened;
      this.undrawn++;
      this.chart.setFrame(frame);
      this.deviceView.setFrame(frame, this.opened);
      this.tour.look(this.state, frame.head.chart.wall?.verdict, false);
      this.contact.update(frame, this.state.wall ?? null);
      this.say("");
      this.drawSoon();
      this.unreached = false;
      this.reached = frame.head.position ?? state.position ?? null;
      // a handle that is dragged beyond its reach slides along what is answered
      if (frame.head.position && this.state === state) this.store.correct({ position: frame.head.position });
    } catch (error) {
      // one without an answered position goes back to where it was last
      this.unreached = error instanceof Refusal && this.deviceView.held === "handle";
      if (error instanceof Refusal && error.status !== "stopped" && this.shown !== this.opened) this.showNothing();
      this.fail(error);
    }
  }

  /** Nothing is known of the device that is open: what was shown is another's. */
  showNothing() {
    this.view = null;
    for (const each of [this.chart, this.deviceView]) each.frame = null;
    this.contact.stop();
    this.drawSoon();
  }

  async askMore() {
    if (!this.deviceView.map) void this.showMap(byId("measure").value);
    const layers = SLOW.filter((name) => this.chart.layers.has(name));
    if (!layers.length) {
      this.chart.more = null;
      return;
    }
    this.say(`computing ${layers.join(" and ").replace("bounds", "published conditions")}…`);
    try {
      this.chart.more = await this.connection.ask("more", { state: this.sent(), layers }, this.progress);
      this.say("");
      this.drawSoon();
    } catch (error) {
      this.fail(error);
    }
  }

  /** Ask for the map of a measure behind the device; none for "". @param {string} measure */
  async showMap(measure) {
    this.deviceView.map = null;
    this.drawSoon();
    if (!measure) return;
    this.say(`mapping ${measure.replaceAll("_", " ")}…`);
    try {
      const { head, arrays } = await this.connection.ask("map", { state: this.sent(), measure }, this.progress);
      const values = (/** @type {string} */ name) => /** @type {Float64Array} */ (arrays[name].values);
      this.deviceView.map = { x: values("x"), y: values("y"), values: values("values"), first: values("first"), second: values("second"), through: values("through"), unit: head.unit, name: measure.replaceAll("_", " ") };
      this.say("");
      this.drawSoon();
    } catch (error) {
      this.fail(error);
    }
  }

  faceLayers() {
    return ["impedance", "nyquist", "eigenvalues"].includes(this.face) ? [this.face] : [];
  }

  progress = (/** @type {string} */ stage, /** @type {number} */ done, /** @type {number} */ of) => {
    this.say(of ? `${stage}: ${done} of ${of}` : `${stage}…`);
  };

  /** @param {unknown} error */
  fail(error) {
    if (error instanceof Dropped) {
      if (!this.connection.connected) this.say(LOST, true);
      return;
    }
    if (error instanceof Refusal) {
      if (error.status !== "stopped") this.say(error.message, true);
      return;
    }
    throw error;
  }

  // --- drawing ----------------------------------------------------------------------------------------

  drawSoon() {
    if (this.waits) return;
    this.waits = true;
    requestAnimationFrame(() => {
      this.waits = false;
      this.draw();
      for (; this.undrawn > 0; this.undrawn--) this.connection.confirm();
    });
  }

  draw() {
    if (this.face === "chart") this.chart.draw();
    else {
      this.faceView.frame = this.view;
      this.faceView.draw();
    }
    this.deviceView.draw();
    this.writeHeadline();
    this.writeCaveats();
    writeLegend(byId("legend"), this.chart, () => {
      this.chart.follow();
      this.drawSoon();
    });
    this.writeWall();
  }

  /** What the chart leaves out under load, and why guarantees are withheld or rest on what is not known. */
  writeCaveats() {
    const guarantees = this.chart.layers.has("guarantees") ? this.chart.more?.head.guarantees : null;
    const texts = [...(this.view?.head.chart.caveats ?? []), ...(guarantees?.caveats ?? [])];
    const line = byId("caveats");
    line.textContent = texts.map((text) => `${text[0].toUpperCase()}${text.slice(1)}.`).join(" ");
    line.hidden = !texts.length;
  }

  writeHeadline() {
    const chart = this.view?.head.chart;
    const line = byId("headline");
    if (!chart || chart.reason) {
      line.textContent = chart ? "No chart of this device" : "";
      return;
    }
    const { K, B } = this.chart.units;
    byId("goal-unit").textContent = `k${K}`;
    if (!(chart.stiffness_max > 0)) {
      line.textContent = "No stable wall has K > 0 and B ≥ 0.";
      return;
    }
    const strong = document.createElement("strong");
    strong.textContent = quantity(chart.stiffness_max, K);
    const hertz = chart.frequencies.map((/** @type {number} */ f) => quantity(f, "Hz")).join(" and ");
    line.replaceChildren("up to ", strong, ` at ${quantity(chart.damping_at_stiffness_max, B)} of damping; there it oscillates at ${hertz}`);
  }

  writeWall() {
    this.wallFields.write(this.state.wall ?? null, this.view?.head.chart.wall, this.chart.units);
  }

  /** @param {any} head @param {boolean} another */
  writeDevice(head, another) {
    const choice = byId("device-choice");
    const names = head.devices.map((/** @type {any} */ each) => each.name);
    if (this.state.from_file) this.own.add(this.state.device);
    const own = [...this.own].filter((name) => this.connection.files.has(name));
    choice.replaceChildren(...[...own, ...names].map((name) => new Option(name, name)));
    choice.value = this.state.device;
    choice.title = head.description;
    document.title = `${head.name} – zwidth`;
    this.numbers.setNumbers(head.numbers, this.state.settings, another);
    writeChoices({ model: byId("model"), operator: byId("operator"), assembly: byId("assembly"), measure: byId("measure") }, head, this.state, another);
    if (another) {
      this.chart.box = null;
      this.chart.more = null;
      this.deviceView.map = null;
      this.numbers.sortBy(null);
      byId("sort").setAttribute("aria-pressed", "false");
    }
  }

  /** @param {string} sentence @param {boolean} [wrong] */
  say(sentence, wrong = false) {
    const status = byId("status");
    status.textContent = sentence;
    status.classList.toggle("wrong", wrong);
  }

  // --- what the user does -----------------------------------------------------------------------------

  listen() {
    byId("undo").addEventListener("click", () => this.store.undo());
    byId("redo").addEventListener("click", () => this.store.redo());
    byId("share").addEventListener("click", () => void this.share());
    byId("tour").addEventListener("click", () => void this.tour.begin());
    byId("pin").addEventListener("click", () => this.pin());
    byId("theme").addEventListener("click", () => this.setTheme(document.documentElement.dataset.theme === "dark" ? "light" : "dark"));
    byId("sort").addEventListener("click", () => void this.sort());
    byId("seek").addEventListener("click", () => void this.seek());
    byId("filter").addEventListener("input", () => this.numbers.show(byId("filter").value));
    byId("whole").addEventListener("change", () => this.chart.showWhole(byId("whole").checked));
    byId("device-choice").addEventListener("change", () => this.choose(byId("device-choice").value));
    byId("export").addEventListener("change", () => void this.export(byId("export").value));
    byId("open-file").addEventListener("click", () => byId("file").click());
    byId("file").addEventListener("change", () => void this.openFiles(byId("file").files));
    for (const box of document.querySelectorAll("[data-layer]")) {
      box.addEventListener("change", () => {
        const input = /** @type {HTMLInputElement} */ (box);
        if (input.checked) this.chart.layers.add(String(input.dataset.layer));
        else this.chart.layers.delete(String(input.dataset.layer));
        void this.ask();
        this.drawSoon();
      });
    }
    for (const [id, key] of [["model", "model"], ["operator", "operator"], ["assembly", "assembly"]]) {
      byId(id).addEventListener("change", () => this.store.set({ [key]: byId(id).value || null }));
    }
    byId("measure").addEventListener("change", () => void this.showMap(byId("measure").value));
    new ResizeObserver(() => this.drawSoon()).observe(byId("scene"));
    for (const tab of document.querySelectorAll("[role=tab]")) {
      tab.addEventListener("click", () => this.showFace(/** @type {HTMLElement} */ (tab).dataset.face ?? "chart"));
    }
    byId("faces").addEventListener("keydown", (/** @type {KeyboardEvent} */ event) => this.stepFace(event));
    new ResizeObserver(() => this.drawSoon()).observe(byId("face"));
    addEventListener("keydown", (event) => this.shortcut(event));
    addEventListener("hashchange", () => void this.followLink());
    new ResizeObserver(() => this.drawSoon()).observe(byId("chart"));
    this.setTheme(matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
    listenToDrops(byId("drop"), (files) => void this.openFiles(files));
  }

  /** @param {string} face */
  showFace(face) {
    this.face = face;
    this.faceView.face = face;
    byId("chart").hidden = face !== "chart";
    byId("face").hidden = face === "chart";
    for (const tab of document.querySelectorAll("[role=tab]")) {
      const chosen = /** @type {HTMLElement} */ (tab).dataset.face === face;
      tab.setAttribute("aria-selected", String(chosen));
      tab.setAttribute("tabindex", chosen ? "0" : "-1");
    }
    void this.ask();
    this.drawSoon();
  }

  /** Arrow keys go from one tab to the next. @param {KeyboardEvent} event */
  stepFace(event) {
    const way = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!way) return;
    const tabs = /** @type {HTMLElement[]} */ ([...document.querySelectorAll("[role=tab]")]);
    const at = tabs.findIndex((tab) => tab.dataset.face === this.face);
    const next = tabs[(at + way + tabs.length) % tabs.length];
    this.showFace(next.dataset.face ?? "chart");
    next.focus();
  }

  /** @param {KeyboardEvent} event */
  shortcut(event) {
    if (!(event.ctrlKey || event.metaKey)) return;
    const typing = event.target instanceof HTMLInputElement && event.target.type !== "range" && event.target.type !== "checkbox";
    if (typing) return;
    const key = event.key.toLowerCase();
    if (key === "z" && !event.shiftKey) this.store.undo();
    else if (key === "y" || (key === "z" && event.shiftKey)) this.store.redo();
    else return;
    event.preventDefault();
  }

  /** @param {string} device */
  choose(device) {
    const from_file = this.connection.files.has(device);
    this.store.set({ ...NOWHERE, device, from_file });
  }

  /** @param {string} theme */
  setTheme(theme) {
    document.documentElement.dataset.theme = theme;
    this.drawSoon();
  }

  pin() {
    if (!this.view || this.view.head.chart.reason) return;
    const names = this.chart.pinned.map((each) => each.name);
    let n = 1;
    while (names.includes(`pinned ${n}`)) n++;
    this.chart.pinned.push({ name: `pinned ${n}`, frame: this.view });
    this.drawSoon();
  }

  async share() {
    const files = this.state.from_file ? Object.fromEntries(this.connection.files) : {};
    const address = `${location.origin}${location.pathname}${location.search}#${await linkOf(this.state, files)}`;
    history.replaceState(null, "", address);
    try {
      await navigator.clipboard.writeText(address);
      this.say("the link is copied; the numbers are in it");
    } catch {
      this.say("the link is in the address bar; the numbers are in it");
    }
  }

  async followLink() {
    try {
      const { state, files } = await readLink(location.hash.slice(1));
      for (const [name, text] of Object.entries(files)) await this.connection.sendFile(name, text);
      this.store.set(state);
    } catch (error) {
      this.say(/** @type {Error} */ (error).message, true);
    }
  }

  async sort() {
    const button = byId("sort");
    if (button.getAttribute("aria-pressed") === "true") {
      button.setAttribute("aria-pressed", "false");
      this.numbers.sortBy(null);
      return;
    }
    this.say("computing what to change first…");
    const { settings } = this.state;
    try {
      const { head } = await this.connection.ask("sensitivity", { state: this.sent() }, this.progress);
      button.setAttribute("aria-pressed", "true");
      this.numbers.sortBy(head.sensitivities, settings);
      this.say("");
    } catch (error) {
      this.fail(error);
    }
  }

  async seek() {
    const field = byId("goal");
    const goal = 1000 * typedNumber(field.value);
    if (!(goal > 0)) {
      this.say(`a goal is a stiffness in ${byId("goal-unit").textContent}, a number above 0 such as 8; got "${field.value}"`, true);
      return;
    }
    this.say(`looking for what reaches ${quantity(goal, this.chart.units.K)}…`);
    const { settings } = this.state;
    try {
      const { head } = await this.connection.ask("sensitivity", { state: this.sent(), goal }, this.progress);
      byId("sort").setAttribute("aria-pressed", "true");
      this.numbers.sortBy(head.sensitivities, settings);
      this.numbers.setGoal(head.goal.goal ?? head.goal.numbers ?? [], settings);
      this.say("");
    } catch (error) {
      this.fail(error);
    }
  }

  /** @param {string} choice  what.format */
  async export(choice) {
    byId("export").value = "";
    if (!choice) return;
    const [what, ending] = choice.split(".");
    this.say(`writing the ${what}…`);
    let tab = null;
    try {
      tab = ending === "tab" ? newTab(`writing the ${what}…`) : null; // now: later a browser would not let a page open one
      const { head, arrays } = await this.connection.ask("export", { state: this.sent(), what, format: tab ? "html" : ending }, this.progress);
      const bytes = /** @type {Uint8Array<ArrayBuffer>} */ (arrays.content.values);
      if (tab) await showReport(tab, bytes, this.connection.token);
      else saveBytes(head.name, bytes);
      this.say(tab ? "the report is open in another tab" : `${head.name} is written`);
    } catch (error) {
      tab?.close();
      this.fail(error);
    }
  }

  /** @param {FileList | null} files */
  async openFiles(files) {
    if (!files?.length) return;
    try {
      const texts = await readTexts(files);
      for (const { name, text } of texts) await this.connection.sendFile(name, text);
      const device = texts.find(({ name }) => name.toLowerCase().endsWith(".toml"));
      const response = texts.find(({ text }) => RESPONSE.test(text.slice(0, text.indexOf("\n"))));
      if (device) await this.openFile(device.name);
      else if (response) await this.showResponse(response.name);
      else await this.showPoints(texts[0].name);
    } catch (error) {
      this.fail(error);
    }
    byId("file").value = "";
  }

  /** Choose a device file, which may replace one of its name; one that is faulty leaves all as it is. @param {string} name */
  async openFile(name) {
    await this.connection.ask("open", { state: { device: name, from_file: true } });
    this.opened = "";
    this.choose(name);
  }

  /** A measured response, sampled as the present device; its chart stays for comparison. @param {string} file */
  async showResponse(file) {
    const plain = `${file.replace(/\.\w+$/, "")}.toml`;
    const name = this.connection.files.has(plain) ? `${file}.toml` : plain;
    await this.connection.sendFile(name, responseDevice(file, this.view?.head.chart.sampling_period ?? 0.001));
    this.pin();
    await this.openFile(name);
  }

  /** @param {string} file */
  async showPoints(file) {
    const { head, arrays } = await this.connection.ask("points", { state: this.sent(), file });
    const walls = arrays.walls.values;
    this.chart.points = head.points.map((/** @type {any} */ each, /** @type {number} */ n) => ({
      stiffness: walls[2 * n],
      damping: walls[2 * n + 1],
      spread: [...arrays.spread.values.slice(4 * n, 4 * n + 4)],
      measured: each.verdict,
      verdict: head.verdicts[n],
    }));
    this.chart.follow();
    const judged = this.chart.points.filter((point) => point.measured);
    const agreeing = judged.filter((point) => point.measured === point.verdict).length;
    this.say(`${head.points.length} measured points of ${file}${judged.length ? `; the chart agrees with ${agreeing} of ${judged.length} verdicts` : ""}`);
    this.drawSoon();
  }
}
