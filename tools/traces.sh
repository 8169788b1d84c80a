#!/usr/bin/env bash
# Records the time of every algorithm in each frame of some scenes on this machine, for datasets/traces/HOST. A test
# replays them through the adaptive choice, with a counter as its clock: src/adaptive/tests/traces.rs.
#
#     tools/traces.sh DIR [SEED]
#
# Keeps the numbers of objects and pairs and the times of what `sapwise run --trace` writes. Nothing else should run
# meanwhile; takes two minutes. SAPWISE and STREAMS name binaries that were built elsewhere.
set -euo pipefail
folder=${1:?usage: tools/traces.sh DIR [SEED]}
seed=${2:-1}
mkdir -p "$folder"
folder=$(cd "$folder" && pwd)
cd "$(dirname "$0")/.."

[ -n "${SAPWISE:-}" ] || cargo build --quiet --release -p sapwise-cli
sapwise=${SAPWISE:-${CARGO_TARGET_DIR:-target}/release/sapwise}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$sapwise" predict --no-gpus --out "$work/tuning.json" >/dev/null

streams=${STREAMS:-}
[ -n "$streams" ] || {
    cargo build --quiet --release -p sapwise-scenes --example streams
    streams=${CARGO_TARGET_DIR:-target}/release/examples/streams
}
"$streams" "$work" >/dev/null

# record NAME SCENE OPTION...: one trace.
record() {
    local name=$1
    shift
    "$sapwise" run "$@" --repeats 1 --no-gpus --tuning "$work/tuning.json" --trace "$work/trace.csv" >/dev/null
    awk -F, 'NR == 1 { for (k = 1; k <= NF; k++) if ($k ~ /@|^objects$|^pairs$/) kept[++n] = k }
        {
            for (k = 1; k <= n; k++) {
                cell = $kept[k]
                if (NR > 1 && cell != "") cell = sprintf("%.0f", cell)
                printf "%s%s", cell, (k < n ? "," : "\n")
            }
        }' \
        "$work/trace.csv" >"$folder/$name.csv"
}

# scene SCENARIO OBJECTS SUFFIX OPTION...
scene() {
    local scenario=$1 objects=$2 suffix=$3
    shift 3
    record "$scenario-$objects-$seed$suffix" "$scenario" --objects "$objects" --seed "$seed" --frames 600 "$@"
}

for scenario in uniform fast clustered slab mixed resting brownian free-fall gravity; do
    scene $scenario 3000 ""
    scene $scenario 3000 -swing --swing 50
done
scene uniform 800 ""
scene fragmentation 20000 ""
scene fragmentation 2000 ""
scene clustered 20000 -swing --swing 50
for stream in level fight pooled; do record "$stream-3000-1" "$work/$stream.npy"; done
