import assert from "node:assert/strict";
import test from "node:test";
import { sapwise } from "./common.mjs";

test("a panic is an error with a message, and so is every later call", () => {
  const { BroadPhase, findPairs, Space } = sapwise;
  const [phase, space, boxes] = [new BroadPhase(), new Space(), new Float32Array(12)];
  phase.update(boxes);
  // The clock is read within a frame: a frame within the frame is a fault.
  const { now } = performance;
  performance.now = () => {
    phase.update(boxes);
    return 0;
  };
  const fault = { name: "Error", message: /^a fault of Sapwise, please report it: .*already borrowed.*load the module again$/s };
  assert.throws(() => phase.update(boxes), fault);
  performance.now = now;
  for (const run of [() => phase.update(boxes), () => findPairs(boxes), () => space.update(), () => new Space()]) {
    assert.throws(run, fault);
  }
});
