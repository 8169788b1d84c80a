#!/usr/bin/env bash
# Measures this machine several times in a row and says how well the reports agree.
#
#     tools/repeatability.sh [RUNS] [DIR] [PROBE OPTIONS...]
#     tools/repeatability.sh 10 hardware --hardware-only --no-gpus
#     tools/repeatability.sh 10 quick --quick --no-gpus
#
# 10 runs into the folder `repeatability` by default. Complete reports that are in the folder already count, so the same command
# goes on where it was stopped. Nothing else should run meanwhile.
set -euo pipefail

runs=${1:-10}
folder=${2:-repeatability}
shift $(($# < 2 ? $# : 2))
mkdir -p "$folder"
folder=$(cd "$folder" && pwd)
cd "$(dirname "$0")/.."

cargo build --quiet --release -p sapwise-cli
sapwise=${CARGO_TARGET_DIR:-target}/release/sapwise
for ((run = 1; run <= runs; run++)); do
    report=$folder/run-$(printf %03d "$run").json
    [ -s "$report" ] && continue
    "$sapwise" probe "$@" --out "$report.unfinished" >/dev/null
    mv "$report.unfinished" "$report"
done
"$sapwise" compare "$folder"
printf '\nOnly reports during which the cores of the machine stayed in the same place:\n'
"$sapwise" compare --steady "$folder" || true
