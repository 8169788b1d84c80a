#!/usr/bin/env bash
# Draws the pictures of the README and of docs/ again: those of the study from datasets/, and one of a run on this machine, which takes a
# minute and needs an idle machine.
#
#   tools/pictures.sh [DIR]    into DIR, without it into pictures/
set -euo pipefail
cd "$(dirname "$0")/.."
out=${1:-pictures}
mkdir -p "$out"
cargo build --release --locked -p sapwise-cli
sapwise=${CARGO_TARGET_DIR:-target}/release/sapwise
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

"$sapwise" study datasets --out "$work/study" > "$work/study.txt"
for figure in field-map; do
  cp "$work/study/$figure.svg" "$out/$figure.svg"
done
"$sapwise" run fragmentation --objects 20000 --tuning datasets/amd-epyc-zen3-2c/full.json --no-gpus --plot "$out/fragmentation.svg"
echo "The pictures are in $out."
