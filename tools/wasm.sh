#!/usr/bin/env bash
# Builds the library for wasm32-unknown-unknown without features, and runs examples/wasm in Node.js, which compares
# every frame of a growing scene with the definition of overlap.
#
#     tools/wasm.sh
#
# Needs Node.js and a compiler for the target: the toolchain's after `rustup target add wasm32-unknown-unknown`, or
# Debian's, which also builds the standard library, with LLVM's linker. Installs nothing:
#
#     apt-get install --no-install-recommends rustc-web libstd-rust-web-dev rust-web-src lld-22
#
# DEBIAN_RUSTC  that compiler [default: /usr/bin/rustc]
# WASM_LD       the linker [default: wasm-ld-22]
set -euo pipefail
cd "$(dirname "$0")/.."

target=wasm32-unknown-unknown
fail() { echo "wasm: $*" >&2; exit 1; }
command -v node >/dev/null || fail "node is missing: install Node.js"

# Its own folder: another compiler would rebuild everything in the usual one.
export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-target}/wasm
export CARGO_PROFILE_DEV_DEBUG=false CARGO_PROFILE_DEV_OPT_LEVEL=0 CARGO_INCREMENTAL=0
options=()
if [ ! -d "$(rustc --print sysroot)/lib/rustlib/$target/lib" ]; then
    rustc=${DEBIAN_RUSTC:-/usr/bin/rustc}
    linker=${WASM_LD:-wasm-ld-22}
    library=$("$rustc" --print sysroot 2>/dev/null)/lib/rustlib/src/rust/library \
        || fail "no compiler for $target; see the head of $0"
    [ -d "$library" ] || fail "no sources of the standard library in $library; see the head of $0"
    command -v "$linker" >/dev/null || fail "the linker $linker is missing; see the head of $0"
    # RUSTC_BOOTSTRAP lets a stable compiler build the standard library.
    export RUSTC=$rustc RUSTC_BOOTSTRAP=1 CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_LINKER=$linker
    options=(-Zbuild-std=std,panic_abort -Zbuild-std-features=)
fi
cargo build --quiet --locked -p sapwise-example-wasm --target $target "${options[@]}"
node --input-type=module - "$CARGO_TARGET_DIR/$target/debug/sapwise-example-wasm.wasm" <<'JS'
import { readFileSync } from "node:fs";

const module = new WebAssembly.Module(readFileSync(process.argv[2]));
const imports = WebAssembly.Module.imports(module);
if (imports.length > 0) throw new Error(`the module must not import: ${JSON.stringify(imports)}`);
const began = performance.now();
// A wrong answer traps, which ends Node.js with status 1.
new WebAssembly.Instance(module, {}).exports.main(0, 0);
console.log(`wasm: every frame is right, in ${Math.round(performance.now() - began)} ms`);
JS
