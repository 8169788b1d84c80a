#!/usr/bin/env bash
# Lists the public API of the library, with all features, so that a change of it shows in a diff.
#
#     tools/public-api.sh            writes tools/public-api.txt
#     tools/public-api.sh --check    says what differs from it, and fails if anything does
#
# It reads what rustdoc writes with tools/public-api, which cargo builds here.
set -euo pipefail
cd "$(dirname "$0")/.."

list=tools/public-api.txt
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# rustdoc writes JSON on a nightly toolchain only, or where it is told to be one. Only rustdoc is told so: a compiler that is told so would build
# every dependency once more.
printf '#!/bin/sh\nRUSTC_BOOTSTRAP=1 exec rustdoc "$@"\n' > "$work/rustdoc"
chmod +x "$work/rustdoc"
RUSTDOC="$work/rustdoc" cargo rustdoc --quiet -p sapwise --lib --all-features --locked -- -Z unstable-options --output-format json
built=${CARGO_TARGET_DIR:-target}
CARGO_TARGET_DIR=$built/tools cargo build --quiet --locked --manifest-path tools/public-api/Cargo.toml
"$built/tools/debug/sapwise-public-api" "$built/doc/sapwise.json" > "$work/list"
if [ "${1:-}" = --check ]; then
    diff -u "$list" "$work/list" || { echo "public-api: the API has changed; run tools/public-api.sh and commit $list" >&2; exit 1; }
else
    cp "$work/list" "$list"
fi
