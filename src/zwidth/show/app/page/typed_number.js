/**
 * The number that a text says, with a decimal point or comma; NaN for any other text, an empty one among them, and for
 * one such as 1,500, which some read as 1.5 and others as 1500.
 *
 * @param {string} text
 * @returns {number}
 */
export function typedNumber(text) {
  const plain = text.trim().replace("\u2212", "-").replace(",", ".");
  if (/^[-+]?[1-9]\d{0,2}(,\d{3})+$/.test(text.trim())) return NaN;
  return /^[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$/i.test(plain) ? Number(plain) : NaN;
}
