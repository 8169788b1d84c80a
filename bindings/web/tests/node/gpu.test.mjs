import assert from "node:assert/strict";
import test from "node:test";
import { sapwise } from "./common.mjs";

test("without WebGPU a GPU does not open, and its algorithms have names", async () => {
  assert.deepEqual(sapwise.Gpu.algorithms(), ["sap@gpu0", "grid-sap@gpu0", "bvh@gpu0"]);
  if (!globalThis.navigator?.gpu) await assert.rejects(sapwise.Gpu.open(), /has no WebGPU/);
});
