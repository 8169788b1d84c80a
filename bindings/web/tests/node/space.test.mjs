import assert from "node:assert/strict";
import test from "node:test";
import { overlap, random, sapwise, scatter, sorted } from "./common.mjs";

const { Space } = sapwise;
const big = (numbers) => BigUint64Array.from(numbers);

/** What a space does, by definition. */
class Model {
  bodies = new Map();
  pairs = [];

  update() {
    const handles = [...this.bodies.keys()].sort((a, b) => (a < b ? -1 : 1));
    const before = new Set(this.pairs.map(String));
    this.old = this.pairs;
    this.pairs = [];
    for (const [k, a] of handles.entries()) {
      for (const b of handles.slice(k + 1)) if (this.meet(a, b)) this.pairs.push([a, b]);
    }
    const now = new Set(this.pairs.map(String));
    this.begun = this.pairs.filter((pair) => !before.has(String(pair)));
    this.ended = this.old.filter((pair) => !now.has(String(pair)));
    this.seen = new Map([...this.bodies].map(([handle, body]) => [handle, body.box]));
  }

  meet(a, b) {
    const [one, other] = [this.bodies.get(a), this.bodies.get(b)];
    return !(one.fixed && other.fixed) && (one.owner === 0 || one.owner !== other.owner)
      && overlap([...one.box, ...other.box], 0, 1);
  }
}

test("a space does what a model of it does, in random calls", () => {
  for (const seed of [1, 2, 3, 4]) {
    const [space, model, next] = [new Space(), new Model(), random(seed)];
    const below = (most) => Math.floor(next() * most);
    const some = (most) => [...model.bodies.keys()].sort(() => next() - 0.5).slice(0, below(most));
    let [most, ends] = [0, 0];
    for (let frame = 0; frame < 120; frame++) {
      // Now and then so little happens that bodies rest.
      const calm = frame % 60 > 25;
      const boxes = scatter(calm ? 0 : below(24), 1000 * seed + frame);
      const count = boxes.length / 6;
      const fixed = Uint8Array.from({ length: count }, () => below(3) === 0);
      const owner = Uint32Array.from({ length: count }, () => below(4));
      space.insert(boxes, { fixed, owner }).forEach((handle, k) => {
        assert.ok(!model.bodies.has(handle));
        model.bodies.set(handle, { box: boxes.slice(6 * k, 6 * k + 6), fixed: fixed[k], owner: owner[k] });
      });
      const moved = some(calm ? 4 : 40);
      const places = scatter(moved.length, 5000 * seed + frame);
      space.set(big(moved), places);
      moved.forEach((handle, k) => { model.bodies.get(handle).box = places.slice(6 * k, 6 * k + 6); });
      const gone = some(frame === 59 ? 400 : calm ? 2 : 10);
      space.remove(big(gone));
      gone.forEach((handle) => model.bodies.delete(handle));
      space.update();
      model.update();
      assert.equal(space.length, model.bodies.size);
      assert.deepEqual(sorted(space.pairs()), sorted(big(model.pairs.flat())));
      assert.deepEqual(space.begun(), sorted(big(model.begun.flat())));
      assert.deepEqual(space.ended(), sorted(big(model.ended.flat())));
      [most, ends] = [Math.max(most, space.pairs().length), ends + space.ended().length];
      queries(space, model, scatter(1, 9000 * seed + frame));
    }
    assert.ok(most > 120 && ends > 400, `${most} ${ends}`);
    space.free();
  }
});

function queries(space, model, box) {
  const seen = [...model.seen].sort(([a], [b]) => (a < b ? -1 : 1));
  const inside = (bounds) => big(seen.filter(([, other]) => overlap([...bounds, ...other], 0, 1)).map(([handle]) => handle));
  assert.deepEqual(space.queryBox(box), inside(box));
  const point = box.slice(0, 3);
  assert.deepEqual(space.queryPoint(point), inside([...point, ...point]));
  const distance = (other) => Math.hypot(...[0, 1, 2].map((a) => Math.max(0, other[a] - point[a], point[a] - other[a + 3])));
  const nearest = space.nearest(Array.from(point), 5);
  const expected = seen.map(([, other]) => distance(other)).sort((a, b) => a - b).slice(0, 5);
  assert.equal(nearest.handles.length, expected.length);
  nearest.distances.forEach((found, k) => assert.ok(Math.abs(found - expected[k]) < 1e-4));
  // Along x, so that the definition is exact.
  const ahead = seen.filter(([, b]) => b[3] >= point[0] && [1, 2].every((a) => b[a] <= point[a] && point[a] <= b[a + 3]));
  const hits = space.castRay(point, [1, 0, 0]);
  assert.deepEqual([...hits.handles].sort(), ahead.map(([handle]) => handle).sort());
  hits.distances.forEach((t, k) => {
    assert.equal(t, Math.max(0, Math.fround(model.seen.get(hits.handles[k])[0] - point[0])));
    assert.ok(k === 0 || t >= hits.distances[k - 1]);
  });
  assert.equal(space.castRay(point, [1, 0, 0], 0).handles.length, inside([...point, ...point]).length);
}

test("a call that throws changes nothing", () => {
  const space = new Space();
  const box = new Float32Array([0, 0, 0, 1, 1, 1]);
  const [a, b] = space.insert(new Float32Array([...box, ...box]));
  space.update();
  const wrong = (what, run) => assert.throws(run, { name: "Error", message: what });
  wrong(/box 1 has a bound/, () => space.insert(new Float32Array([...box, NaN, 0, 0, 1, 1, 1])));
  wrong(/fixed has 2 entries for 1 boxes/, () => space.insert(box, { fixed: new Uint8Array(2) }));
  wrong(/body has no mass/, () => space.insert(box, { mass: 1 }));
  wrong(/2 handles and 1 boxes/, () => space.set(big([a, b]), box));
  wrong(new RegExp(`the box for handle ${b}n is inverted`), () => space.set(big([a, b]), new Float32Array([...box, 1, 0, 0, 0, 1, 1])));
  wrong(/handle 99n names no body/, () => space.set(big([99n]), box));
  wrong(/0 is no handle/, () => space.remove(big([a, 0n])));
  wrong(/handles must be a BigUint64Array/, () => space.remove([a]));
  wrong(/boxes has 3 numbers/, () => space.queryBox(new Float32Array(3)));
  wrong(/2 boxes; give one/, () => space.queryBox(new Float32Array(12)));
  wrong(/point must be three numbers/, () => space.queryPoint([1, 2]));
  wrong(/direction zero/, () => space.castRay([0, 0, 0], [0, 0, 0]));
  wrong(/not finite/, () => space.nearest([NaN, 0, 0], 1));
  space.update();
  assert.deepEqual(space.pairs(), big([a, b]));
  assert.equal(space.length, 2);
  assert.equal(space.begun().length + space.ended().length, 0);
  space.remove(big([a]));
  wrong(/it was removed/, () => space.remove(big([a])));
  assert.match(space.decision().algorithm, /@cpu1$/);
});
