// Makes every compute pipeline of a WGSL file with Tint and Dawn (Chromium's compiler and WebGPU), without a driver.
//
//     node tint.mjs PACKAGE FILE     PACKAGE: the folder of npm's `webgpu`
//
// One file for each process: after some twenty pipelines `webgpu` 0.6.2 crashes or hangs.
import { readFileSync } from "node:fs";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";

const [packageFolder, file] = process.argv.slice(2);
const { create, globals } = await import(pathToFileURL(join(resolve(packageFolder), "index.js")));
Object.assign(globalThis, globals);
// With WebGPU's default limits: a kernel that needs more would not run on every device.
const adapter = await create(["backend=null"]).requestAdapter();
const device = await adapter.requestDevice({ requiredFeatures: ["subgroups"] });

const text = readFileSync(file, "utf8");
// WGSL needs this directive, which naga 30 refuses.
const code = /\bsubgroup/.test(text) ? `enable subgroups; ${text}` : text;
let pipelines = 0;
device.pushErrorScope("validation");
const module = device.createShaderModule({ code });
for (const [, entryPoint] of code.matchAll(/@compute[^{]*?\bfn\s+(\w+)/g)) {
    // The layout follows from the shader, as in the library.
    device.createComputePipeline({ layout: "auto", compute: { module, entryPoint } });
    pipelines += 1;
}
const error = await device.popErrorScope();
if (error) console.error(`Tint refuses ${file}: ${error.message}`);
else if (pipelines === 0) console.error(`${file} has no entry point`);
else console.log(pipelines);
// Dawn's threads would keep the process alive.
process.exit(error || pipelines === 0 ? 1 : 0);
