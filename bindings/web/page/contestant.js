import { BroadPhase } from "./sapwise.js";

/** Milliseconds that a frame of a fixed algorithm may take. Above, it waits for fewer objects. */
const PATIENCE = 100;
/** Objects for which any algorithm is fast. */
const FEW = 100;

/** @returns the smallest step of this browser's clock in milliseconds, from 20 steps */
export function clockResolution() {
  const steps = [];
  for (let last = performance.now(); steps.length < 20;) {
    const now = performance.now();
    if (now > last) steps.push(now - last);
    last = now;
  }
  return Math.min(...steps);
}

/** A fixed algorithm that runs beside the adaptive choice. */
export class Contestant {
  #phase;
  /** The last frame that it ran. */
  #seen = { objects: 0, ms: 0 };

  /** Throws if this browser cannot run the algorithm. */
  constructor(algorithm) {
    this.#phase = new BroadPhase(algorithm);
  }

  /**
   * Runs a frame.
   * @returns its milliseconds, or NaN if it would take too long
   */
  run(boxes) {
    let [objects, ms] = [0, 0];
    // From few objects to many by factors of four, since brute force would freeze the page after a jump.
    do {
      const known = Math.max(this.#seen.objects, FEW);
      objects = Math.min(boxes.length / 6, 4 * known);
      // At worst, time grows with the square of the objects.
      const expected = Math.max(this.#seen.ms, 0.1) * (objects / known) ** 2;
      if (expected > PATIENCE) return NaN;
      const start = performance.now();
      this.#phase.update(boxes.subarray(0, objects * 6));
      ms = performance.now() - start;
      // One frame that another program disturbed must not stop it.
      this.#seen = { objects, ms: Math.min(ms, Math.max(2 * expected, 1)) };
    } while (objects < boxes.length / 6);
    return ms;
  }

  free() {
    this.#phase.free();
  }
}
