#!/usr/bin/env bash
# Draws the picture of docs/ of a run on this machine, which takes a minute and needs an idle machine. The map of the
# README comes from `tools/results.sh influence`.
#
#   tools/pictures.sh [DIR]    into DIR, without it into pictures/
set -euo pipefail
cd "$(dirname "$0")/.."
out=${1:-pictures}
mkdir -p "$out"
cargo build --release --locked -p sapwise-cli
sapwise=${CARGO_TARGET_DIR:-target}/release/sapwise
"$sapwise" run fragmentation --objects 20000 --tuning datasets/amd-epyc-zen5-2c/full.json --no-gpus --plot "$out/fragmentation.svg"
echo "The pictures are in $out."
