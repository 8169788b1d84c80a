#!/usr/bin/env bash
# Runs tests of the library where a fault of memory or of threads shows itself.
#
#   tools/sanitize.sh [PART...]
#
#   address   every test of the library on CPUs, under AddressSanitizer
#   threads   pools, frames, changes and the few boxes under ThreadSanitizer, with a standard library that is built for it
#   races     the same without the deadlock test of pools, which takes half of their time there; for CI
#   miri      every algorithm on one thread, on a few boxes, and a space, in Miri, at each level up to AVX2
#   valgrind  the few boxes, threads that stay on their cores, and measured parameters, in valgrind
#
# All but `races` by default: about half an hour on two cores. Installs what is missing: rust-src, a nightly toolchain
# with Miri (rustup), valgrind (Debian's apt-get). Sanitizers are options of the nightly channel and parts of every
# compiler, so that they take the one at hand.
set -euo pipefail
cd "$(dirname "$0")/.."
host=$(rustc --version --verbose | sed -n 's/^host: //p')
folder=${CARGO_TARGET_DIR:-$PWD/target}
export CARGO_INCREMENTAL=0 CARGO_PROFILE_DEV_DEBUG=line-tables-only

# What is leaked at the end of a program is none of its business: threads of pools may still run.
address() {
    ASAN_OPTIONS=detect_leaks=0 RUSTC_BOOTSTRAP=1 RUSTFLAGS=-Zsanitizer=address CARGO_TARGET_DIR=$folder/address \
        cargo test -p sapwise -p sapwise-tune --locked --quiet --target "$host" --lib --tests
}

races() { threads -- --skip worker_that_holds_a_lock_runs_no_other_job; }

threads() {
    [ -f "$(rustc --print sysroot)/lib/rustlib/src/rust/library/Cargo.lock" ] || rustup component add rust-src
    TSAN_OPTIONS=halt_on_error=1 RUSTC_BOOTSTRAP=1 RUSTFLAGS=-Zsanitizer=thread CARGO_TARGET_DIR=$folder/threads \
        cargo test -Zbuild-std -p sapwise --locked --quiet --target "$host" --test small --test pool --test frames --test changes "$@"
}

miri() {
    rustup run nightly cargo miri --version >/dev/null 2>&1 || rustup toolchain install nightly --profile minimal --component miri,rust-src
    # With these instructions both levels below AVX-512 run; Miri knows no more.
    local flags=
    [[ $host != x86_64-* ]] || flags=-Ctarget-feature=+avx2
    # Miri runs one thread: the tests of the few boxes take as many processes as there are cores.
    (
        export RUSTFLAGS=$flags CARGO_TARGET_DIR=$folder/miri
        run=(cargo +nightly miri test -p sapwise --locked --quiet --no-default-features --test small --)
        mapfile -t tests < <("${run[@]}" --list --format terse | sed -n 's/: test$//p')
        [ ${#tests[@]} -gt 0 ] || { echo "sanitize: Miri lists no tests" >&2; exit 1; }
        printf '%s\n' "${tests[@]}" | xargs -P "$(nproc)" -I '{}' "${run[@]}" --exact '{}'
    )
}

valgrind() {
    [ -x "$(type -P valgrind)" ] || { apt-get update -q; apt-get install -qy --no-install-recommends valgrind; }
    # All default packages: with fewer, cargo builds the library again with other features.
    local runner=CARGO_TARGET_${host//-/_}_RUNNER
    env "${runner^^}=valgrind --quiet --error-exitcode=9" \
        cargo test --locked --quiet --test small --test threads --test measure
}

parts=("$@")
[ $# -gt 0 ] || parts=(miri threads address valgrind)
for part in "${parts[@]}"; do
    case $part in
        address | threads | races | miri | valgrind) ;;
        *) echo "sanitize: there is no part $part; there are address, threads, races, miri and valgrind" >&2; exit 2 ;;
    esac
done
for part in "${parts[@]}"; do
    began=$SECONDS
    "$part"
    echo "sanitize: $part: no fault, $((SECONDS - began)) s"
done
