// The scenes and the pairs are those of tests/golden.rs, to the last bit.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import test from "node:test";
import { sapwise, sorted } from "./common.mjs";

const { algorithms, BroadPhase, findPairs, Scene } = sapwise;
const FRAMES = 500;

/** FNV-1a of 64 bits, in two halves. */
class Hash {
  #low = 0x84222325;
  #high = 0xcbf29ce4;

  add(word) {
    for (let shift = 0; shift < 32; shift += 8) {
      const low = (this.#low ^ (word >>> shift & 255)) >>> 0;
      // The prime is 2^40 + 435.
      const product = low * 435;
      this.#low = product >>> 0;
      this.#high = (Math.imul(this.#high, 435) + (product - this.#low) / 2 ** 32 + (low << 8)) >>> 0;
    }
  }

  list(words, count) {
    this.add(count);
    words.forEach((word) => this.add(word));
  }

  toString() {
    return [this.#high, this.#low].map((half) => half.toString(16).padStart(8, "0")).join("");
  }
}

const lines = readFileSync(new URL("../../../../tests/fixtures/golden.csv", import.meta.url), "utf8").trim().split("\n");
assert.equal(lines.shift(), "scenario,objects,every,boxes_fnv1a,pairs_fnv1a");
assert.equal(lines.length, 75);
// Every frame of one scene: tests/golden.rs has that of the others, and frames.test.mjs frames of five of them.
const kept = lines.filter((line) => !line.includes(",1,") || line.startsWith("fragmentation,"));
assert.equal(kept.length, 51);
for (const line of kept) {
  const [scenario, objects, every, ofBoxes, ofPairs] = line.split(",");
  test(`${scenario}, ${objects} objects, every ${every}. frame`, () => {
    const scene = new Scene(scenario, Number(objects), 42);
    const phases = [undefined, ...algorithms()].map((algorithm) => new BroadPhase(algorithm));
    const hashes = ["boxes", "findPairs", "choice", ...algorithms()].map((name) => [name, new Hash()]);
    for (let frame = 0; frame < FRAMES; frame++, scene.step()) {
      if (frame % every !== 0) continue;
      const boxes = scene.boxes().slice();
      hashes[0][1].list(new Uint32Array(boxes.buffer), scene.length);
      [findPairs(boxes), ...phases.map((phase) => sorted(phase.update(boxes)))].forEach((pairs, k) => {
        hashes[k + 1][1].list(pairs, pairs.length / 2);
      });
    }
    hashes.forEach(([name, hash], k) => assert.equal(`${hash}`, k === 0 ? ofBoxes : ofPairs, name));
    [scene, ...phases].forEach((object) => object.free());
  });
}
