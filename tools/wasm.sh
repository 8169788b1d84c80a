#!/usr/bin/env bash
# Builds the library for wasm32-unknown-unknown without features, and runs examples/wasm in Node.js, which compares
# every frame of a growing scene with the definition of overlap: without vectors, and with those of WebAssembly.
#
#     tools/wasm.sh
#
# Needs Node.js and the compiler of tools/wasm-compiler.sh. Installs nothing.
set -euo pipefail
cd "$(dirname "$0")/.."
. tools/wasm-compiler.sh

# A folder of its own: another compiler would rebuild everything in the usual one.
folder=${CARGO_TARGET_DIR:-target}/wasm
# RUSTC_BOOTSTRAP lets a stable cargo take flags for some packages: the standard library, which takes minutes, is built
# once.
export CARGO_PROFILE_DEV_DEBUG=false CARGO_PROFILE_DEV_OPT_LEVEL=0 CARGO_INCREMENTAL=0 RUSTC_BOOTSTRAP=1
for vectors in -simd128 +simd128; do
    flags="rustflags = ['-Ctarget-feature=$vectors']"
    cargo build --quiet --locked -p sapwise-example-wasm --target $target --target-dir "$folder" "${options[@]}" \
        -Zprofile-rustflags --config "profile.dev.package.sapwise.$flags" \
        --config "profile.dev.package.sapwise-example-wasm.$flags"
    node --input-type=module - "$folder/$target/debug/sapwise-example-wasm.wasm" "$vectors" <<'JS'
import { readFileSync } from "node:fs";

const module = new WebAssembly.Module(readFileSync(process.argv[2]));
const imports = WebAssembly.Module.imports(module);
if (imports.length > 0) throw new Error(`the module must not import: ${JSON.stringify(imports)}`);
const began = performance.now();
// A wrong answer traps, which ends Node.js with status 1.
new WebAssembly.Instance(module, {}).exports.main(0, 0);
console.log(`wasm: every frame is right with ${process.argv[3]}, in ${Math.round(performance.now() - began)} ms`);
JS
done
