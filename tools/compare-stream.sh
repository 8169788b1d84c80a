#!/usr/bin/env bash
# Compares the triad bandwidth of `sapwise::measure` with a C triad (or a real STREAM binary), run by run in turn.
#
#     tools/compare-stream.sh [PAIRS]          10 pairs of runs by default
#     STREAM_BIN=./stream tools/compare-stream.sh
#
# Prints for one thread and for all threads: the median over the runs of both programs, and the median and interquartile
# range of the ratio ours / C taken pair by pair, best against best and median against median. A STREAM binary
# prints its best rate only, so the medians are left out with it.
#
# A pair in which other programs took more than 5 % of the CPU is thrown away and repeated, 4 times PAIRS at most.
# Needs Linux, bash, awk, cargo, and a C compiler with OpenMP in CC (default: cc). CARGO_TARGET_DIR is respected.
set -euo pipefail
cd "$(dirname "$0")/.."

pairs=${1:-10}
cc=${CC:-cc}
cpus=$(grep -c '^cpu[0-9]' /proc/stat)
threads=$(nproc)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

cargo build --quiet --release --features measure --example measure_bandwidth
ours=${CARGO_TARGET_DIR:-target}/release/examples/measure_bandwidth
mebibytes=$("$ours" --array-mebibytes)
if [ -z "${STREAM_BIN:-}" ]; then
    "$cc" -O3 -fopenmp -march=native tools/stream/triad.c -o "$work/triad" -lm
fi

# Best and median GB/s of the C program on $1 threads.
c_triad() {
    if [ -n "${STREAM_BIN:-}" ]; then
        OMP_NUM_THREADS=$1 "$STREAM_BIN" | awk '/^Triad:/ { printf "%.3f nan\n", $2 / 1000 }'
    else
        OMP_NUM_THREADS=$1 "$work/triad" "$mebibytes"
    fi
}

# Writes the output of a command to a file, and prints the share of the CPU that others took meanwhile.
# Busy time is what idle and waiting time leave of the wall clock, as in src/measure/foreign_load.rs.
idle_ticks() { awk '/^cpu / { print $5 + $6; exit }' /proc/stat; }
watched() {
    local file=$1 before after
    shift
    before=$(idle_ticks)
    TIMEFORMAT='%R %U %S'
    { time "$@" >"$file"; } 2>"$work/time"
    after=$(idle_ticks)
    tail -n 1 "$work/time" | awk -v idle=$((after - before)) -v cpus="$cpus" \
        '{ all = $1 * cpus; share = all > 0 ? (all - idle / 100 - $2 - $3) / all : 1; printf "%.3f\n", share < 0 ? 0 : share }'
}

kept=0
attempts=0
: >"$work/pairs"
while [ "$kept" -lt "$pairs" ] && [ "$attempts" -lt $((4 * pairs)) ]; do
    attempts=$((attempts + 1))
    load_one=$(watched "$work/c_one" c_triad 1)
    load_ours=$(watched "$work/ours" "$ours")
    load_all=$(watched "$work/c_all" c_triad "$threads")
    # Line: C one best, C one median, C all best, C all median, then the same of ours.
    line="$(cat "$work/c_one") $(cat "$work/c_all") $(cat "$work/ours")"
    if awk -v a="$load_one" -v b="$load_ours" -v c="$load_all" 'BEGIN { exit !(a <= 0.05 && b <= 0.05 && c <= 0.05) }'; then
        echo "$line" >>"$work/pairs"
        kept=$((kept + 1))
    else
        echo "pair thrown away: others took $load_one, $load_ours, $load_all of the CPU" >&2
        sleep 2
    fi
done

echo "arrays of $mebibytes MiB, $threads threads, $kept pairs kept of $attempts"
[ "$kept" -gt 0 ] || { echo "no quiet pair; run it again when the machine is idle" >&2; exit 1; }

# Median and quartiles of a column of numbers, interpolated.
summary() {
    sort -g | awk '{ x[NR] = $1 }
        function q(p,   at, low) { at = 1 + (NR - 1) * p; low = int(at); return low < NR ? x[low] + (x[low + 1] - x[low]) * (at - low) : x[NR] }
        END { printf "%.3f %.3f %.3f\n", q(0.5), q(0.25), q(0.75) }'
}
row() {
    local label=$1 c=$2 o=$3
    if grep -q nan <(awk -v c="$c" '{ print $c }' "$work/pairs"); then return; fi
    local median_c median_o ratio low high
    read -r median_c _ _ < <(awk -v c="$c" '{ print $c }' "$work/pairs" | summary)
    read -r median_o _ _ < <(awk -v o="$o" '{ print $o }' "$work/pairs" | summary)
    read -r ratio low high < <(awk -v c="$c" -v o="$o" '{ print $o / $c }' "$work/pairs" | summary)
    printf '%-24s C %8.2f GB/s   ours %8.2f GB/s   ratio %.3f (quartiles %.3f to %.3f)\n' \
        "$label" "$median_c" "$median_o" "$ratio" "$low" "$high"
}
row "one thread, best" 1 5
row "one thread, median" 2 6
row "all threads, best" 3 7
row "all threads, median" 4 8
