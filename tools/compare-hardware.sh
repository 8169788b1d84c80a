#!/usr/bin/env bash
# Holds the hardware parameters that `sapwise` measures against the tools that the field trusts, run by run in turn.
#
#     tools/compare-hardware.sh [ROUNDS] [GROUP...]
#
# 10 rounds by default, of every group: reported clock latency memory cores scaling opencl vulkan. Prints a table: our
# median, theirs, the median and quartiles of the ratio ours / theirs taken pair by pair, the number of pairs, and whether the
# ratio is within 0.95 to 1.05, or why not. Ends with status 1 where a ratio is outside and no reason is known.
#
# A round in which other programs took more than 5 % of the CPU is thrown away and repeated, 4 times ROUNDS at most; so is
# one in which the host moved the virtual CPUs to cores that lie nearer or farther apart. SAPWISE_SIMD is respected.
#
# Needs Linux, bash, awk, cargo, and a C compiler with OpenMP in CC (default: cc). What else it finds it uses: likwid-bench,
# sysbench, clpeak with pocl-opencl-icd, vulkaninfo (Debian: likwid, sysbench, clpeak, pocl-opencl-icd, vulkan-tools). What is
# missing is reported and left out. STREAM_BIN names a STREAM binary, or STREAM_C its stream.c, which is then built for the size
# of our arrays. For software GPUs: eval "$(tools/software-gpus.sh)" first.
set -euo pipefail
cd "$(dirname "$0")/.."

count=10
if [[ ${1:-} =~ ^[0-9]+$ ]]; then
    count=$1
    shift
fi
groups=("$@")
[ "${#groups[@]}" -gt 0 ] || groups=(reported clock latency memory cores scaling opencl vulkan)
threads=$(nproc)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
: >"$work/pairs"
# shellcheck source=tools/compare/lib.sh
. tools/compare/lib.sh
# shellcheck source=tools/compare/gpu.sh
. tools/compare/gpu.sh

start_sapwise
"$cc" -O3 -fopenmp -march=native tools/compare/triad.c -o "$work/triad" -lm

# ours FAMILY: our parameters of one family, in $work/ours.out.
ours() { take ours part hardware "$1"; }
value() { figure "$work/ours.out" "$1" value; }
best() { figure "$work/ours.out" "$1" best; }
theirs() { cat "$work/theirs.out"; }

ours topology
lanes=$(printf '%.0f' "$(value simd_lanes)")
case $lanes in
    16) level=avx512 fused=avx512_fma ;;
    8) level=avx fused=avx_fma ;;
    *) level=sse fused=sse ;;
esac
ours memory
mebibytes=$(grep -o 'three arrays of [0-9]*' "$work/ours.out" | head -n 1 | grep -o '[0-9]*$')
stream=${STREAM_BIN:-}
if [ -z "$stream" ] && [ -n "${STREAM_C:-}" ]; then
    stream=$work/stream
    "$cc" -O3 -fopenmp -march=native -mcmodel=medium -DSTREAM_ARRAY_SIZE=$((mebibytes * 131072)) -DNTIMES=13 "$STREAM_C" -o "$stream"
fi
[ -n "$stream" ] || say "left out: STREAM (set STREAM_BIN, or STREAM_C to its stream.c)"

group_reported() {
    ours topology || return
    pair usable_cores nproc "$(value usable_cores)" "$threads"
    if have lscpu util-linux; then
        pair physical_cores "lscpu" "$(value physical_cores)" "$(lscpu -p=CORE,SOCKET | grep -v '^#' | sort -u | wc -l)"
    fi
    ours caches || return
    local of_libc="the C library asks CPUID, which a virtual machine may fill with other sizes than sysfs"
    pair cache_l1d_bytes getconf "$(value cache_l1d_bytes)" "$(getconf LEVEL1_DCACHE_SIZE)" "$of_libc"
    pair cache_l2_bytes getconf "$(value cache_l2_bytes)" "$(getconf LEVEL2_CACHE_SIZE)" "$of_libc"
    pair cache_llc_bytes getconf "$(value cache_llc_bytes)" "$(getconf LEVEL3_CACHE_SIZE)" "$of_libc"
    ours memory || return
    pair memory_bytes "free" "$(value memory_bytes)" "$(free -b | awk '/^Mem:/ { print $2 }')" "a control group allows less"
}

group_clock() {
    ours clock || return
    take theirs "$work/reference" clock || return
    pair clock_measured_ghz "additions in C" "$(value clock_measured_ghz)" "$(theirs)"
    pair clock_reported_ghz /proc/cpuinfo "$(value clock_reported_ghz)" \
        "$(awk -F : '/^cpu MHz/ { print $2 / 1000; exit }' /proc/cpuinfo)" "cpufreq and CPUID tell the highest clock, /proc/cpuinfo that of now"
}

