#!/usr/bin/env bash
# Builds the broad phase for avian3d, `bindings/avian/`, and tests it beside avian's own.
#
#   tools/avian.sh         # formatting, clippy, documentation, tests of a tenth of the bodies, a short comparison
#   tools/avian.sh long    # the tests with all bodies and 600 steps, optimised: tens of minutes
#   tools/avian.sh bench   # times both broad phases in turn, into results/avian.csv
#
# Bevy 0.20 declares Rust 1.97.1. The parts used here build with 1.95, so cargo ignores the declared version.
set -euo pipefail
cd "$(dirname "$0")/.."
options=(--manifest-path bindings/avian/Cargo.toml --locked --quiet --ignore-rust-version)
export CARGO_INCREMENTAL=0 CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$PWD/target}/avian

case ${1:-test} in
test)
    cargo fmt --manifest-path bindings/avian/Cargo.toml --check
    cargo clippy "${options[@]}" --all-targets -- -D warnings
    RUSTDOCFLAGS="-D warnings" cargo doc "${options[@]}" --no-deps
    cargo test "${options[@]}"
    cargo run "${options[@]}" --example compare 20 20 | awk -F, '
        NF != 10 || NR > 1 && !($4 == "avian" || $4 == "sapwise") { print "avian: not a row: " $0; bad = 1 }
        END { if (NR != 11) { print "avian: " NR " rows, not 11"; bad = 1 } exit bad }'
    ;;
long) cargo test "${options[@]}" --release ;;
bench)
    cargo build "${options[@]}" --release --example compare
    "$CARGO_TARGET_DIR/release/examples/compare" >"$CARGO_TARGET_DIR/bench.csv"
    version=$(sed -n '/^name = "avian3d"/{n;s/version = "\(.*\)"/\1/p}' bindings/avian/Cargo.lock)
    machine="$(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -1) ($(nproc) cores)"
    known="$machine,$(date +%F),$version"
    sed "1s/^/machine,date,avian3d,/; 2,\$s/^/$known,/" "$CARGO_TARGET_DIR/bench.csv" | tee results/avian.csv
    ;;
*)
    echo "avian: usage: tools/avian.sh [test|long|bench]" >&2
    exit 2
    ;;
esac
