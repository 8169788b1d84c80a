#!/usr/bin/env bash
# Builds Sapwise for browsers and Node.js: the page in target/web/, for any static server, and the npm package `sapwise`
# in target/npm/. Then tests it.
#
#   tools/web.sh            # builds, and tests the package in Node.js
#   tools/web.sh build      # builds only
#   tools/web.sh browser    # also tests the page in headless Chromium, and the report of its probe by `sapwise check`
#   tools/web.sh bench      # measures into results/web.csv, beside libraries from npm; on a quiet machine
#   tools/web.sh probes     # runs the probe of the page 20 times into results/web-probes.csv: at most 20 minutes
#
# PROBES   runs of the probe [default: 20]
# VECTORS  +simd128, or -simd128 for browsers without WebAssembly SIMD [default: +simd128]
#
# Needs Node.js with npm, and the compiler of tools/wasm-compiler.sh; all but `test` and `build` also Chromium. Installs
# three.js in target/three/, for an example, and the libraries in target/web-bench/.
set -euo pipefail
cd "$(dirname "$0")/.."
what=${1:-test}
. tools/wasm-compiler.sh
case $what in
    build | test) ;;
    browser | bench | probes) command -v chromium >/dev/null || fail "chromium is missing" ;;
    *) fail "usage: tools/web.sh [test|build|browser|bench|probes]" ;;
esac
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

if [ "$what" = bench ] || [ "$what" = probes ]; then
    export SAPWISE_BROWSER_TESTS=$root/bindings/web/tests/browser
    rm -rf "$out/web-bench"
    cp -r bindings/web/bench "$out/web-bench"
    (cd "$out/web-bench" && npm install --no-audit --no-fund --silent "$out/npm")
    if [ "$what" = bench ]; then
        usual build --quiet --release --locked --package sapwise --example find_pairs
        node "$out/web-bench/run.mjs" bench results/web.csv "$out/web" "$out/release/examples/find_pairs" "$bytes"
    else
        usual build --quiet --locked --package sapwise-cli
        node "$out/web-bench/run.mjs" probes results/web-probes.csv "$out/web" "$out/debug/sapwise" "${PROBES:-20}"
    fi
    exit 0
fi

export SAPWISE_NPM=$out/npm SAPWISE_REPORT=$out/web-report.json
node --test bindings/web/tests/node/*.test.mjs
# As a user of three.js installs both: what npm publishes, in a folder of its own.
packed=$out/$(cd "$out/npm" && npm pack --silent --pack-destination "$out")
rm -rf "$out/three"
cp -r bindings/web/examples/three "$out/three"
(cd "$out/three" && npm install --no-audit --no-fund --silent "$packed" && npm test --silent)
# As in `cargo test`, which builds the command, too: `cargo run` would build it with other features.
usual test --quiet --no-run --locked --test cli
"$out/debug/sapwise" check "$SAPWISE_REPORT"
if [ "$what" = browser ]; then
    SAPWISE=$out/debug/sapwise node bindings/web/tests/browser/run.mjs "$out/web"
fi
