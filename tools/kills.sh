#!/usr/bin/env bash
# Kills `study`, `predict`, `run`, `train` and `probe` N times each at random moments (100 by default: 500 in all), and
# checks that no file is lost or half-written: probes/tests/kills.rs. Takes about three seconds a kill. As root it also
# fills a small disk; otherwise it says that it does not.
#
#   tools/kills.sh [N]
set -euo pipefail
cd "$(dirname "$0")/.."
disk=$(mktemp -d)
if mount -t tmpfs -o size=16m tmpfs "$disk" 2>/dev/null; then
    trap 'umount "$disk"; rmdir "$disk"' EXIT
    export SAPWISE_SMALL_DISK=$disk
else
    rmdir "$disk"
    echo "kills: no disk is filled: a small one can't be mounted here" >&2
fi
SAPWISE_KILLS=${1:-100} cargo test -p sapwise-cli --features long-tests --locked --test kills -- --nocapture
