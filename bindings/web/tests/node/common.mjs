// Shared by the tests. SAPWISE_NPM is the folder of the package.
import { pathToFileURL } from "node:url";

export const sapwise = await import(pathToFileURL(`${process.env.SAPWISE_NPM}/node.js`));
await sapwise.default();

/** Marsaglia's xorshift: a function that returns numbers from 0 to 1. */
export function random(seed) {
  let state = BigInt(seed) * 0x9e3779b97f4a7c15n % 2n ** 64n;
  const wrap = (x) => x % 2n ** 64n;
  return () => {
    state = wrap(state ^ (state << 13n));
    state ^= state >> 7n;
    state = wrap(state ^ (state << 17n));
    return Number(state >> 40n) / 2 ** 24;
  };
}

/** Boxes of all sizes in a cube. */
export function scatter(count, seed, edge = 12) {
  const next = random(seed);
  const boxes = new Float32Array(6 * count);
  for (let k = 0; k < count; k++) {
    const size = next() < 0.05 ? edge : 2;
    for (let a = 0; a < 3; a++) {
      boxes[6 * k + a] = next() * edge;
      boxes[6 * k + 3 + a] = boxes[6 * k + a] + next() * size;
    }
  }
  return boxes;
}

export const overlap = (boxes, i, j) => [0, 1, 2].every((a) =>
  boxes[6 * i + a] <= boxes[6 * j + 3 + a] && boxes[6 * j + a] <= boxes[6 * i + 3 + a]);

/** The definition: a double loop. */
export function doubleLoop(boxes, wants = () => true) {
  const pairs = [];
  for (let i = 0; i < boxes.length / 6; i++) {
    for (let j = i + 1; j < boxes.length / 6; j++) {
      if (overlap(boxes, i, j) && wants(i, j)) pairs.push(i, j);
    }
  }
  return new Uint32Array(pairs);
}

/** Pairs in canonical order. */
export function sorted(pairs) {
  const order = Array.from({ length: pairs.length / 2 }, (_, k) => [pairs[2 * k], pairs[2 * k + 1]]);
  return new pairs.constructor(order.sort(([a, b], [c, d]) => Number(a - c) || Number(b - d)).flat());
}
