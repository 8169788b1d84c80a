#!/usr/bin/env bash
# Measures what the adaptive choice is worth on this machine: its regret against the best algorithm of every frame, with a tuning that was
# measured, predicted, or measured on another machine, and beside another program.
#
#     tools/in-line.sh [DIR] [OTHER.json]
#
# Texts, traces and pictures go into DIR (`in-line` by default), where a report that is there already is used again. OTHER.json is the
# report of another machine, whose tuning is to be corrected; without it one is simulated. Nothing else should run meanwhile;
# takes about ten minutes beside the report's three.
set -euo pipefail

folder=${1:-in-line}
mkdir -p "$folder"
folder=$(cd "$folder" && pwd)
other=${2:+$(cd "$(dirname "$2")" && pwd)/$(basename "$2")}
cd "$(dirname "$0")/.."

[ -n "${SAPWISE:-}" ] || cargo build --quiet --release -p sapwise-cli
sapwise=${SAPWISE:-${CARGO_TARGET_DIR:-target}/release/sapwise}

report=$folder/report.json
[ -s "$report" ] || "$sapwise" probe --no-gpus --out "$report" >/dev/null
if [ -z "$other" ]; then
    other=$folder/other/simulated-core-i5-4200u-no-gpu.json
    [ -s "$other" ] || "$sapwise" simulate --out "$folder/other" >/dev/null
fi

stream=$folder/rapier3d.npy
[ -s "$stream" ] || cargo run --quiet --release -p sapwise-example-rapier3d -- --frames 900 --bodies 2000 --quiet --record "$stream"
# One name, then the scene and what differs.
run() {
    local name=$1
    shift
    echo "== $name: run $*"
    "$sapwise" run "$@" --no-gpus --plot "$folder/$name.svg" --trace "$folder/$name.csv" >"$folder/$name.txt"
    grep -A 6 '^frames' "$folder/$name.txt" | sed '/^$/,$d'
    grep -E 'of the time of|ran beside it|Other programs' "$folder/$name.txt"
}

clustered=(clustered --swing 50 --frames 600)
for tuning in measured predicted; do
    given=(--samples 8)
    [ $tuning = measured ] && given=(--tuning "$report")
    run "fragmentation-$tuning" fragmentation "${given[@]}"
    run "fragmentation-2000-$tuning" fragmentation --objects 2000 "${given[@]}"
    run "clustered-$tuning" "${clustered[@]}" "${given[@]}"
    run "stream-$tuning" "$stream" "${given[@]}"
done
run fragmentation-wrong fragmentation --frames 1200 --tuning "$other" --after 300
run clustered-wrong clustered --swing 50 --frames 1200 --tuning "$other" --after 300
run stream-wrong "$stream" --tuning "$other" --after 300
run fragmentation-shared fragmentation --frames 1500 --tuning "$report" --co-runner 600 --after 900
run uniform-shared uniform --objects 5000 --frames 1200 --tuning "$report" --co-runner 600 --after 900
