import { count, hue, label, power } from "./format.js";
import { element } from "./panel.js";

/** Sizes in CSS pixels: height of the drawing, and room for the axes and for the names of the curves. */
const [HEIGHT, LEFT, RIGHT, BOTTOM, FIELD] = [320, 50, 78, 34, 8];

const median = (values) => [...values].sort((a, b) => a - b)[values.length >> 1];

/** @returns for each algorithm its points `[objects, milliseconds]`, ascending, of rows with nanoseconds */
function byAlgorithm(rows) {
  const lines = new Map();
  for (const { algorithm, objects, ns } of rows.sort((a, b) => a.objects - b.objects)) {
    lines.set(algorithm, [...lines.get(algorithm) ?? [], [objects, Math.max(ns, 1) / 1e6]]);
  }
  return lines;
}

/** @returns the fields of optimal performance: `{ algorithm, from, to }` in objects */
export function fields(lines) {
  const sizes = [...new Set([...lines.values()].flatMap((line) => line.map(([objects]) => objects)))];
  const at = (algorithm, size) => lines.get(algorithm).find(([objects]) => objects === size)?.[1] ?? Infinity;
  const best = (size) => [...lines.keys()].reduce((a, b) => at(b, size) < at(a, size) ? b : a);
  const found = [];
  sizes.sort((a, b) => a - b).forEach((size, i) => {
    const [algorithm, last] = [best(size), found.at(-1)];
    if (last?.algorithm === algorithm) {
      last.to = size;
      return;
    }
    let from = size;
    if (last) {
      // Where the two lines meet, both straight between the sizes in logarithms.
      const before = sizes[i - 1];
      const lead = Math.log(at(algorithm, before) / at(last.algorithm, before));
      const lag = Math.log(at(last.algorithm, size) / at(algorithm, size));
      const share = Number.isFinite(lead) && Number.isFinite(lag) && lead + lag > 0 ? lead / (lead + lag) : 0.5;
      from = last.to = before * (size / before) ** share;
    }
    found.push({ algorithm, from, to: size });
  });
  return found;
}

/** Moves heights apart that are closer than `gap`, in their order. */
function spread(heights, gap) {
  const order = heights.map((_, i) => i).sort((a, b) => heights[a] - heights[b]);
  const moved = [...heights];
  order.slice(1).forEach((i, k) => { moved[i] = Math.max(moved[i], moved[order[k]] + gap); });
  return moved;
}

/**
 * @returns a figure of a scene: milliseconds over objects, both as logarithms, with the field of each algorithm, and
 * dashed what the model predicts
 */
export function curves(report, prediction, scene, algorithms, width) {
  const of = ({ scenario }) => scenario === scene;
  const lines = byAlgorithm(report.points.filter(of).flatMap(({ load: { objects }, timings }) => timings
    .filter((timing) => timing.samples_ns.length > 0)
    .map((timing) => ({ algorithm: timing.algorithm, objects, ns: median(timing.samples_ns) }))));
  const most = Math.max(...[...lines.values()].flat().map(([, ms]) => ms));
  // What is far above all that was measured would flatten the rest.
  const predicted = byAlgorithm(prediction.filter((row) => of(row) && row.ns < 4e6 * most));
  const best = fields(lines);
  const words = best.map(({ algorithm, from }, i) => label(algorithm)
    + (i > 0 ? ` from ${count(Number(from.toPrecision(2)))}` : "")).join(", ");

  const points = [...lines.values(), ...predicted.values()].flat();
  const range = (axis) => [Math.min, Math.max].map((pick) => Math.log10(pick(...points.map((point) => point[axis]))));
  const [[left, right], [low, high]] = [range(0), range(1)];
  const [floor, wide] = [HEIGHT - BOTTOM, width - LEFT - RIGHT];
  const x = (objects) => LEFT + wide * (Math.log10(objects) - left) / Math.max(right - left, 0.1);
  const y = (ms) => floor - (floor - 2 * FIELD) * (Math.log10(ms) - low) / Math.max(high - low, 0.1);
  const decades = (from, to) => Array.from({ length: 12 }, (_, i) => i - 6).filter((d) => d >= from && d <= to + 0.01);
  const paint = (algorithm, shapes) => `<g style="--hue: var(--${hue(algorithms.indexOf(algorithm))})">${shapes}</g>`;
  const path = (line, kind) => `<path class="curve ${kind}" d="M${
    line.map(([objects, ms]) => `${x(objects).toFixed(1)} ${y(ms).toFixed(1)}`).join("L")}"/>`;

  const shapes = best.map(({ algorithm, from, to }, i) => {
    const field = `class="field" x="${x(from)}" width="${x(to) - x(from)}"`;
    const border = i > 0 ? `<path class="border" d="M${x(from)} 0V${floor}"/>` : "";
    const shapes = `<rect ${field} height="${FIELD}"/><rect ${field} height="${floor}" opacity="0.1"/>${border}`;
    return paint(algorithm, shapes);
  });
  shapes.push(...decades(left, right).map((decade) => `<text x="${x(10 ** decade)}" y="${floor + 16}"
    text-anchor="middle">${power(decade)}</text>`));
  shapes.push(...decades(low, high).map((decade) => [decade, y(10 ** decade)]).map(([decade, at]) => `
    <path class="rule" d="M${LEFT} ${at}h${wide}"/>
    <text x="${LEFT - 8}" y="${at + 4}" text-anchor="end">${power(decade)}</text>`));
  // An algorithm that left the sweep has its name at the end of what is predicted.
  const ends = spread([...lines].map(([algorithm, line]) => {
    const [objects, ms] = line.at(-1);
    return y(objects > 0.9 * 10 ** right ? ms : predicted.get(algorithm)?.at(-1)[1] ?? ms);
  }), 15);
  [...lines].forEach(([algorithm, line], i) => shapes.push(paint(algorithm, `${path(line, "")}${
    path(predicted.get(algorithm) ?? line, "predicted")}
    <text class="name" x="${LEFT + wide + 6}" y="${ends[i] + 4}">${label(algorithm)}</text>`)));
  shapes.push(`<text x="0" y="${FIELD}">ms</text>
    <text x="${LEFT + wide / 2}" y="${HEIGHT - 2}" text-anchor="middle">objects</text>`);
  const figure = element("figure", {}, element("h3", {}, scene),
    element("figcaption", {}, `Fastest by the number of objects: ${words}.`));
  figure.style.width = `${width}px`;
  figure.insertAdjacentHTML("beforeend", `<svg width="${width}" height="${HEIGHT}" role="img"
    aria-label="${scene}: milliseconds a frame over objects. ${words}.">${shapes.join("")}</svg>`);
  return figure;
}
