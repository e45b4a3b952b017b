/** The page's beginning: what is opened first, by the address, the command line, or the first bundled device. */

import { App } from "./app.js";
import { readLink } from "./state.js";

const token = new URLSearchParams(location.search).get("token") ?? "";

async function begin() {
  const answer = await fetch(`start${token ? `?token=${encodeURIComponent(token)}` : ""}`);
  const start = await answer.json();
  /** @type {{[name: string]: string}} */
  let files = Object.fromEntries((start.files ?? []).map((/** @type {any} */ file) => [file.name, file.text]));
  let state = start.state;
  let sentence = "";
  if (location.hash.length > 1) {
    try {
      ({ state, files } = await readLink(location.hash.slice(1)));
    } catch (error) {
      sentence = /** @type {Error} */ (error).message;
    }
  }
  const app = new App(token, state, files, start.local);
  if (sentence) app.say(sentence, true);
  Object.assign(window, { zwidth: app }); // for the console, and for tests
}

void begin();
