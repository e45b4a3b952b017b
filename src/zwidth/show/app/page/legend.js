/** The legend below the chart: a line as it is drawn and its name, for each outline and condition that is shown. */

import { palette } from "./canvas.js";

/** @typedef {import("./chart_view.js").ChartView} ChartView */

/**
 * @param {HTMLElement} list
 * @param {ChartView} chart
 * @param {() => void} onRemove  a pinned chart, or the measured walls, have been removed
 */
export function writeLegend(list, chart, onRemove) {
  const colours = /** @type {any} */ (palette(chart.canvas));
  const outlines = chart.outlines(colours).map((one, n) => {
    const item = itemOf(one, "");
    if (n < chart.pinned.length) item.append(removal(one.name, () => {
      chart.pinned.splice(n, 1);
      onRemove();
    }));
    return item;
  });
  const conditions = chart.bounds(colours).map((one) => itemOf({ ...one, name: one.holds ? one.name : `${one.name} (assumptions not met)` }, one.source));
  list.replaceChildren(...outlines, ...conditions, ...pointsOf(chart, onRemove));
}

/** @param {{name: string, colour: string, dash: number[]}} one @param {string} title */
function itemOf(one, title) {
  const item = document.createElement("li");
  const picture = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  const line = document.createElementNS("http://www.w3.org/2000/svg", "line");
  for (const [key, value] of Object.entries({ x1: 0, y1: 4, x2: 26, y2: 4, stroke: one.colour, "stroke-width": 2, "stroke-dasharray": one.dash.join(" ") })) line.setAttribute(key, String(value));
  picture.append(line);
  item.append(picture, one.name);
  item.title = title;
  return item;
}

/** Measured walls, if there are any. @param {ChartView} chart @param {() => void} onRemove */
function pointsOf(chart, onRemove) {
  const { points } = chart;
  if (!points.length) return [];
  const unstable = points.filter((point) => point.measured === "unstable").length;
  const item = document.createElement("li");
  item.append([unstable < points.length && "○ measured", unstable && "× measured as unstable"].filter(Boolean).join(", "));
  item.append(removal("the measured points", () => {
    chart.points = [];
    onRemove();
  }));
  return [item];
}

/** @param {string} name @param {() => void} onClick */
function removal(name, onClick) {
  const button = document.createElement("button");
  button.type = "button";
  button.textContent = "×";
  button.setAttribute("aria-label", `Remove ${name}`);
  button.addEventListener("click", onClick);
  return button;
}
