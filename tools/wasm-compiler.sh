# Chooses the compiler for wasm32-unknown-unknown. Sourced by the other scripts; sets `target` and the `options` of cargo.
# shellcheck shell=bash disable=SC2034 # the scripts use both
#
# It is the toolchain's after `rustup target add wasm32-unknown-unknown`, or Debian's, which also builds the standard
# library, with LLVM's linker. Installs nothing:
#
#     apt-get install --no-install-recommends rustc-web libstd-rust-web-dev rust-web-src lld-22
#
# DEBIAN_RUSTC  that compiler [default: /usr/bin/rustc]
# WASM_LD       the linker [default: wasm-ld-22]

target=wasm32-unknown-unknown
fail() { echo "${0##*/}: $*" >&2; exit 1; }
command -v node >/dev/null || fail "node is missing: install Node.js"
options=()
if [ ! -d "$(rustc --print sysroot)/lib/rustlib/$target/lib" ]; then
    see="see tools/wasm-compiler.sh"
    rustc=${DEBIAN_RUSTC:-/usr/bin/rustc}
    linker=${WASM_LD:-wasm-ld-22}
    library=$("$rustc" --print sysroot 2>/dev/null)/lib/rustlib/src/rust/library || fail "no compiler for $target; $see"
    [ -d "$library" ] || fail "no sources of the standard library in $library; $see"
    command -v "$linker" >/dev/null || fail "the linker $linker is missing; $see"
    # RUSTC_BOOTSTRAP lets a stable compiler build the standard library.
    export RUSTC=$rustc RUSTC_BOOTSTRAP=1 CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_LINKER=$linker
    options=(-Zbuild-std=std,panic_abort -Zbuild-std-features=)
fi
