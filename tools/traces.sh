#!/usr/bin/env bash
# Records the time of every algorithm in each frame of some scenes on this machine. A test replays such traces through
# the adaptive choice, with a counter as its clock (src/adaptive/tests/traces.rs): `TRACES=DIR cargo test -p sapwise
# --features model traces -- --nocapture` replays those of DIR instead of datasets/traces.
#
#     tools/traces.sh DIR [SEED]
#
# Keeps the numbers of objects and pairs and the times of what `sapwise run --trace` writes. Nothing else should run
# meanwhile; takes half a minute.
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

# record SCENARIO OBJECTS SUFFIX OPTION...: one trace, named after the first three.
record() {
    local scenario=$1 objects=$2 more=$3
    shift 3
    "$sapwise" run "$scenario" --objects "$objects" "$@" --seed "$seed" --repeats 1 --no-gpus \
        --tuning "$work/tuning.json" --trace "$work/trace.csv" >/dev/null
    awk -F, 'NR == 1 { for (k = 1; k <= NF; k++) if ($k ~ /@|^objects$|^pairs$/) kept[++n] = k }
        {
            for (k = 1; k <= n; k++) {
                cell = $kept[k]
                if (NR > 1 && cell != "") cell = sprintf("%.0f", cell)
                printf "%s%s", cell, (k < n ? "," : "\n")
            }
        }' \
        "$work/trace.csv" >"$folder/$scenario-$objects-$seed$more.csv"
}

for scenario in uniform fast clustered slab mixed resting brownian free-fall gravity; do
    record $scenario 3000 "" --frames 600
    record $scenario 3000 -swing --frames 600 --swing 50
done
record uniform 800 "" --frames 600
record fragmentation 20000 "" --frames 600
record fragmentation 2000 "" --frames 600
record clustered 20000 -swing --frames 600 --swing 50
