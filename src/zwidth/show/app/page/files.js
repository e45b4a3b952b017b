import { LARGEST_FILE, refusal } from "./connection.js";

/**
 * Offer bytes as a file to keep.
 *
 * @param {string} name
 * @param {Uint8Array<ArrayBuffer>} bytes
 */
export function saveBytes(name, bytes) {
  const address = URL.createObjectURL(new Blob([bytes]));
  const link = document.createElement("a");
  link.href = address;
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(address), 1000);
}

/** An empty tab that says what it waits for. @param {string} sentence  Throws Refusal where the browser allows none */
export function newTab(sentence) {
  const tab = window.open("", "_blank");
  if (!tab) throw refusal("this browser lets no page open a tab; save the report as a file instead");
  tab.document.title = sentence;
  tab.document.body.textContent = sentence;
  return tab;
}

/**
 * Show a report in a tab. It goes through the server, which hands it out so that nothing in it can run. Throws Refusal
 * where the server takes none.
 *
 * @param {Window} tab
 * @param {Uint8Array<ArrayBuffer>} bytes
 * @param {string} token
 */
export async function showReport(tab, bytes, token) {
  const answer = await fetch(`reports?token=${encodeURIComponent(token)}`, { method: "POST", body: bytes });
  if (!answer.ok) throw refusal((await answer.text()).trim());
  tab.location.href = new URL(`reports/${await answer.text()}`, location.href).href;
}

/**
 * Names and texts of files. Throws Refusal for one that is too large to be read at all.
 *
 * @param {FileList} files
 */
export async function readTexts(files) {
  const large = [...files].find((file) => file.size > 4 * LARGEST_FILE); // bytes; a character has four at most
  if (large) throw refusal(`${large.name} has ${Math.round(large.size / 1e6)} MB; at most ${LARGEST_FILE.toLocaleString("en")} characters are read`);
  return Promise.all([...files].map(async (file) => ({ name: file.name, text: await file.text() })));
}

/**
 * A device file for a measured response.
 *
 * @param {string} file
 * @param {number} period  [s]
 */
export function responseDevice(file, period) {
  const name = JSON.stringify(file);
  return `name = ${name}\n\n[response]\nfile = ${name}\n\n[loop]\nsampling_period_s = ${period}\n`;
}

/**
 * Take files that are dropped anywhere on the page.
 *
 * @param {HTMLElement} sign  shown while files are dragged over the page
 * @param {(files: FileList | null) => void} onFiles
 */
export function listenToDrops(sign, onFiles) {
  addEventListener("dragover", (event) => {
    event.preventDefault();
    sign.hidden = false;
  });
  addEventListener("dragleave", (event) => {
    if (!event.relatedTarget) sign.hidden = true;
  });
  addEventListener("drop", (event) => {
    event.preventDefault();
    sign.hidden = true;
    onFiles(event.dataTransfer?.files ?? null);
  });
}
