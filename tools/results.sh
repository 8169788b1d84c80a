#!/usr/bin/env bash
# Makes results/: measures on this machine, notes where and when, renders the summaries, splices them into documents.
#
#   tools/results.sh                  # everything that this machine can measure; hours, with nothing else running
#   tools/results.sh peers c          # only these; the last lines of this file list all
#   tools/results.sh --splice         # measures nothing
#   SAPWISE_HOST=my-host              # the folder of this machine's reports in datasets/, for inline and heldout
set -euo pipefail
cd "$(dirname "$0")/.."
folder=${CARGO_TARGET_DIR:-target}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
# With what was set: another run takes the same.
set_to=$(env | sed -n '/^SAPWISE_RESULTS=/!s/^SAPWISE_[A-Z_]*=.*/& /p' | sort | tr -d '\n')
note() { tools/measured.py "$1" "${set_to}tools/results.sh $2" "$3"; }
host() {
  [ -n "${SAPWISE_HOST:-}" ] && return
  echo "results: name this machine's folder in datasets/ with SAPWISE_HOST" >&2
  exit 1
}
built() { cargo build --release --locked --quiet -p sapwise-cli; }

peers() {
  SAPWISE_RESULTS=$work cargo bench --locked -p sapwise-bench --bench peers
  mv "$work/peers.csv" results/peers.csv
  note peers.csv peers "n = 5 to 400 frames"
}
# The table of a real GPU comes from `tools/real-gpu.sh`; its rows are added by hand, with the card and the date.
gpu() {
  cargo bench --locked -p sapwise-bench --bench gpu
  cargo bench --locked -p sapwise-bench --bench gpu -- --dispatches
}
inline() {
  host
  # The prediction is of a model that has not seen this host, where there is one.
  local tuning=datasets/traces/$SAPWISE_HOST/predicted.tuning
  [ -e "$tuning" ] || tuning=
  tools/inline.py "$SAPWISE_HOST" --report "datasets/$SAPWISE_HOST/full.json" \
    --other datasets/amd-epyc-zen3-2c/portable.json --repeats 6 ${tuning:+--predicted "$tuning"}
  note inline.csv inline "n = 6 repeats of 600 to 1200 frames"
}
c() { tools/c.sh bench; note c.csv c "medians over all frames"; }
python() { tools/python.sh bench; note python.csv python "n = 3 to 200 samples"; }
avian() { tools/avian.sh bench; note avian.csv avian "medians over all steps"; }
web() { tools/web.sh bench; note web.csv web "medians over all frames"; }
probes() { tools/web.sh probes; note web-probes.csv probes "n = 20 probes"; }
# The regret of the built-in model on the reports of this machine. It means something if the model has not seen them.
heldout() {
  host
  built
  mkdir -p "$work/$SAPWISE_HOST"
  for report in "datasets/$SAPWISE_HOST"/*.json; do
    "$folder/release/sapwise" predict --report "$report" --json > "$work/$SAPWISE_HOST/$(basename "$report")"
  done
  tools/reference/regret.py "$work" "datasets/$SAPWISE_HOST"/*.json
}
# What follows from all reports: which parameter moves which crossover, the regret of each strategy on each host held
# out, and the map of the README. Measures nothing.
influence() {
  built
  "$folder/release/sapwise" study datasets --out "$work/study" > "$work/study.txt"
  mv "$work/study/influence.csv" "$work/study/regrets.csv" results/
  mv "$work/study/field-map.svg" pictures/
  tools/measured.py --study
}
# Bytes of what is shipped, stripped.
sizes() {
  built
  echo "what,bytes" > results/sizes.csv
  strip -o "$work/sapwise" "$folder/release/sapwise"
  echo "sapwise (command),$(stat -c %s "$work/sapwise")" >> results/sizes.csv
  for file in "$folder"/python/wheels/*.whl "$folder"/c/release/libsapwise.so "$folder"/web/npm/sapwise_bg.wasm; do
    if [ -e "$file" ]; then echo "$(basename "$file"),$(stat -c %s "$file")" >> results/sizes.csv; fi
  done
  note sizes.csv sizes "one build"
}
# Seconds from nothing to the two commands of the README.
builds() {
  echo "command,wall_s" > results/builds.csv
  for line in "build --release --locked" "test --no-run --locked"; do
    began=$(date +%s)
    # shellcheck disable=SC2086
    CARGO_TARGET_DIR=$work/target CARGO_INCREMENTAL=0 cargo $line
    echo "cargo $line,$(($(date +%s) - began))" >> results/builds.csv
    rm -rf "$work/target"
  done
  note builds.csv builds "one build from nothing each"
}
# The peak memory of the command beside the boxes themselves.
memory() {
  built
  echo "algorithm,objects,peak_kib" > results/memory.csv
  "$folder/release/sapwise" run uniform --no-gpus --objects 1000000 --frames 3 --repeats 1 \
    --tuning datasets/amd-epyc-zen3-2c/1t.json --record "$work/boxes.npy" > "$work/run.txt"
  for id in grid-sap@cpu1 bvh@cpu1 pair-cache@cpu1; do
    /usr/bin/time -o "$work/peak" -f %M "$folder/release/sapwise" pairs "$work/boxes.npy" --algorithm $id > "$work/pairs"
    echo "$id,1000000,$(tail -1 "$work/peak")" >> results/memory.csv
  done
  note memory.csv memory "peak of one process, three frames"
}
# The sample of the README: the same on every machine.
predict() {
  built
  "$folder/release/sapwise" predict --report datasets/amd-epyc-zen3-2c/full.json > "$work/predict.txt"
  grep -v '^Next: ' "$work/predict.txt" > results/predict.txt
}

known="peers gpu inline c python avian web probes heldout influence sizes builds memory predict"
if [ "${1:-}" != --splice ]; then
  # shellcheck disable=SC2086
  [ $# -gt 0 ] || { host && set -- ${known/gpu /}; }
  for what; do
    case " $known " in
    *" $what "*) "$what" ;;
    *)
      echo "usage: tools/results.sh [--splice | $known]" >&2
      exit 2
      ;;
    esac
  done
fi
tools/results.py
