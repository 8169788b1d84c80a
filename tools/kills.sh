#!/usr/bin/env bash
# Kills `study`, `predict`, `run` and `train`, N times each at random moments (125 by default: 500 in all), and looks whether a file was lost or is
# half-written: tests/kills.rs. Takes about three seconds a kill.
#
#   tools/kills.sh [N]
set -euo pipefail
cd "$(dirname "$0")/.."
SAPWISE_KILLS=${1:-125} cargo test -p sapwise-cli --locked --test kills -- --nocapture
