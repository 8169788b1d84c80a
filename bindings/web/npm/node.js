// Node.js fetches no files: this reads the module from beside it.
import { readFile } from "node:fs/promises";
import start from "./sapwise.js";

export * from "./sapwise.js";

export default async function init(source = readFile(new URL("sapwise_bg.wasm", import.meta.url))) {
  return start({ module_or_path: await source });
}
