import assert from "node:assert/strict";
import test from "node:test";
import { doubleLoop, random, sapwise, scatter } from "./common.mjs";

const { algorithms, findPairs, scenarios, Scene } = sapwise;
const two = new Float32Array([0, 0, 0, 1, 1, 1, 1, 0, 0, 2, 1, 1]);

test("every algorithm finds the pairs of the double loop", () => {
  assert.deepEqual(algorithms(), ["brute", "sap", "grid-sap", "bvh", "pair-cache"].map((name) => `${name}@cpu1`));
  const scenes = [scatter(0, 1), scatter(1, 1), scatter(2, 1, 1), scatter(300, 2), scatter(900, 3, 40), two];
  for (const name of scenarios()) scenes.push(new Scene(name, 400, 7).boxes().slice());
  for (const boxes of scenes) {
    const expected = doubleLoop(boxes);
    assert.deepEqual(findPairs(boxes), expected);
    for (const algorithm of algorithms()) assert.deepEqual(findPairs(boxes, { algorithm }), expected, algorithm);
  }
  assert.deepEqual(findPairs(two, { algorithm: "bvh" }), new Uint32Array([0, 1]));
});

test("infinite boxes are legal", () => {
  const boxes = scatter(50, 4);
  boxes.set([-Infinity, -Infinity, -Infinity, Infinity, Infinity, Infinity], 60);
  for (const algorithm of algorithms()) assert.deepEqual(findPairs(boxes, { algorithm }), doubleLoop(boxes));
});

test("filters drop what they say", () => {
  const [count, next] = [500, random(5)];
  const boxes = scatter(count, 6);
  const draw = (most) => Uint32Array.from({ length: count }, () => Math.floor(next() * most));
  const [groups, masks, owner] = [draw(16), draw(16), draw(5)];
  const fixed = Uint8Array.from(draw(3), (n) => n === 0);
  const wants = (i, j) => (groups[i] & masks[j]) !== 0 && (groups[j] & masks[i]) !== 0
    && !(fixed[i] && fixed[j]) && (owner[i] !== owner[j] || owner[i] === 0);
  const expected = doubleLoop(boxes, wants);
  assert.ok(expected.length > 50 && expected.length < doubleLoop(boxes).length / 2);
  for (const algorithm of algorithms()) {
    assert.deepEqual(findPairs(boxes, { algorithm, groups, masks, owner, fixed }), expected, algorithm);
  }
  // One value for all.
  assert.equal(findPairs(two, { fixed: true }).length, 0);
  assert.equal(findPairs(two, { owner: 7 }).length, 0);
  assert.equal(findPairs(two, { groups: 1, masks: 2 }).length, 0);
  assert.equal(findPairs(two, { groups: 3, masks: 2 }).length, 2);
});

test("margin and limit", () => {
  const apart = new Float32Array([0, 0, 0, 1, 1, 1, 1.5, 0, 0, 2, 1, 1]);
  assert.equal(findPairs(apart, { margin: 0.4 }).length, 0);
  assert.equal(findPairs(apart, { margin: 0.5 }).length, 2);
  // The sum of 16777216 and 1.5 is no 32-bit float: the next ones are 16777216 and 16777218.
  const far = new Float32Array([0, 0, 0, 16777216, 1, 1, 16777218, 0, 0, 16777220, 1, 1]);
  assert.equal(findPairs(far, { margin: 1.5, limit: 0 }).length, 0);
  assert.equal(findPairs(far, { margin: 2 }).length, 2);
  assert.equal(findPairs(two, { limit: 1 }).length, 2);
  assert.throws(() => findPairs(two, { limit: 0 }), /more pairs than the limit of 0/);
});

test("wrong input is an error that says what is wrong", () => {
  const wrong = (what, boxes, options) => assert.throws(() => findPairs(boxes, options), { name: "Error", message: what });
  wrong(/boxes must be a Float32Array/, [0, 0, 0, 1, 1, 1]);
  wrong(/boxes must be a Float32Array/, undefined);
  wrong(/boxes must be a Float32Array/, new Float64Array(6));
  wrong(/boxes has 7 numbers; give six for each/, new Float32Array(7));
  for (const algorithm of algorithms()) {
    wrong(/box 1 has a bound that is not a number/, new Float32Array([0, 0, 0, 1, 1, 1, NaN, 0, 0, 1, 1, 1]), { algorithm });
    wrong(/box 0 is inverted/, new Float32Array([2, 0, 0, 1, 1, 1]), { algorithm });
  }
  wrong(/box 0 is inverted/, new Float32Array([2, 0, 0, 1, 1, 1]), { margin: 5 });
  wrong(/no algorithm is called "bvh@cpu2"; use brute@cpu1, /, two, { algorithm: "bvh@cpu2" });
  wrong(/algorithm must be a text/, two, { algorithm: 7 });
  wrong(/groups has 3 entries for 2 boxes/, two, { groups: new Uint32Array(3) });
  wrong(/groups must be a Uint32Array/, two, { groups: [1, 1] });
  wrong(/owner is -1; give a whole number/, two, { owner: -1 });
  wrong(/fixed must be a Uint8Array/, two, { fixed: [true, false] });
  wrong(/margin is -1/, two, { margin: -1 });
  wrong(/limit is NaN/, two, { limit: "many" });
  wrong(/options has no grups; use algorithm, limit, margin, groups/, two, { grups: 1 });
  wrong(/options must be an object/, two, 7);
  assert.deepEqual(findPairs(two), new Uint32Array([0, 1]));
});

test("arrays of other realms and views of the module's memory are read", async () => {
  const { runInNewContext } = await import("node:vm");
  assert.deepEqual(findPairs(runInNewContext("new Float32Array([0, 0, 0, 1, 1, 1, 1, 0, 0, 2, 1, 1])")), new Uint32Array([0, 1]));
  const scene = new Scene("clustered", 2000, 3);
  const expected = doubleLoop(scene.boxes());
  const view = scene.boxes();
  assert.deepEqual(findPairs(view), expected);
  // Grows the memory, so that the old view is detached.
  new Scene("uniform", 1_000_000, 3).free();
  assert.equal(view.length, 0);
  assert.throws(() => findPairs(view), /call boxes\(\) of the scene again/);
  assert.deepEqual(findPairs(scene.boxes()), expected);
});
