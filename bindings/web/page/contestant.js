import { BroadPhase, Gpu } from "./sapwise.js";

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

/** A promise of the GPU, once an algorithm on it was asked for. */
let gpu = null;

/** A fixed algorithm on WebGPU. When a frame is done it takes the boxes of the newest. */
export class GpuContestant {
  #phase;
  #failed;
  #busy = false;
  /** Of the last frame that is done, from the boxes to the pairs in the memory of the CPU; undefined before. */
  #ms;

  /** Rejects if there is no WebGPU. Calls `failed` with the error if the GPU is lost later. */
  static async open(algorithm, failed) {
    const made = new GpuContestant();
    made.#failed = failed;
    try {
      made.#phase = await (await (gpu ??= Gpu.open())).broadPhase(algorithm);
    } catch (error) {
      gpu = null;
      throw error;
    }
    return made;
  }

  /** Begins a frame if the previous one is done. @returns the milliseconds of the last one */
  run(boxes) {
    if (!this.#busy) this.#find(boxes);
    return this.#ms;
  }

  async #find(boxes) {
    this.#busy = true;
    const start = performance.now();
    try {
      await this.#phase.update(boxes);
      [this.#ms, this.#busy] = [performance.now() - start, false];
    } catch (error) {
      gpu = null;
      this.#failed(error);
    }
  }

  free() {
    this.#phase.free();
  }
}
