#!/usr/bin/env bash
# Fuzzes each target of fuzz/ under AddressSanitizer for that long, two at a time. Fails at a wrong answer, a crash, or an input that takes over 20 s.
#
#   tools/fuzz.sh MINUTES [TARGET...]
#
# Needs a C++ compiler for the fuzzer's library; installs cargo-fuzz where it is missing. What the fuzzer finds worth keeping goes to fuzz/corpus/,
# and an input that fails to fuzz/artifacts/: `tools/fuzz.sh 0 TARGET` runs what is in fuzz/seeds/, so put it there.
set -euo pipefail
cd "$(dirname "$0")/.."
minutes=${1:?usage: tools/fuzz.sh MINUTES [TARGET...]}
shift
seconds=$(awk -v m="$minutes" 'BEGIN { if (m !~ /^[0-9]+([.][0-9]+)?$/) exit 1; printf "%d", m * 60 }') \
    || { echo "fuzz: $minutes is no number of minutes" >&2; exit 2; }
targets=("$@")
[ $# -gt 0 ] || targets=(frames space files npy ids)

cargo fuzz --version >/dev/null 2>&1 \
    || CARGO_TARGET_DIR=target/tools CARGO_PROFILE_DEV_DEBUG=false cargo install cargo-fuzz --version 0.13.2 --locked --debug --quiet
# Sanitizers are options of the nightly channel, and a part of every compiler.
export RUSTC_BOOTSTRAP=1 CARGO_INCREMENTAL=0
folder=${CARGO_TARGET_DIR:-$PWD/fuzz/target}/fuzz
# Comparisons are not traced: the seeds hold every word, and to trace those of boxes takes most of the time.
cargo fuzz build --no-trace-compares --codegen-units 16 --target-dir "$folder"
programs=$folder/$(rustc --version --verbose | sed -n 's/^host: //p')/release

fuzz() {
    local target=$1 limits=(-max_total_time="$seconds") length=4096
    # 0 would be no limit at all.
    [ "$seconds" -gt 0 ] || limits=(-runs=0)
    [ "$target" != files ] || length=30000
    mkdir -p "fuzz/corpus/$target" "fuzz/artifacts/$target"
    "$programs/$target" "${limits[@]}" -max_len="$length" -timeout=20 -rss_limit_mb=4096 -print_final_stats=1 \
        -artifact_prefix="fuzz/artifacts/$target/" "fuzz/corpus/$target" "fuzz/seeds/$target" >"$folder/$target.log" 2>&1 || {
        grep -v $'\tNEW\|\tREDUCE\|\tpulse' "$folder/$target.log" | tail -n 60
        echo "fuzz: $target failed; its log is $folder/$target.log" >&2
        return 1
    }
    awk -v target="$target" '
        /number_of_executed_units/ { inputs = $2 } /average_exec_per_sec/ { rate = $2 } /cov: [0-9]+/ { sub(/.*cov: /, ""); places = $1 }
        END { printf "fuzz: %-8s %9d inputs, %6d a second, %6d places in the code reached, no fault\n", target, inputs, rate, places }
    ' "$folder/$target.log"
}

failed=0
running=0
for target in "${targets[@]}"; do
    [ -d "fuzz/seeds/$target" ] || { echo "fuzz: there is no target $target; there are $(ls fuzz/seeds | tr '\n' ' ')" >&2; exit 2; }
    if [ $running -eq 2 ]; then
        wait -n || failed=1
        running=1
    fi
    fuzz "$target" &
    running=$((running + 1))
done
while [ $running -gt 0 ]; do
    wait -n || failed=1
    running=$((running - 1))
done
exit $failed
