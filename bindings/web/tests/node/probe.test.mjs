import assert from "node:assert/strict";
import { writeFileSync } from "node:fs";
import test from "node:test";
import { sapwise } from "./common.mjs";

test("a probe ends within a minute, and its report holds what it measured", async () => {
  const { algorithms, BroadPhase, Probe, useTuning } = sapwise;
  const [probe, began] = [new Probe(), performance.now()];
  let last = { done: 0, of: 1 };
  let longest = 0;
  assert.match(JSON.parse(probe.report()).remarks.at(-1), /^unfinished: 0 of/);
  assert.equal(probe.prediction(), "[]");
  while (last.done < last.of) {
    const started = performance.now();
    const progress = await probe.step();
    longest = Math.max(longest, performance.now() - started);
    assert.ok(progress.done >= last.done && progress.text.length > 0);
    last = progress;
  }
  const seconds = (performance.now() - began) / 1000;
  assert.ok(seconds < 60, `${seconds} s`);
  const text = probe.report();
  const report = JSON.parse(text);
  assert.equal(Object.keys(report)[0], "schema");
  assert.equal(report.label, "real_browser");
  assert.deepEqual(report.algorithms.map(({ id }) => id), algorithms());
  const value = (name) => report.hardware.parameters.find((parameter) => parameter.name === name).value;
  assert.ok(value("clock_measured_ghz") > 0.3 && value("clock_measured_ghz") < 8, `${value("clock_measured_ghz")} GHz`);
  assert.ok(value("latency_16_kib_ns") < value("latency_65536_kib_ns"));
  assert.ok(value("bandwidth_one_thread_gb_per_s") > 0.5);
  assert.ok(value("cache_llc_bytes") >= 65_536);
  assert.equal(value("usable_cores"), 1);
  assert.deepEqual([...new Set(report.points.map(({ scenario }) => scenario))], ["uniform", "clustered", "mixed"]);
  assert.ok(report.points.length > 15);
  const small = report.points.find(({ load }) => load.objects === 100);
  for (const { algorithm, samples_ns } of small.timings) assert.equal(samples_ns.length, 7, algorithm);
  assert.ok(!report.remarks.some((remark) => remark.includes("WRONG")), report.remarks.join("; "));
  assert.ok(JSON.parse(probe.prediction()).length === 5 * report.points.length);
  useTuning(probe.tuning());
  new BroadPhase().update(new Float32Array(60));
  console.log(`probe: ${seconds.toFixed(1)} s, longest step ${Math.round(longest)} ms, ${text.length} bytes`);
  if (process.env.SAPWISE_REPORT) writeFileSync(process.env.SAPWISE_REPORT, text);
});
