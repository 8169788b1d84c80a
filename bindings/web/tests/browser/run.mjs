/**
 * Tests the built page in headless Chromium.
 *
 *     node bindings/web/tests/browser/run.mjs target/web [NAME...]
 *
 * With names it runs only the tests that hold one of them. Pictures go to FOLDER-pictures.
 *
 * CHROMIUM  the browser [default: chromium]
 * SAPWISE   the command that checks reports [default: cargo run]
 */
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { mkdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { Chromium } from "./chromium.mjs";
import { serve } from "./server.mjs";

const [folder = "target/web", ...wanted] = process.argv.slice(2);
const pictures = `${folder.replace(/\/$/, "")}-pictures`;
const SIZES = [[1440, 900], [820, 1180], [390, 844]];
const THEMES = ["light", "dark"];
/** Frame of the pictures: the peak of the second explosion. */
const PICTURED = 945;

mkdirSync(pictures, { recursive: true });
const { url, close } = await serve(folder);
const chromium = new Chromium();

/** Opens the page and waits for its first frame; `before` prepares it. */
async function open({ hash = "", size = SIZES[0], before = async () => {} } = {}) {
  const page = await chromium.page(...size);
  await before(page);
  await page.open(url + hash);
  return page;
}
const FRAME = 'performance.getEntriesByName("first-frame").length > 0';
const next = (page) => page.evaluate("new Promise((go) => requestAnimationFrame(() => requestAnimationFrame(go)))");
const objects = (page) => page.evaluate('import("./main.js").then(({ demo }) => demo.objects)');
const text = (page, id) => page.evaluate(`document.getElementById("${id}").textContent`);

/** Pauses, and starts a scene. */
async function pause(page, scene, count) {
  await page.until(FRAME);
  await page.evaluate(`import("./main.js").then(({ demo, run }) => {
    run(false);
    demo.restart("${scene}", ${count});
  })`);
  await next(page);
}

/** Runs in the page: 300 frames with splits and deletions against a double loop, without the page's own code. */
async function compareWithDoubleLoop(scene) {
  const { demo, run } = await import("./main.js");
  run(false);
  demo.restart(scene, 2000);
  const key = (a, b) => Math.min(a, b) * 2 ** 26 + Math.max(a, b);
  let ids = Array.from({ length: demo.objects }, (_, i) => i);
  let fresh = ids.length;
  let before = null;
  for (let frame = 0; frame < 300; frame++) {
    if (frame > 0) demo.advance();
    const { boxes, pairs, objects, history } = demo;
    // A scene drops objects at the end of the list and appends them.
    while (ids.length < objects) ids.push(fresh++);
    ids.length = objects;
    const right = new Set();
    for (let a = 0; a < objects; a++) {
      for (let b = a + 1; b < objects; b++) {
        let overlap = true;
        for (let axis = 0; axis < 3; axis++) {
          overlap &&= boxes[6 * a + axis] <= boxes[6 * b + 3 + axis] && boxes[6 * b + axis] <= boxes[6 * a + 3 + axis];
        }
        if (overlap) right.add(key(ids[a], ids[b]));
      }
    }
    const found = new Set();
    for (let i = 0; i < pairs.length; i += 2) found.add(key(ids[pairs[i]], ids[pairs[i + 1]]));
    if (found.size !== pairs.length / 2) throw new Error(`frame ${frame}: a pair was found twice`);
    if (found.size !== right.size || [...right].some((pair) => !found.has(pair))) {
      throw new Error(`frame ${frame}: ${found.size} pairs, and the double loop has ${right.size}`);
    }
    if (before) {
      const stayed = [...right].filter((pair) => before.has(pair)).length;
      const { begun, ended } = history.at(-1);
      if (begun !== right.size - stayed || ended !== before.size - stayed) {
        throw new Error(`frame ${frame}: ${begun} begun and ${ended} ended, not ${right.size - stayed} and ${
          before.size - stayed}`);
      }
    }
    before = right;
    // Scenes that drop objects themselves compact the list after edits, in an order of their own.
    if (scene === "fragmentation" || frame % 5 !== 0) continue;
    demo.split(frame % objects);
    while (ids.length < objects + 7) ids.push(fresh++);
    // What was split is no longer there: the first piece takes its place and keeps its pairs.
    for (const index of [(frame * 7 + 3) % objects, 5, objects - 2].sort((a, b) => b - a)) {
      demo.remove([index]);
      ids[index] = ids.at(-1);
      ids.pop();
    }
  }
  return new Set(demo.history.map(({ algorithm }) => algorithm)).size;
}

/** Runs in the page: frames of 2000 boxes on WebGPU against a double loop. */
async function compareOnGpu(scenarios, frames) {
  const { Gpu, Scene } = await import("./sapwise.js");
  const gpu = await Gpu.open();
  const searches = [];
  for (const algorithm of Gpu.algorithms()) searches.push([algorithm, await gpu.broadPhase(algorithm)]);
  for (const scenario of scenarios) {
    const scene = new Scene(scenario, 2000, 1);
    for (let frame = 0; frame < frames; frame++, scene.step()) {
      const boxes = scene.boxes().slice();
      const right = new Set();
      for (let a = 0; a < boxes.length; a += 6) {
        for (let b = a + 6; b < boxes.length; b += 6) {
          let overlap = true;
          for (let axis = 0; axis < 3; axis++) {
            overlap &&= boxes[a + axis] <= boxes[b + 3 + axis] && boxes[b + axis] <= boxes[a + 3 + axis];
          }
          if (overlap) right.add(a / 6 * 65536 + b / 6);
        }
      }
      const [algorithm, search] = searches[frame % searches.length];
      const pairs = await search.update(boxes);
      const found = new Set();
      for (let i = 0; i < pairs.length; i += 2) found.add(pairs[i] * 65536 + pairs[i + 1]);
      if (found.size !== pairs.length / 2 || found.size !== right.size || [...right].some((pair) => !found.has(pair))) {
        throw new Error(`${algorithm}, ${scenario}, frame ${frame}: ${pairs.length / 2} pairs, not ${right.size}`);
      }
    }
  }
  return searches.map(([algorithm]) => algorithm).join(", ");
}

/** Checks a report by the command, which calls it good or, if it is cut short, doubtful. */
function check(name, report, verdict) {
  const file = join(pictures, `${name}.json`);
  writeFileSync(file, report);
  const [command, ...options] = process.env.SAPWISE ? [process.env.SAPWISE]
    : ["cargo", "run", "--quiet", "--locked", "--package", "sapwise-cli", "--"];
  const { status, stdout, stderr } = spawnSync(command, [...options, "check", file], { encoding: "utf8" });
  assert.equal(status, 0, `sapwise check refuses ${file}: ${stdout}${stderr}`);
  assert.match(stdout, verdict);
}
const report = (page) => page.evaluate('fetch(document.getElementById("report").href).then((r) => r.text())');

const tests = {
  async "the first frame comes, from this folder alone"() {
    const page = await open();
    await page.until(FRAME);
    const shown = await page.evaluate('performance.getEntriesByName("first-frame")[0].startTime');
    assert.deepEqual(page.requests.filter((address) => !address.startsWith(url) && !address.startsWith("data:")), []);
    assert.deepEqual(page.errors, []);
    await page.close();
    return `${Math.round(shown)} ms`;
  },

  async "300 frames of 2000 boxes have the pairs of a double loop"() {
    const page = await open();
    let most = 0;
    for (const scene of ["gravity", "free-fall", "fragmentation"]) {
      most = Math.max(most, await page.evaluate(`(${compareWithDoubleLoop})("${scene}")`));
    }
    assert.ok(most > 1, "it never changed the algorithm");
    await page.close();
  },

  async "300 frames of 2000 boxes on WebGPU have the pairs of a double loop"() {
    const page = await open();
    await pause(page, "uniform", 10);
    const scenes = ["gravity", "free-fall", "mixed"];
    const told = await page.evaluate(`(${compareOnGpu})(${JSON.stringify(scenes)}, 100)`);
    assert.deepEqual(page.errors, []);
    await page.close();
    return told;
  },

  async "without WebGPU it says so and goes on"() {
    const page = await open({ before: (page) => page.send("Page.addScriptToEvaluateOnNewDocument", { source: `
      Object.defineProperty(Navigator.prototype, "gpu", { get() {} });` }) });
    await page.until(FRAME);
    await page.evaluate(`(${clickOnGpu})()`);
    await page.until('/, GPU cannot run in this browser: this browser has no WebGPU/.test(notice.textContent)');
    await goesOn(page);
    await page.close();
  },

  async "a GPU that is lost leaves the CPU"() {
    const page = await open({ before: (page) => page.send("Page.addScriptToEvaluateOnNewDocument", { source: `
      const request = GPUAdapter.prototype.requestDevice;
      GPUAdapter.prototype.requestDevice = async function (...how) {
        return window.device = await request.apply(this, how);
      };` }) });
    await page.until(FRAME);
    await page.evaluate('import("./main.js").then(({ demo }) => demo.restart("uniform", 500))');
    await page.evaluate(`(${clickOnGpu})()`);
    const ran = 'import("./main.js").then(({ demo }) => [...demo.history.at(-1).fixed.values()].some((ms) => ms > 0))';
    await page.until(ran, 60);
    await page.evaluate("device.destroy()");
    await page.until('/, GPU cannot run in this browser: .*lost/.test(notice.textContent)');
    assert.equal(await page.evaluate('document.querySelectorAll("#fixed :checked").length'), 0);
    await goesOn(page);
    await page.close();
  },

  async "within 600 frames the algorithm changes and a sentence tells why"() {
    const page = await open();
    await page.until('document.getElementById("switches").children.length > 0', 60);
    const [, frame] = (await text(page, "switches")).match(/→ .* in frame (\d+), .* objects: .{10,}/);
    assert.ok(frame < 600, `the first switch is in frame ${frame}`);
    const names = await page.evaluate('import("./sapwise.js").then(({ algorithms }) => algorithms())');
    const told = await text(page, "running");
    assert.match(told, new RegExp(`^(${names.join("|").replaceAll("@cpu1", "")}) runs: .{10,}`));
    const different = await page.evaluate(`(() => {
      const canvas = document.getElementById("timeline");
      const { data } = canvas.getContext("2d").getImageData(0, canvas.height * 0.05, canvas.width, 1);
      return new Set(new Uint32Array(data.buffer)).size;
    })()`);
    assert.ok(different > 2, "the band shows no two algorithms");
    await page.close();
    return told;
  },

  async "a click splits, a drag deletes, a drag beside turns"() {
    const page = await open();
    await pause(page, "uniform", 3000);
    const { x, y, width, height } = await page.evaluate(
      'document.getElementById("stage").getBoundingClientRect().toJSON()');
    const [middle, corner] = [[x + width / 2, y + height / 2], [x + 4, y + 4]];
    await page.drag(middle, middle);
    await next(page);
    assert.equal(await objects(page), 3007);
    await page.drag(middle, [middle[0] + 30, middle[1]], [middle[0] + 60, middle[1]]);
    await next(page);
    const left = await objects(page);
    assert.ok(left < 3000, `${left} are left`);
    await page.drag(corner, [corner[0] + 100, corner[1] + 40]);
    await next(page);
    assert.equal(await objects(page), left);
    const touch = (type, touchPoints) => page.send("Input.dispatchTouchEvent", { type, touchPoints });
    await touch("touchStart", [{ x: middle[0] - 80, y: middle[1] }]);
    await touch("touchEnd", []);
    await next(page);
    assert.equal(await objects(page), left + 7);
    await page.close();
  },

  async "keys pause, step, and change the number and the scene"() {
    const page = await open();
    await page.until(FRAME);
    await page.press(" ");
    assert.equal(await text(page, "pause"), "Play");
    const frame = () => page.evaluate('import("./main.js").then(({ demo }) => demo.frame)');
    const before = await frame();
    await page.press("s");
    assert.equal(await frame(), before + 1);
    const number = await text(page, "wanted");
    await page.press("+");
    assert.notEqual(await text(page, "wanted"), number);
    await page.evaluate(`(() => {
      const scene = document.getElementById("scene");
      scene.value = "uniform";
      scene.dispatchEvent(new Event("change"));
    })()`);
    await next(page);
    const count = await objects(page);
    for (const key of ["x", "ArrowLeft", "PageUp"]) await page.press(key);
    await next(page);
    assert.equal(await objects(page), count + 7);
    await page.press("Delete");
    await next(page);
    assert.ok(await objects(page) < count + 7);
    await page.close();
  },

  async "every fixed algorithm runs beside, and the slow ones wait"() {
    const page = await open();
    await page.until(FRAME);
    // A software GPU takes seconds for so many boxes.
    const rows = '[...document.querySelectorAll("#fixed label")].filter((row) => !row.textContent.includes("GPU"))';
    await page.evaluate(`${rows}.forEach((row) => row.click())`);
    await page.evaluate('import("./main.js").then(({ demo }) => demo.restart("uniform", 60000))');
    await page.until(`${rows}.every((row) => /ms|too slow/.test(row.textContent))
      && document.getElementById("count").textContent.startsWith("60")`, 30);
    assert.match(await text(page, "fixed"), /too slow here/);
    assert.deepEqual(page.errors, []);
    await page.close();
  },

  async "without WebGL2 it says so and goes on"() {
    const page = await open({ before: (page) => page.send("Page.addScriptToEvaluateOnNewDocument", { source: `
      const get = HTMLCanvasElement.prototype.getContext;
      HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
        return kind === "webgl2" ? null : get.call(this, kind, ...more);
      };` }) });
    await page.until('import("./main.js").then(({ demo }) => demo.frame > 30)');
    assert.match(await text(page, "notice"), /cannot be drawn, since this browser offers no WebGL2/);
    assert.deepEqual(page.errors, []);
    await page.close();
  },

  async "without WebAssembly it says so"() {
    const page = await open({
      before: (page) => page.send("Network.setBlockedURLs", { urls: ["*sapwise_bg.wasm"] }),
    });
    await page.until('!document.getElementById("failure").hidden');
    assert.match(await text(page, "failure"), /^WebAssembly did not start: /);
    await page.close();
  },

  async "it waits where less motion is asked for"() {
    const page = await open({ before: (page) => page.media({ "prefers-reduced-motion": "reduce" }) });
    await page.until(FRAME);
    await next(page);
    assert.equal(await page.evaluate('import("./main.js").then(({ demo }) => demo.frame)'), 0);
    assert.equal(await text(page, "pause"), "Play");
    await page.close();
  },

  async "all that takes the focus has a name, and texts have contrast"() {
    for (const hash of ["", "#probe"]) {
      const page = await open({ hash });
      await page.until('document.getElementById("fixed").children.length > 0');
      const { nodes } = await page.send("Accessibility.getFullAXTree");
      const nameless = nodes.filter(({ properties = [], name, role }) => role?.value !== "RootWebArea"
        && properties.some(({ name, value }) => name === "focusable" && value.value) && !name?.value);
      assert.deepEqual(nameless.map(({ role }) => role.value), []);
      for (const theme of THEMES) {
        await page.media({ "prefers-color-scheme": theme });
        const low = await page.evaluate(`(${lowContrasts})()`);
        assert.deepEqual(low, [], theme);
      }
      await page.close();
    }
  },

  async "the probe ends, and its report passes sapwise check"() {
    const page = await open({ hash: "#probe" });
    await page.until('document.getElementById("fixed").children.length > 0');
    const began = Date.now();
    await page.evaluate('document.getElementById("measure").click()');
    await page.until('!document.getElementById("report").hidden', 150);
    const took = Date.now() - began;
    check("report", await report(page), /report\/3 good/);
    assert.match(await text(page, "stage-of-probe"), /^Measured, in /);
    assert.ok(await page.evaluate('document.querySelectorAll("#curves svg").length') >= 3, "fewer than three scenes");
    assert.ok(await page.evaluate('document.querySelectorAll("#hardware tbody tr").length') >= 3, "few parameters");
    assert.deepEqual(page.errors, []);
    for (const theme of THEMES) {
      await page.media({ "prefers-color-scheme": theme });
      for (const size of SIZES) await shoot(page, "probe", size, theme);
    }
    await page.close();
    return `${Math.round(took / 1000)} s`;
  },

  async "a probe that is stopped leaves a report too"() {
    const page = await open({ hash: "#probe" });
    await page.until('document.getElementById("fixed").children.length > 0');
    await page.evaluate('document.getElementById("measure").click()');
    await page.until('document.getElementById("progress").value > 0.4', 90);
    await page.evaluate('document.getElementById("stop").click()');
    await page.until('!document.getElementById("report").hidden');
    assert.match(await text(page, "stage-of-probe"), /^Stopped/);
    check("stopped", await report(page), /cut short/);
    await page.close();
  },

  async "pictures at three sizes, light and dark, without sideways scrolling"() {
    for (const theme of THEMES) {
      for (const size of SIZES) {
        const page = await open({ size, before: (page) => page.media({ "prefers-color-scheme": theme }) });
        await page.until(FRAME);
        await page.evaluate(`import("./main.js").then(({ demo, run }) => {
          run(false);
          while (demo.frame < ${PICTURED}) demo.advance();
        })`);
        await next(page);
        await shoot(page, "watch", size, theme);
        await page.close();
      }
    }
  },
};

/** Runs in the page: compares with the first algorithm on the GPU. */
function clickOnGpu() {
  [...document.querySelectorAll("#fixed label")].find((row) => row.textContent.includes("GPU")).click();
}

/** Checks that frames follow without an error. */
async function goesOn(page) {
  const frame = await page.evaluate('import("./main.js").then(({ demo }) => demo.frame)');
  await page.until(`import("./main.js").then(({ demo }) => demo.frame > ${frame} + 30)`);
  assert.deepEqual(page.errors, []);
}

/** Runs in the page: pairs of colours of the style sheet with a contrast under 4.5. */
function lowContrasts() {
  const style = getComputedStyle(document.documentElement);
  const light = (name) => {
    const number = parseInt(style.getPropertyValue(`--${name}`).trim().slice(1), 16);
    const [r, g, b] = [number >> 16, number >> 8 & 255, number & 255].map((c) => c / 255)
      .map((c) => c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const hues = Array.from({ length: 8 }, (_, i) => `hue-${i}`);
  const pairs = [["ink", "paper"], ["ink", "panel"], ["soft", "paper"], ["soft", "panel"], ["on-accent", "accent"],
    ...hues.flatMap((hue) => [["on-hue", hue], [hue, "paper"]])];
  return pairs.filter(([a, b]) => {
    const [dark, bright] = [light(a), light(b)].sort((x, y) => x - y);
    return (bright + 0.05) / (dark + 0.05) < 4.5;
  });
}

/** Takes a picture, and fails if the page is wider than the window. */
async function shoot(page, name, [width, height], theme) {
  await page.resize(width, height, width < 800);
  await page.evaluate("new Promise((go) => setTimeout(go, 300))");
  const fits = await page.evaluate("document.documentElement.scrollWidth <= innerWidth");
  assert.ok(fits, `${name} is too wide at ${width}`);
  writeFileSync(join(pictures, `${name}-${width}-${theme}.png`), await page.picture());
}

let failed = 0;
for (const [name, test] of Object.entries(tests)) {
  if (wanted.length > 0 && !wanted.some((word) => name.includes(word))) continue;
  try {
    const told = await test();
    console.log(`ok: ${name}${told ? ` (${told})` : ""}`);
  } catch (error) {
    failed++;
    console.error(`failed: ${name}: ${error.stack ?? error}`);
  }
}
await chromium.close();
close();
process.exitCode = failed > 0 ? 1 : 0;
