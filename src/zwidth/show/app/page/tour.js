/**
 * The guided tour: six states of the page, each with a question that is answered by moving something.
 *
 * `tour.json` holds the words and states; a step is done when the wall is stable, or the device let go comes to rest,
 * and nothing but what the question names was moved.
 */

/** @typedef {import("./state.js").State} State */
/**
 * @typedef {object} Step
 * @property {string} title
 * @property {string} text
 * @property {string} question
 * @property {string} hint
 * @property {string} answer
 * @property {State} state
 * @property {"stable" | "rests"} until
 * @property {string[]} moves
 */

/**
 * Whether a step's question is answered.
 *
 * @param {Step} step
 * @param {State} state
 * @param {string | undefined} verdict  on the wall, of the view of this state
 * @param {boolean} rests  whether the device, let go in this state, has come to rest
 */
export function isDone(step, state, verdict, rests) {
  const wall = step.state.wall;
  const kept = state.device === step.state.device && state.wall?.stiffness === wall?.stiffness && state.wall?.damping === wall?.damping;
  const moved = Object.entries(state.settings).filter(([path, value]) => JSON.stringify(step.state.settings[path]) !== JSON.stringify(value));
  const others = moved.filter(([path]) => !step.moves.includes(path));
  const hand = step.moves.includes("operator") || (state.operator ?? null) === null;
  return kept && hand && !others.length && (step.until === "stable" ? verdict === "stable" : rests);
}

export class Tour {
  /**
   * @param {HTMLElement} element
   * @param {{onState: (state: State) => void, onEnd: () => void}} listeners
   */
  constructor(element, listeners) {
    this.element = element;
    this.listeners = listeners;
    /** @type {Step[]} */
    this.steps = [];
    this.at = -1;
    this.done = false;
  }

  get step() {
    return this.steps[this.at] ?? null;
  }

  async begin() {
    if (!this.steps.length) this.steps = (await (await fetch("tour.json")).json()).steps;
    this.go(0);
  }

  end() {
    this.at = -1;
    this.element.hidden = true;
    this.listeners.onEnd();
  }

  /** @param {number} at */
  go(at) {
    this.at = Math.min(Math.max(at, 0), this.steps.length - 1);
    this.done = false;
    this.listeners.onState(/** @type {Step} */ (this.step).state);
    this.write(false);
    this.element.hidden = false;
    this.element.querySelector("h3")?.focus();
  }

  /**
   * The page's state has changed.
   *
   * @param {State} state
   * @param {string | undefined} verdict
   * @param {boolean} rests
   */
  look(state, verdict, rests) {
    if (!this.step || this.done || !isDone(this.step, state, verdict, rests)) return;
    this.done = true;
    this.write(false);
  }

  /** @param {boolean} hinted */
  write(hinted) {
    const step = /** @type {Step} */ (this.step);
    const title = paragraph("h3", `${this.at + 1} of ${this.steps.length}: ${step.title}`);
    title.tabIndex = -1;
    const parts = [title, paragraph("p", step.text), paragraph("p", step.question, "question")];
    if (hinted) parts.push(paragraph("p", step.hint, "hint"));
    if (this.done) {
      const answer = paragraph("p", `✓ ${step.answer}`, "answer");
      answer.setAttribute("role", "status");
      parts.push(answer);
    }
    const tools = document.createElement("div");
    tools.className = "tools";
    tools.append(
      button("Back", () => this.go(this.at - 1), this.at === 0),
      button("Hint", () => this.write(true), hinted || this.done),
      button(this.at + 1 < this.steps.length ? "Next" : "Finish", () => (this.at + 1 < this.steps.length ? this.go(this.at + 1) : this.end()), false),
      button("Close", () => this.end(), false),
    );
    this.element.replaceChildren(...parts, tools);
  }
}

/** @param {string} tag @param {string} text @param {string} [kind] */
function paragraph(tag, text, kind) {
  const made = document.createElement(tag);
  made.textContent = text;
  if (kind) made.className = kind;
  return made;
}

/** @param {string} text @param {() => void} onClick @param {boolean} off */
function button(text, onClick, off) {
  const made = document.createElement("button");
  made.type = "button";
  made.textContent = text;
  made.disabled = off;
  made.addEventListener("click", onClick);
  return made;
}
