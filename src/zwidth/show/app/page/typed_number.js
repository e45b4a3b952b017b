/**
 * The number that a text says, with a decimal point or comma; NaN for any other text, an empty one among them.
 *
 * @param {string} text
 * @returns {number}
 */
export function typedNumber(text) {
  const plain = text.trim().replace("\u2212", "-").replace(",", ".");
  return /^[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$/i.test(plain) ? Number(plain) : NaN;
}
