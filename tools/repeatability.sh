#!/usr/bin/env bash
# Measures this machine several times in a row and says how well the reports agree.
#
#     tools/repeatability.sh [RUNS] [DIR] [PROBE OPTIONS...]
#     tools/repeatability.sh 10 again --hardware-only --no-gpus
#     tools/repeatability.sh 10 again-quick --quick --no-gpus
#
# 10 runs into the folder `repeatability` by default. Reports that are in the folder already count. Nothing else should run.
set -euo pipefail
cd "$(dirname "$0")/.."

runs=${1:-10}
folder=${2:-repeatability}
shift $(($# < 2 ? $# : 2))

cargo build --quiet --release -p sapwise-cli
sapwise=${CARGO_TARGET_DIR:-target}/release/sapwise
mkdir -p "$folder"
for ((run = 1; run <= runs; run++)); do
    report=$folder/run-$(printf %03d "$run").json
    [ -s "$report" ] || "$sapwise" probe "$@" --out "$report" >/dev/null
done
"$sapwise" compare "$folder"
printf '\nWithout the reports during which the cores of the machine were moved:\n'
"$sapwise" compare --steady "$folder"
