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
# Needs Node.js with npm, and the compiler of tools/wasm-compiler.sh; `browser` also Chromium. Installs three.js in
# target/three/, for an example.
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

# Runs cargo with the usual compiler.
usual() { env -u RUSTC -u RUSTC_BOOTSTRAP cargo "$@"; }

RUSTFLAGS="-C target-feature=$vectors" cargo build --quiet --release --locked --manifest-path $manifest \
    --target $target --target-dir "$out/wasm-web$vectors" "${options[@]}"
rm -rf "$out/npm" "$out/web"
mkdir -p "$out/npm" "$out/web"
usual run --quiet --locked --manifest-path tools/bindgen/Cargo.toml --target-dir "$out/tools" -- \
    "$out/wasm-web$vectors/$target/release/sapwise_web.wasm" "$out/npm"
rm -f "$out/npm/sapwise_bg.wasm.d.ts"
cp bindings/web/npm/* LICENSE-* "$out/npm/"
cp bindings/web/page/* "$out/npm/sapwise.js" "$out/npm/sapwise_bg.wasm" "$out/web/"

# What a browser loads.
bytes=$(for file in "$out"/web/*; do gzip -9 -c "$file"; done | wc -c)
echo "web: $(stat -c %s "$out/npm/sapwise_bg.wasm") bytes of WebAssembly; the page has $bytes bytes in gzip"
[ "$bytes" -le 1500000 ] || fail "the page has more than 1.5 MB"
[ "$what" != build ] || exit 0

export SAPWISE_NPM=$out/npm SAPWISE_REPORT=$out/web-report.json
node --test bindings/web/tests/node/*.test.mjs
# As a user of three.js installs both.
rm -rf "$out/three"
cp -r bindings/web/examples/three "$out/three"
(cd "$out/three" && npm install --no-audit --no-fund --silent "$out/npm" && npm test --silent)
usual run --quiet --locked -- check "$SAPWISE_REPORT"
if [ "$what" = browser ]; then
    command -v chromium >/dev/null || fail "chromium is missing"
    SAPWISE=$out/debug/sapwise node bindings/web/tests/browser/run.mjs "$out/web"
fi
