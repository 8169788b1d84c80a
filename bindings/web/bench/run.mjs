/**
 * Measures Sapwise for the web; `tools/web.sh bench` and `tools/web.sh probes` run it.
 *
 *     node run.mjs bench FILE.csv FOLDER_OF_THE_PAGE NATIVE_PROGRAM BYTES_IN_GZIP
 *     node run.mjs probes FILE.csv FOLDER_OF_THE_PAGE SAPWISE [RUNS]
 */
import { execFileSync, spawnSync } from "node:child_process";
import { mkdtempSync, writeFileSync } from "node:fs";
import { cpus, tmpdir } from "node:os";
import { join } from "node:path";

const { Chromium } = await import(`${process.env.SAPWISE_BROWSER_TESTS}/chromium.mjs`);
const { serve } = await import(`${process.env.SAPWISE_BROWSER_TESTS}/server.mjs`);

/** Boxes of `findPairs`, its rounds, and the calls of one: a round is the median of its calls. */
const [OBJECTS, ROUNDS, CALLS] = [10_000, 15, 9];
/** Openings of the page. */
const OPENINGS = 9;
/** Boxes of the demonstration, and its frames before and while it is measured. */
const [SHOWN, WARM_UP, FRAMES] = [20_000, 120, 300];
const FRAME = 'performance.getEntriesByName("first-frame").length > 0';

const quantile = (values, q) => {
  const sorted = [...values].sort((a, b) => a - b);
  return sorted[Math.round(q * (sorted.length - 1))];
};
const rows = [];
const where = `${cpus()[0].model.trim()}, Node.js ${process.versions.node}`;

/** Adds a row: the median of the samples, with the first and the last decile. */
function add(what, contestant, unit, values, digits = 4) {
  const told = [0.5, 0.1, 0.9].map((q) => Number(quantile(values, q).toPrecision(digits)));
  rows.push([what, contestant, ...told, unit, values.length]);
  console.error(`${what}, ${contestant}: ${told[0]} ${unit} (${told[1]} to ${told[2]})`);
}

function write(file) {
  const date = new Date().toISOString().slice(0, 10);
  const head = "machine,date,what,contestant,median,p10,p90,unit,samples";
  const lines = rows.map((row) => [`"${where}"`, date, ...row].join());
  writeFileSync(file, `${[head, ...lines].join("\n")}\n`);
}

/** Milliseconds of the median call. */
function calls(run) {
  const times = Array.from({ length: CALLS }, () => {
    const start = performance.now();
    run();
    return performance.now() - start;
  });
  return quantile(times, 0.5);
}

async function compare(native) {
  const { default: init, findPairs, Scene } = await import("sapwise");
  const libraries = await import("./libraries.mjs");
  await init();
  const boxes = new Scene("uniform", OBJECTS, 1).boxes().slice();
  const file = join(mkdtempSync(join(tmpdir(), "sapwise-bench-")), "boxes.f32");
  writeFileSync(file, new Uint8Array(boxes.buffer));
  const contestants = { "sapwise WebAssembly": () => findPairs(boxes) };
  for (const [name, find] of Object.entries(libraries)) contestants[name] = () => find(boxes);
  const pairs = findPairs(boxes).length;
  for (const [name, run] of Object.entries(contestants)) {
    if (run().length !== pairs) throw new Error(`${name} finds ${run().length / 2} pairs, not ${pairs / 2}`);
  }
  const environment = { ...process.env, SAPWISE_SIMD: "portable" };
  const natively = () => {
    const told = execFileSync(native, [file, String(CALLS)], { encoding: "utf8", env: environment }).split(" ");
    if (Number(told[0]) !== pairs / 2) throw new Error(`the native program finds ${told[0]} pairs`);
    return Number(told[1]);
  };
  // In turn, so that what disturbs the machine disturbs all.
  const times = Array.from({ length: ROUNDS }, () => {
    const round = { "sapwise native": natively() };
    for (const [name, run] of Object.entries(contestants)) round[name] = calls(run);
    return round;
  });
  for (const name of Object.keys(times[0])) {
    add(`findPairs of ${OBJECTS}`, name, "ms", times.map((round) => round[name]));
  }
  const over = (a, b) => times.map((round) => round[a] / round[b]);
  const ours = "sapwise WebAssembly";
  add(`findPairs of ${OBJECTS}`, "WebAssembly over native", "ratio", over(ours, "sapwise native"), 3);
  for (const name of Object.keys(libraries)) {
    add(`findPairs of ${OBJECTS}`, `${name} over WebAssembly`, "ratio", over(name, ours), 3);
  }
}

async function show(chromium, url) {
  const opened = [];
  for (let time = 0; time < OPENINGS; time++) {
    const page = await chromium.page(1440, 900);
    await page.open(url);
    await page.until(FRAME);
    opened.push(await page.evaluate('performance.getEntriesByName("first-frame")[0].startTime'));
    await page.close();
  }
  add("until the first frame", "page", "ms", opened, 3);
  const page = await chromium.page(1440, 900);
  await page.open(url);
  await page.until(FRAME);
  for (const scene of ["uniform", "gravity"]) {
    const times = await page.evaluate(`import("./main.js").then(({ demo, run }) => {
      run(false);
      demo.restart("${scene}", ${SHOWN});
      for (let frame = 0; frame < ${WARM_UP}; frame++) demo.advance();
      return Array.from({ length: ${FRAMES} }, () => {
        demo.advance();
        return demo.history.at(-1).ms;
      });
    })`);
    add(`frame of ${SHOWN} in ${scene}`, "adaptive choice", "ms", times, 3);
  }
  await page.close();
}

/** Runs the probe on the page. Returns its seconds, and whether `sapwise check` calls its report good. */
async function probe(chromium, url, sapwise, file) {
  const page = await chromium.page(1440, 900);
  await page.open(`${url}#probe`);
  await page.until('document.getElementById("fixed").children.length > 0');
  await page.evaluate('document.getElementById("measure").click()');
  await page.until('!document.getElementById("report").hidden', 150);
  const report = await page.evaluate('fetch(document.getElementById("report").href).then((r) => r.text())');
  await page.close();
  writeFileSync(file, report);
  const { status, stdout } = spawnSync(sapwise, ["check", file], { encoding: "utf8" });
  return [JSON.parse(report).provenance.seconds, status === 0 && /report\/\d+ good/.test(stdout)];
}

const [what, file, folder, program, count] = process.argv.slice(2);
const { url, close } = await serve(folder);
const chromium = new Chromium();
try {
  if (what === "bench") {
    add("compressed", "page", "bytes", [Number(count)], 9);
    await compare(program);
    await show(chromium, url);
  } else {
    const runs = [];
    const reports = mkdtempSync(join(tmpdir(), "sapwise-probes-"));
    for (let run = 0; run < Number(count ?? 20); run++) {
      runs.push(await probe(chromium, url, program, join(reports, `${run}.json`)));
      console.error(`probe ${run}: ${runs.at(-1)[0]} s, ${runs.at(-1)[1] ? "good" : "NOT GOOD"}`);
    }
    add("probe", "page", "s", runs.map(([seconds]) => seconds), 3);
    add("probe", "share of sound reports", "ratio", [runs.filter(([, good]) => good).length / runs.length], 3);
  }
  write(file);
} finally {
  await chromium.close();
  close();
}