group_latency() {
    local kib llc reason
    ours caches || return
    llc=$(awk -v bytes="$(value cache_llc_bytes)" 'BEGIN { printf "%.0f\n", bytes / 1024 }')
    for kib in 16 256 1024 4096 16384 65536 262144; do
        take theirs "$work/reference" latency "$kib" || return
        reason=
        if [ "$kib" -ge $((llc / 2)) ] && [ "$kib" -le $((4 * llc)) ]; then
            reason="about as large as the last-level cache: what others leave of it changes from second to second"
        fi
        pair "latency_${kib}_kib_ns" "random cycle in C" "$(value "latency_${kib}_kib_ns")" "$(theirs)" "$reason"
    done
}

# memory_on THREADS NAME: our bandwidth on so many threads against every tool.
memory_on() {
    local of=$1 name=$2 figures
    OMP_NUM_THREADS=$of take theirs "$work/triad" "$mebibytes" || return
    read -r -a figures < <(theirs)
    pair "$name" "triad in C, median" "$(value "$name")" "${figures[1]}"
    pair "$name" "triad in C, best" "$(best "$name")" "${figures[0]}"
    if [ -n "$stream" ]; then
        OMP_NUM_THREADS=$of take theirs "$stream" || return
        pair "$name" "STREAM, best" "$(best "$name")" "$(theirs | awk '/^Triad:/ { print $2 / 1000 }')" \
            "built for arrays of another size, or for other vectors?"
    fi
    if have likwid-bench "Debian: likwid"; then
        take theirs likwid-bench -t "stream_$level" -W "N:$((3 * mebibytes * 1048576 / 1000000))MB:$of" || return
        # 24 bytes an element, as STREAM counts.
        pair "$name" "likwid-bench stream_$level" "$(value "$name")" "$(theirs | awk '/^MByte\/s:/ { print $2 / 1000 }')" \
            "likwid-bench runs unrolled assembly for a second; ours is a compiled loop, as that of STREAM is"
    fi
    if have sysbench "Debian: sysbench"; then
        take theirs sysbench memory --memory-block-size="${mebibytes}M" --memory-total-size=100T --memory-oper=read --time=1 \
            --threads="$of" run || return
        pair "$name" "sysbench memory, read" "$(value "$name")" \
            "$(theirs | sed -n 's/.*(\([0-9.]*\) MiB\/sec).*/\1/p' | awk '{ print $1 * 1.048576 / 1000 }')" \
            "sysbench reads one block word by word without vectors: it measures its loop"
    fi
}

group_memory() {
    ours memory || return
    memory_on 1 bandwidth_one_thread_gb_per_s || return
    if [ "$threads" -gt 1 ]; then memory_on "$threads" bandwidth_all_threads_gb_per_s || return; fi
}

group_cores() {
    if [ "$threads" = 1 ]; then
        say "left out: this process may use one core"
        return
    fi
    ours core_to_core || return
    take theirs "$work/reference" distance || return
    pair core_to_core_ns "hand-over in C" "$(value core_to_core_ns)" "$(theirs)" \
        "the way depends on which memory the line belongs to, and so differs by a fifth from one run to the next"
    ours fork_join || return
    OMP_WAIT_POLICY=active take theirs "$work/reference" region || return
    pair fork_join_warm_ns "region of OpenMP in C" "$(value fork_join_warm_ns)" "$(theirs)" \
        "another run time: OpenMP's threads spin for their next region, helpers of rayon are handed one task each"
}

group_scaling() {
    have likwid-bench "Debian: likwid" || return
    [ "$threads" -gt 1 ] || return 0
    local of figures=()
    for of in 1 "$threads"; do
        take theirs likwid-bench -t "peakflops_sp_$fused" -W "N:$((of * 16))kB:$of" || return
        figures+=("$(theirs | awk '/^MFlops\/s:/ { print $2 }')")
    done
    ours scaling || return
    pair scaling_all_threads_ratio "likwid-bench, all over one" "$(value scaling_all_threads_ratio)" \
        "$(awk -v one="${figures[0]}" -v all="${figures[1]}" 'BEGIN { print all / one }')"
}

for group in "${groups[@]}"; do
    if ! declare -F "group_$group" >/dev/null; then
        say "there is no group $group; use reported, clock, latency, memory, cores, scaling, opencl or vulkan"
        exit 2
    fi
    case $group in
        # What is told, and not measured, does not change from one round to the next.
        reported | vulkan) rounds "$group" 1 ;;
        *) rounds "$group" "$count" ;;
    esac
done
[ -s "$work/pairs" ] || { say "no quiet round; run it again when the machine is idle"; exit 1; }
echo "$threads threads, vectors of $lanes lanes, arrays of $mebibytes MiB"
table | tee "$work/table"
! grep -q 'DIFFERS' "$work/table"
