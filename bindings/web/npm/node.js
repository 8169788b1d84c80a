// Node.js fetches no files: this reads the module from beside it, or from the file URL that it gets.
import { readFile } from "node:fs/promises";
import start from "./sapwise.js";

export * from "./sapwise.js";

export default async function init(source) {
  const given = await source;
  const isOptions = given && Object.getPrototypeOf(given) === Object.prototype;
  const module = await (isOptions ? given.module_or_path : given) ?? new URL("sapwise_bg.wasm", import.meta.url);
  const isFile = (module instanceof URL || typeof module === "string") && `${module}`.startsWith("file:");
  return start({ module_or_path: isFile ? await readFile(new URL(module)) : module });
}
