#!/usr/bin/env bash
# Builds the library for 64-bit ARM and runs there, in QEMU, its unit tests, the contract, the golden pairs and the filter: without kernels of its own
# that processor runs the portable ones.
#
#   tools/aarch64.sh
#
# Installs the target, its linker and QEMU where they are missing (rustup and Debian's apt-get).
set -euo pipefail
cd "$(dirname "$0")/.."
target=aarch64-unknown-linux-gnu
[ -d "$(rustc --print sysroot)/lib/rustlib/$target/lib" ] || rustup target add $target
{ command -v qemu-aarch64 && command -v aarch64-linux-gnu-gcc; } >/dev/null 2>&1 || {
    apt-get update -q
    apt-get install -qy --no-install-recommends qemu-user gcc-aarch64-linux-gnu libc6-dev-arm64-cross
}
export CARGO_INCREMENTAL=0 CARGO_PROFILE_DEV_DEBUG=false
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=aarch64-linux-gnu-gcc
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER="qemu-aarch64 -L /usr/aarch64-linux-gnu"
cargo test -p sapwise --locked --quiet --target $target --lib --test contract --test golden --test filter
