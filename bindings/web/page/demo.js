import { BroadPhase, Scene } from "./sapwise.js";
import { Contestant, GpuContestant } from "./contestant.js";
import { Encounters } from "./encounters.js";

/** Frames that are remembered: ten seconds at 60 a second. */
export const SPAN = 600;
/** Switches that are remembered. */
const SWITCHES = 8;
const SEED = 1;

/** A scene, the adaptive choice, and the fixed algorithms beside it. */
export class Demo {
  /** `{ algorithm, because, ms, objects, pairs, begun, ended, fixed }` of the last frames; `fixed` maps names to ms. */
  history = [];
  /** `{ frame, objects, from, to, because }`, the last one first. */
  switches = [];
  /** The fixed algorithms that run too, by name. */
  fixed = new Map();
  /** Boxes of this frame: minimum and maximum corner, six numbers each. */
  boxes = new Float32Array(0);
  /** Pairs of this frame: two indices each. */
  pairs = new Uint32Array(0);
  frame = 0;
  #scene;
  #adaptive = new BroadPhase();
  #encounters = new Encounters();
  /** The algorithm that ran last, trials left out. */
  #incumbent;

  constructor(scenario, objects) {
    this.restart(scenario, objects);
  }

  get objects() {
    return this.boxes.length / 6;
  }

  /** Pairs of each object, at most 255. */
  get hits() {
    return this.#encounters.hits;
  }

  /** Starts a scene. The adaptive choice goes on with what it has learned. */
  restart(scenario, objects) {
    this.#scene?.free();
    this.#scene = new Scene(scenario, objects, SEED);
    this.find();
  }

  split(index) {
    if (index >= 0 && index < this.#scene.length) this.#scene.split(index);
  }

  /** Deletes objects but never the last one. */
  remove(indices) {
    // From the end, since the last object takes the place of the one that leaves.
    for (const index of [...indices].sort((a, b) => b - a)) {
      if (index >= this.#scene.length || this.#scene.length === 1) continue;
      this.#encounters.removed(index, this.#scene.length);
      this.#scene.remove(index);
    }
  }

  /** Runs a fixed algorithm too, or no longer. Rejects if this browser cannot; calls `failed` if it can no longer. */
  async compare(algorithm, wanted, failed) {
    this.fixed.get(algorithm)?.free();
    this.fixed.delete(algorithm);
    if (!wanted) return;
    const lost = (error) => this.compare(algorithm, false).then(() => failed(error));
    const onGpu = algorithm.includes("@gpu");
    this.fixed.set(algorithm, onGpu ? await GpuContestant.open(algorithm, lost) : new Contestant(algorithm));
  }

  /** Moves the objects by a frame and finds their pairs. */
  advance() {
    this.#scene.step();
    this.frame++;
    this.find();
  }

  /** Finds the pairs of the objects where they are. */
  find() {
    // A copy, since the view ends with the next call.
    const view = this.#scene.boxes();
    if (this.boxes.length === view.length) this.boxes.set(view);
    else this.boxes = view.slice();
    const start = performance.now();
    this.pairs = this.#adaptive.update(this.boxes);
    const ms = performance.now() - start;
    const { algorithm, because, trial } = this.#adaptive.decision();
    const fixed = new Map();
    for (const [name, contestant] of this.fixed) fixed.set(name, contestant.run(this.boxes));
    this.#encounters.update(this.pairs, this.objects);
    const [{ begun, ended }, { objects, frame }] = [this.#encounters, this];
    // A trial of some frames is no switch.
    if (algorithm !== this.#incumbent && !trial) {
      if (this.#incumbent) this.switches.unshift({ frame, objects, from: this.#incumbent, to: algorithm, because });
      this.switches.splice(SWITCHES);
      this.#incumbent = algorithm;
    }
    this.history.push({ algorithm, because, ms, objects, pairs: this.pairs.length / 2, begun, ended, fixed });
    if (this.history.length > SPAN) this.history.shift();
  }
}

/** @returns the mean of `value` over the last `frames` entries of the history, without those that are no numbers */
export function recent(history, frames, value) {
  const values = history.slice(-frames).map(value).filter((v) => v >= 0);
  return values.length > 0 ? values.reduce((sum, v) => sum + v, 0) / values.length : NaN;
}
