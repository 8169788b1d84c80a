#!/usr/bin/env bash
# Runs the tests that take minutes, and are left out of `.ci/run`: the long soak, kills, the contract at its large sizes
# and every level of instructions, every size on software GPUs, the verbs that measure, ThreadSanitizer on all its tests.
#
#     tools/long-tests.sh
#
# Has not passed as a whole yet since the packages were split (2026-11-26).
set -euo pipefail
cd "$(dirname "$0")/.."
gpus=$(tools/software-gpus.sh)
eval "$gpus"
export SAPWISE_REQUIRE_GPU=1
cargo test --locked --features sapwise/long-tests,sapwise-gpu/long-tests,sapwise-tune/long-tests,sapwise-cli/long-tests
tools/sanitize.sh threads
tools/python.sh gpu
