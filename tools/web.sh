#!/usr/bin/env bash
# Builds Sapwise for browsers and Node.js: the page in target/web/, for any static server, and the npm package `sapwise`
# in target/npm/. Then tests it.
#
#   tools/web.sh            # builds, and tests the package in Node.js
#   tools/web.sh build      # builds only
#   tools/web.sh browser    # also tests the page in headless Chromium, and the report of its probe by `sapwise check`
#
# VECTORS  +simd128, or -simd128 for browsers without WebAssembly SIMD [default: +simd128]
#
# Needs Node.js and the compiler of tools/wasm-compiler.sh; `browser` also Chromium. Installs the command of
# wasm-bindgen in target/tools/ at first.
set -euo pipefail
cd "$(dirname "$0")/.."
what=${1:-test}
. tools/wasm-compiler.sh
case $what in build | test | browser) ;; *) fail "usage: tools/web.sh [test|build|browser]" ;; esac
vectors=${VECTORS:-+simd128}
root=$PWD
out=${CARGO_TARGET_DIR:-$root/target}
manifest=bindings/web/Cargo.toml
export CARGO_INCREMENTAL=0

# The command must be of the version of the library.
version=$(sed -n 's/^wasm-bindgen = "=\(.*\)"$/\1/p' $manifest)
bindgen=$root/target/tools/bin/wasm-bindgen
[ "$("$bindgen" --version 2>/dev/null)" = "wasm-bindgen $version" ] || {
    env -u RUSTC -u RUSTC_BOOTSTRAP CARGO_TARGET_DIR="$root/target/tools" CARGO_PROFILE_DEV_DEBUG=false \
        cargo install wasm-bindgen-cli --version "$version" --locked --debug --quiet --root "$root/target/tools"
}

RUSTFLAGS="-C target-feature=$vectors" cargo build --quiet --release --locked --manifest-path $manifest \
    --target $target --target-dir "$out/wasm-web$vectors" "${options[@]}"
rm -rf "$out/npm" "$out/web"
mkdir -p "$out/npm" "$out/web"
"$bindgen" --target web --out-name sapwise --out-dir "$out/npm" --remove-name-section --remove-producers-section \
    "$out/wasm-web$vectors/$target/release/sapwise_web.wasm"
rm -f "$out/npm/sapwise_bg.wasm.d.ts"
cp bindings/web/npm/* LICENSE-* "$out/npm/"
cp bindings/web/page/* "$out/npm/sapwise.js" "$out/npm/sapwise_bg.wasm" "$out/web/"

# What a browser loads.
bytes=$(for file in "$out"/web/*; do gzip -9 -c "$file"; done | wc -c)
echo "web: $(stat -c %s "$out/npm/sapwise_bg.wasm") bytes of WebAssembly; the page has $bytes bytes in gzip"
[ "$bytes" -le 1500000 ] || fail "the page has more than 1.5 MB"
[ "$what" != build ] || exit 0

export SAPWISE_NPM=$out/npm SAPWISE_REPORT=$out/web-report.json
node --test "bindings/web/tests/node/*.test.mjs"
check() { env -u RUSTC -u RUSTC_BOOTSTRAP cargo run --quiet --locked -- check "$1"; }
check "$SAPWISE_REPORT"
if [ "$what" = browser ]; then
    command -v chromium >/dev/null || fail "chromium is missing"
    env -u RUSTC -u RUSTC_BOOTSTRAP node bindings/web/tests/browser/run.mjs "$out/web"
fi
