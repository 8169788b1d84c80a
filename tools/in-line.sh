#!/usr/bin/env bash
# Measures the adaptive choice on this machine: its time over that of the best single algorithm and over an oracle's,
# with a tuning that was predicted, measured, or measured on another machine.
#
#     tools/in-line.sh OTHER.json [DIR]
#     tools/in-line.sh datasets/amd-epyc-zen3-2c/full.json
#
# OTHER.json is the report of another host: its tuning is wrong here, and the runs show how it is corrected. Texts,
# traces and pictures go into DIR (`in-line` by default) with a table of all runs, `summary.txt`; a report.json that is
# there already is used again. Nothing else should run meanwhile; takes 10 to 16 minutes beside the report's three.
set -euo pipefail

usage="usage: tools/in-line.sh OTHER.json [DIR]; OTHER.json is a report of another host, as in datasets/"
[ $# -ge 1 ] || { echo "$usage" >&2; exit 2; }
[ -r "$1" ] || { echo "in-line.sh: $1 can't be read; $usage" >&2; exit 1; }
other=$(cd "$(dirname "$1")" && pwd)/$(basename "$1")
folder=${2:-in-line}
mkdir -p "$folder"
folder=$(cd "$folder" && pwd)
cd "$(dirname "$0")/.."

[ -n "${SAPWISE:-}" ] || cargo build --quiet --release -p sapwise-cli
sapwise=${SAPWISE:-${CARGO_TARGET_DIR:-target}/release/sapwise}

report=$folder/report.json
[ -s "$report" ] || "$sapwise" probe --no-gpus --out "$report" >/dev/null

stream=$folder/rapier3d.npy
[ -s "$stream" ] \
    || cargo run --quiet --release -p sapwise-example-rapier3d -- --frames 900 --bodies 2000 --quiet --record "$stream"
[ -s "$folder/pooled.npy" ] || cargo run --quiet --release -p sapwise-scenes --example streams -- "$folder" >/dev/null

summary=$folder/summary.txt
printf '%-28s %8s %8s  %10s  %s\n' run single windows p99 'worst frame' >"$summary"
# A name, then the scene and its options. With `--after` the row is that of the frames behind it.
run() {
    local name=$1
    shift
    "$sapwise" run "$@" --no-gpus --plot "$folder/$name.svg" --trace "$folder/$name.csv" >"$folder/$name.txt"
    # frames, × single, × oracle, then median, p99 and worst frame with a unit each, switches, explored
    awk -v name="$name" -v after=" $* " '
        /^frames +× single/ { table = 1; next }
        table && (after ~ / --after / || $1 == "all") && /^(all|[0-9]+ to [0-9]+) / {
            sub(/^(all|[0-9]+ to [0-9]+) +/, ""); row = $0
        }
        table && !/^(all|[0-9.])/ { table = 0 }
        END {
            split(row, c, / +/)
            printf "%-28s %8s %8s  %10s  %s\n", name, c[1], c[2], c[5] " " c[6], c[7] " " c[8]
        }' \
        "$folder/$name.txt" | tee -a "$summary"
}

predicted=()
measured=(--tuning "$report")
for scenario in uniform fast clustered slab mixed resting brownian free-fall gravity; do
    run "$scenario" $scenario --objects 3000 --frames 600 "${predicted[@]}"
    run "$scenario-swing" $scenario --objects 3000 --swing 50 --frames 600 "${predicted[@]}"
done
run uniform-800 uniform --objects 800 --frames 600 "${predicted[@]}"
for tuning in measured predicted; do
    declare -n given=$tuning
    run "fragmentation-$tuning" fragmentation "${given[@]}"
    run "fragmentation-2000-$tuning" fragmentation --objects 2000 "${given[@]}"
    run "clustered-20000-$tuning" clustered --swing 50 --frames 600 "${given[@]}"
    run "rapier3d-$tuning" "$stream" "${given[@]}"
    for own in level fight pooled; do
        run "$own-$tuning" "$folder/$own.npy" "${given[@]}"
    done
done
run fragmentation-wrong fragmentation --frames 1200 --tuning "$other" --after 300
run clustered-wrong clustered --swing 50 --frames 1200 --tuning "$other" --after 300
run rapier3d-wrong "$stream" --tuning "$other" --after 300

awk 'NR > 1 && $1 !~ /-wrong$/ { sum += log($2); n++; if ($2 > most) { most = $2; name = $1 } }
    END {
        printf "\n%d undisturbed runs over the best single algorithm: geometric mean %.3f, most %.3f in %s\n", \
            n, exp(sum / n), most, name
    }' "$summary" | tee -a "$summary"
