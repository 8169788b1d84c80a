import assert from "node:assert/strict";
import test from "node:test";
import { doubleLoop, sapwise, sorted } from "./common.mjs";

const { algorithms, BroadPhase, Scene, scenarios, useTuning } = sapwise;

test("every algorithm and the choice find the pairs of each frame", () => {
  for (const name of ["uniform", "clustered", "fragmentation", "rods", "teleport"]) {
    const phases = [new BroadPhase(), ...algorithms().map((algorithm) => new BroadPhase(algorithm))];
    const scene = new Scene(name, 600, 1);
    for (let frame = 0; frame < 40; frame++, scene.step()) {
      const boxes = scene.boxes().slice();
      const expected = doubleLoop(boxes);
      for (const phase of phases) assert.deepEqual(sorted(phase.update(boxes)), expected, name);
    }
    phases.forEach((phase) => phase.free());
  }
});

test("the choice follows the number of boxes, and learns from the clock", () => {
  const phase = new BroadPhase();
  assert.equal(phase.decision(), undefined);
  const ran = new Set();
  let switches = 0;
  for (const objects of [10, 20, 5000, 20_000]) {
    const scene = new Scene("uniform", objects, 1);
    for (let frame = 0; frame < 60; frame++, scene.step()) {
      phase.update(scene.boxes());
      const { algorithm, because, switched, trial } = phase.decision();
      assert.equal(trial, because.startsWith("not the cheapest"));
      ran.add(algorithm);
      switches += switched;
      // By the number of boxes alone nothing is expected.
      if (ran.size > 1 || frame > 0) assert.match(because, /^[a-z][^(]*\([\d.]+ ms expected, [a-z-]+ [\d.]+ ms\)$/);
    }
  }
  assert.ok(ran.has("brute@cpu1") && ran.size > 1 && switches > 0, [...ran].join());
});

test("an empty frame and a failed one do no harm", () => {
  const phase = new BroadPhase();
  assert.equal(phase.update(new Float32Array(0)).length, 0);
  assert.throws(() => phase.update(new Float32Array([NaN, 0, 0, 1, 1, 1])), /box 0 has a bound/);
  assert.throws(() => phase.update("boxes"), /must be a Float32Array/);
  assert.deepEqual(phase.update(new Float32Array([0, 0, 0, 1, 1, 1, 0, 0, 0, 1, 1, 1])), new Uint32Array([0, 1]));
  assert.throws(() => new BroadPhase("fastest"), /no algorithm is called "fastest"/);
  phase.free();
  assert.throws(() => phase.update(new Float32Array(0)), Error);
});

test("a tuning decides", () => {
  assert.throws(() => useTuning("{}"), /schema/);
  const steps = [{ from_objects: 0, algorithm: "sap@cpu1" }];
  const tuning = {
    schema: "tuning/3", source: "default", model: null, extrapolated: false, warnings: [], scenario: "uniform", steps,
    crossovers: [], interval_basis: "", costs: [],
  };
  useTuning(JSON.stringify(tuning));
  const phase = new BroadPhase();
  phase.update(new Float32Array(600));
  assert.equal(phase.decision().algorithm, "sap@cpu1");
  assert.match(phase.decision().because, /^the cheapest in the first frame$/);
});

test("boxes of a scene can be split and deleted", () => {
  const scene = new Scene("uniform", 10, 1);
  const before = scene.boxes().slice();
  scene.split(3);
  assert.equal(scene.length, 17);
  const edge = before[21] - before[18];
  const pieces = [3, 10, 11, 12, 13, 14, 15, 16].map((k) => scene.boxes().slice(6 * k, 6 * k + 6));
  for (const piece of pieces) assert.ok(Math.abs(piece[3] - piece[0] - edge / 2) < 1e-6);
  const whole = [0, 1, 2].map((a) => [Math.min(...pieces.map((p) => p[a])), Math.max(...pieces.map((p) => p[a + 3]))]);
  whole.forEach(([low, high], a) => assert.ok(Math.abs(low - before[18 + a]) + Math.abs(high - before[21 + a]) < 1e-5));
  const last = scene.boxes().slice(96);
  scene.remove(0);
  assert.equal(scene.length, 16);
  assert.deepEqual(scene.boxes().slice(0, 6), last);
  scene.step();
  // The pieces fly apart.
  const apart = scene.boxes().slice(6 * 10, 6 * 11);
  assert.notDeepEqual(apart, pieces[1]);
  scene.resize(50);
  assert.equal(scene.length, 50);
  assert.throws(() => scene.split(50), /there is no box 50: the scene has 50/);
  assert.throws(() => scene.remove(99), /there is no box 99/);
  assert.throws(() => scene.resize(1e9), /objects is 1000000000; give a whole number/);
  assert.throws(() => new Scene("unifrom", 5, 1), /"unifrom" is no scenario; use one of uniform/);
  assert.equal(scenarios().length, 25);
  // A scene whose own number of objects changes.
  const fragments = new Scene("fragmentation", 800, 1);
  const counts = new Set();
  for (let frame = 0; frame < 600; frame++, fragments.step()) {
    if (frame === 265) fragments.split(700);
    counts.add(fragments.length);
    assert.equal(fragments.boxes().length, 6 * fragments.length);
  }
  assert.ok(counts.has(10) && counts.has(807), [...counts].join());
});
