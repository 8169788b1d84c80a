#!/usr/bin/env bash
# Builds the documents as a book of pages, and checks their links.
#
#   tools/book.sh            # into target/book/html/
#   tools/book.sh --rustdoc  # also the reference of the packages, into target/book/html/api/
#
# Takes `mdbook` from the path, or builds it once into target/tools/.
set -euo pipefail
cd "$(dirname "$0")/.."
folder=$PWD/target/book
export PATH="$PWD/target/tools/bin:$PATH"
command -v mdbook >/dev/null 2>&1 \
  || CARGO_TARGET_DIR=target/tools CARGO_PROFILE_DEV_DEBUG=false cargo install mdbook --version 0.5.4 --locked --debug --quiet --root target/tools
tools/book.py source "$folder/src"
cat > "$folder/book.toml" <<'TOML'
[book]
title = "Sapwise"
language = "en"
src = "src"

[output.html]
git-repository-url = "https://github.com/sapwise/sapwise"
TOML
mdbook build "$folder" --dest-dir "$folder/html"
tools/book.py check "$folder/html"
if [ "${1:-}" = --rustdoc ]; then
  cargo doc --no-deps --locked -p sapwise -p sapwise-gpu -p sapwise-tune -p sapwise-scenes -p sapwise-ranks
  cp -r "${CARGO_TARGET_DIR:-target}/doc" "$folder/html/api"
fi
