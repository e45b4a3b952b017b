/** What can be chosen below the device: a map, a model, a hand, an assembly. */

/** @typedef {import("./state.js").State} State */

/**
 * @param {{model: HTMLSelectElement, operator: HTMLSelectElement, assembly: HTMLSelectElement, measure: HTMLSelectElement}} selects
 * @param {any} head      what the server tells of the device
 * @param {State} state
 * @param {boolean} another  whether the device is another one; otherwise its map stays
 */
export function writeChoices(selects, head, state, another) {
  const named = (/** @type {string[]} */ names) => names.map((name) => [name, name]);
  // with a hand that was chosen the server tells of that one, and not of the file's
  const given = state.operator ? "as in the file" : head.operator ? `${head.operator} (file)` : "nobody";
  options(selects.model, [["", head.given_by === "mechanism" ? "full" : "as given"], ...named(head.models)], state.model ?? "");
  options(selects.operator, [["", given], ...(given === "nobody" ? [] : [["none", "nobody"]]), ...named(head.operators)], state.operator ?? "");
  options(selects.assembly, [["", head.reference?.assembly ?? "–"], ...named(head.assemblies)], state.assembly ?? "");
  const measures = head.measures.map((/** @type {any} */ { name }) => [name, name.replaceAll("_", " ")]);
  options(selects.measure, [["", "none"], ...measures], another ? "" : selects.measure.value);
  for (const select of [selects.model, selects.assembly, selects.measure]) select.disabled = select.options.length < 2;
}

/** @param {HTMLSelectElement} select @param {string[][]} pairs @param {string} value */
function options(select, pairs, value) {
  select.replaceChildren(...pairs.map(([key, text]) => new Option(text, key)));
  select.value = value;
}
