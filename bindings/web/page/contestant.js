import { BroadPhase } from "./sapwise.js";

/** Milliseconds that a frame of a fixed algorithm may take. Above, it waits for fewer objects. */
const PATIENCE = 100;

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
  /** The last frame that it ran. Starts with so few objects that any algorithm is fast. */
  #seen = { objects: 100, ms: 0 };

  /** Throws if this browser cannot run the algorithm. */
  constructor(algorithm) {
    this.#phase = new BroadPhase(algorithm);
  }

  /**
   * Runs a frame.
   * @returns its milliseconds, or NaN if it would take too long
   */
  run(boxes) {
    // From few objects to many by factors of four, since brute force would freeze the page after a jump.
    for (let objects = 0; objects < boxes.length / 6;) {
      objects = Math.min(boxes.length / 6, Math.max(this.#seen.objects, 100) * 4);
      // At worst, time grows with the square of the objects.
      const expected = Math.max(this.#seen.ms, 0.1) * (objects / this.#seen.objects) ** 2;
      if (expected > PATIENCE) return NaN;
      const start = performance.now();
      this.#phase.update(boxes.subarray(0, objects * 6));
      const ms = performance.now() - start;
      // One frame that another program disturbed must not stop it.
      this.#seen = { objects, ms: Math.min(ms, Math.max(2 * expected, 1)) };
      if (objects === boxes.length / 6) return ms;
    }
    return 0;
  }

  free() {
    this.#phase.free();
  }
}
