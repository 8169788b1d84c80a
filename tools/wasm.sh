#!/usr/bin/env bash
# Builds the library for wasm32-unknown-unknown, without its features, and runs examples/wasm in Node.js: every frame of a growing scene
# against the definition of overlap.
#
#     tools/wasm.sh
#
# Needs node, and a compiler for that target. Where `rustup target add wasm32-unknown-unknown` has been run, that is the one of the toolchain.
# Elsewhere it takes Debian's compiler, which is told to build the standard library too, and the linker of LLVM; it installs nothing:
#
#     apt-get install --no-install-recommends rustc-web libstd-rust-web-dev rust-web-src lld-22
#
# DEBIAN_RUSTC names that compiler if it is not /usr/bin/rustc, and WASM_LD the linker if it is not wasm-ld-22.
set -euo pipefail
cd "$(dirname "$0")/.."

target=wasm32-unknown-unknown
fail() { echo "wasm: $*" >&2; exit 1; }
command -v node >/dev/null || fail "node is missing: install Node.js"

# Apart from other builds: another compiler would have them all built again. Without line tables, which nobody looks at.
export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-target}/wasm CARGO_PROFILE_DEV_DEBUG=false CARGO_PROFILE_DEV_OPT_LEVEL=0 CARGO_INCREMENTAL=0
options=()
if [ ! -d "$(rustc --print sysroot)/lib/rustlib/$target/lib" ]; then
    rustc=${DEBIAN_RUSTC:-/usr/bin/rustc}
    linker=${WASM_LD:-wasm-ld-22}
    library=$("$rustc" --print sysroot 2>/dev/null)/lib/rustlib/src/rust/library || fail "no compiler for $target; see the head of $0"
    [ -d "$library" ] || fail "no sources of the standard library in $library; see the head of $0"
    command -v "$linker" >/dev/null || fail "the linker $linker is missing; see the head of $0"
    # A compiler that is not of the nightly channel builds the standard library where it is told that it may.
    export RUSTC=$rustc RUSTC_BOOTSTRAP=1 CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_LINKER=$linker
    options=(-Zbuild-std=std,panic_abort -Zbuild-std-features=)
fi
cargo build --quiet --locked -p sapwise-example-wasm --target $target "${options[@]}"
node --input-type=module - "$CARGO_TARGET_DIR/$target/debug/sapwise-example-wasm.wasm" <<'JS'
import { readFileSync } from "node:fs";

const module = new WebAssembly.Module(readFileSync(process.argv[2]));
const imports = WebAssembly.Module.imports(module);
if (imports.length > 0) throw new Error(`it wants of its host: ${JSON.stringify(imports)}`);
const began = performance.now();
// A wrong answer is a trap, which ends Node.js with status 1.
new WebAssembly.Instance(module, {}).exports.main(0, 0);
console.log(`wasm: every frame is right, in ${Math.round(performance.now() - began)} ms`);
JS
