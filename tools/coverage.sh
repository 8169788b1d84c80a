#!/usr/bin/env bash
# Counts the lines of the library that its tests run: all of src/ but the measurement of hardware parameters and the algorithms on GPUs, which
# need what not every machine has. A file with less than all of its lines has a row; the last row is the sum.
#
#   tools/coverage.sh
#
# Installs cargo-llvm-cov and llvm-tools where they are missing (cargo, rustup).
set -euo pipefail
cd "$(dirname "$0")/.."
cargo llvm-cov --version >/dev/null 2>&1 \
    || CARGO_TARGET_DIR=target/tools CARGO_PROFILE_DEV_DEBUG=false cargo install cargo-llvm-cov --version 0.9.1 --locked --debug --quiet
[ -n "$(find "$(rustc --print sysroot)" -name llvm-cov -print -quit)" ] || rustup component add llvm-tools
export CARGO_INCREMENTAL=0
# One test at a time: threads that count in the same places wait for each other, and tests that end what hangs would end what does not.
cargo llvm-cov -p sapwise --features tracing --locked --quiet --summary-only \
    --ignore-filename-regex '/(measure|gpu|scenes)/|/tests(/|\.rs)' -- --test-threads=1 \
    | awk '/^Filename/ || /^TOTAL/ || ($10 + 0 < 100 && /\.rs/) { printf "%-44s %8s lines %8s missed %9s\n", $1, $8, $9, $10 }'
