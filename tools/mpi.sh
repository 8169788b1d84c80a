#!/usr/bin/env bash
# Builds `bindings/mpi/` and tests it over 1, 2, 3, 4 and 7 ranks of this machine: every scenario against one process, the edge cases, agreed errors, a rank that is
# killed and one that stops.
#
#   tools/mpi.sh
#
# Needs an MPI library with its compiler wrapper, and libclang for its header; on Debian it installs them where they are missing.
set -euo pipefail
cd "$(dirname "$0")/.."

has_libclang() { compgen -G '/usr/lib/llvm-*/lib/libclang.so*' >/dev/null || [ -n "${LIBCLANG_PATH:-}" ]; }
{ command -v mpicc && command -v mpirun && has_libclang; } >/dev/null 2>&1 || {
    apt-get update -q
    apt-get install -qy --no-install-recommends openmpi-bin libopenmpi-dev libclang-dev
}

manifest=bindings/mpi/Cargo.toml
# What is built for the C library and the Python package too is built once.
export CARGO_INCREMENTAL=0 CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-target}/bindings
cargo fmt --manifest-path $manifest --check
cargo clippy --manifest-path $manifest --all-targets --locked --quiet -- -D warnings
RUSTDOCFLAGS="-D warnings" cargo doc --manifest-path $manifest --no-deps --locked --quiet
cargo test --manifest-path $manifest --locked --quiet
cargo build --manifest-path $manifest --examples --locked --quiet
contract=$CARGO_TARGET_DIR/debug/examples/contract

# More ranks than cores, as root in a container, without the kernel's copies between processes, which containers forbid.
run=(mpirun --oversubscribe --mca btl_vader_single_copy_mechanism none --mca btl self,vader)
[ "$(id -u)" -ne 0 ] || run+=(--allow-run-as-root)
for ranks in 1 2 3 4 7; do
    timeout 120 "${run[@]}" -np $ranks "$contract" scenarios
done

# A rank of a job that would never end gets a signal: the job has to, soon and with a status that is not 0.
log=$(mktemp)
trap 'rm -f "$log"' EXIT
ends() {
    local signal=$1 job process status=0
    timeout --foreground 40 "${run[@]}" -np 3 "$contract" hang >"$log" 2>&1 &
    job=$!
    for _ in $(seq 100); do
        [ "$(grep -c 'is process' "$log")" -lt 3 ] || break
        sleep 0.1
    done
    sleep 0.5
    process=$(sed -n 's/^rank 1 is process //p' "$log")
    kill -s "$signal" "$process"
    wait $job || status=$?
    # What was stopped does not end by itself.
    kill -s KILL "$process" 2>/dev/null || true
    [ $status -ne 0 ] && [ $status -ne 124 ] || { cat "$log"; echo "mpi: after $signal the job did not end by itself: status $status" >&2; exit 1; }
}
ends KILL
echo "mpi: a rank that is killed ends the job"
ends STOP
grep -q 'has waited for 2 s for' "$log" || { cat "$log"; echo "mpi: nobody tells that a rank has stopped" >&2; exit 1; }
echo "mpi: a rank that stops ends the job with a message"
