// What `init` takes in Node.js. Each time in a process of its own, because a module is loaded once.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import test from "node:test";
import { pathToFileURL } from "node:url";

const folder = pathToFileURL(`${process.env.SAPWISE_NPM}/`);

for (const source of [
  "",
  "{}",
  "bytes",
  "readFile(url)",
  "url",
  "url.href",
  "new WebAssembly.Module(bytes)",
  "{ module_or_path: bytes }",
  "{ module_or_path: readFile(url) }",
  "{ module_or_path: url }",
  "{ module_or_path: url.href }",
]) {
  test(`init(${source})`, () => {
    const script = `
      import { readFile } from "node:fs/promises";
      import init, { findPairs } from "${new URL("node.js", folder)}";
      const url = new URL("${new URL("sapwise_bg.wasm", folder)}");
      const bytes = await readFile(url);
      await init(${source});
      console.log(findPairs(new Float32Array([0, 0, 0, 1, 1, 1, 1, 1, 1, 2, 2, 2])).join());`;
    const options = ["--input-type=module", "--eval", script];
    assert.equal(execFileSync(process.execPath, options, { encoding: "utf8" }), "0,1\n");
  });
}
