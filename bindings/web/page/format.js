/** Numbers and names as people read them. */

/** @returns a whole number with thin spaces between thousands */
export const count = (n) => Math.round(n).toLocaleString("en").replaceAll(",", "\u202f");

/** @returns milliseconds with two significant digits, without the unit */
export function milliseconds(ms) {
  if (Number.isNaN(ms)) return "–";
  if (ms < 0.001) return "< 0.001";
  return ms < 100 ? ms.toPrecision(2) : count(ms);
}

/** @returns a power of ten, without an exponent */
export const power = (decade) => decade < 0 ? (10 ** decade).toFixed(-decade) : count(10 ** decade);

/** @returns `bvh@cpu1` as `bvh`, and `bvh@gpu0` as `bvh, GPU` */
export const label = (algorithm) => algorithm.replace(/@cpu1$/, "").replace(/@cpu(\d+)$/, ", $1 threads")
  .replace(/@gpu.*$/, ", GPU");

/** @returns the values of the colours of the style sheet by their names without dashes, for canvases */
export function colours(names) {
  const style = getComputedStyle(document.documentElement);
  return Object.fromEntries(names.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
}

/** @returns the name of the colour of the algorithm with this number */
export const hue = (index) => `hue-${index % 8}`;
