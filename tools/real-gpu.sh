#!/usr/bin/env bash
# What can be learnt on a machine with a real GPU in one command and under ten minutes; what did not fit is named at the end:
#
#     tools/real-gpu.sh OUT_DIR
#
# The algorithms on GPUs against the oracle, the benchmark of 1000 to 10 million objects with boxes in host and in device memory,
# the full probe and sweep, tuning, and a scenario that runs on them. OUT_DIR gets a log of each step, bench.md, the report
# (for datasets/), tuning and a picture. A step that fails does not stop the others; the exit status is 1 if any did.
#
# Builds with cargo. For a machine without a Rust toolchain or a network, build where there are both and carry one folder:
#
#     tools/real-gpu.sh --pack DIR                    # this script, the binaries, the Vulkan loader; under 64 MiB
#     DIR/real-gpu.sh OUT_DIR                         # there
#
# Beside it lies DIR.tar.xz, a quarter of that, which holds the tests too that DIR leaves out to stay under 64 MiB. Where tar or xz is missing:
#
#     python3 -c 'import tarfile; tarfile.open("DIR.tar.xz").extractall("DIR")'
#
# The reports of every profile of the machine, quick ones, for datasets/, take longer. In runs of under ten minutes, until it says that all are
# there:
#
#     tools/real-gpu.sh --profiles OUT_DIR
#
# BIN_DIR       folder of prebuilt sapwise, gpu_bench, gpu_contract and the other tests of GPUs; beside this script if they are there
# LOADER_DEBS   folder of the .deb files of the Vulkan loader, unpacked where the system has none; BIN_DIR if not given
# LIMIT_FACTOR  multiplies every time limit, for slow machines and software GPUs, which take 10 on two cores
# SKIP          names of steps to leave out, as they are printed; every_size takes an hour on a software GPU
# SAPWISE_GPUS  the GPUs of the benchmark, as in gpu0,gpu0+1; all if not given
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
# The tests of the library that need a GPU. Where a packed folder becomes too large, the last ones are left out.
tests=(gpu_contract gpu_resident gpu_faults gpu_device measure_gpu)
most_bytes=$((64 << 20))

usage() {
    sed -n '2,/^set /{/^set /d; s/^# \{0,1\}//; p}' "${BASH_SOURCE[0]}" >&2
    exit 2
}
say() { echo "real-gpu: $*" >&2; }
fail() { say "$*"; exit 1; }

# Builds everything with one selection of packages and features, so that wgpu is compiled once, and copies it into folder $1.
build() {
    local into=$1 name kind file
    local -a wanted=()
    for name in "${tests[@]}"; do wanted+=(--test "$name"); done
    [ -e "$here/../Cargo.toml" ] || fail "there are no binaries in ${BIN_DIR:-$here}, and no source to build them from; see --pack"
    command -v cargo >/dev/null || fail "there is no cargo here; carry the folder that --pack makes elsewhere, or set BIN_DIR"
    say "building; the first time takes minutes"
    # The benchmark is a reason for cargo to build the command as well.
    (cd "$here/.." && cargo test --release --workspace --locked --no-run --bench gpu "${wanted[@]}" --message-format=json) >"$into/build.json"
    while read -r kind name file; do
        case $kind:$name in
            bin:sapwise | test:*) cp "$file" "$into/$name" ;;
            bench:gpu) cp "$file" "$into/gpu_bench" ;;
        esac
    done < <(sed -n 's/.*"kind":\["\([a-z]*\)"\].*"name":"\([a-z_]*\)","src_path".*"executable":"\([^"]*\)".*/\1 \2 \3/p' "$into/build.json")
    rm "$into/build.json"
    for name in sapwise gpu_bench "${tests[@]}"; do
        [ -x "$into/$name" ] || fail "cargo built no $name"
    done
}

pack() {
    local into=$1 name bytes k
    mkdir -p "$into"
    into=$(cd "$into" && pwd)
    build "$into"
    for name in sapwise gpu_bench "${tests[@]}"; do strip "$into/$name"; done
    cp "${BASH_SOURCE[0]}" "$into/real-gpu.sh"
    if command -v apt-get >/dev/null; then
        # NVIDIA's driver asks for the libraries of GLVND as well.
        (cd "$into" && rm -f ./*.deb && apt-get download -q libvulkan1 libglvnd0 libglx0 libegl1) >&2 \
            || fail "the Vulkan loader could not be downloaded; if the lists of packages are old: apt-get update"
    else
        say "without apt-get the Vulkan loader is not packed; the other machine must have libvulkan.so.1"
    fi
    if command -v xz >/dev/null; then
        tar -C "$into" -cf - . | xz -T0 >"$into.tar.xz"
        say "$into.tar.xz has $(stat -c %s "$into.tar.xz") bytes and holds everything"
    else
        say "without xz $into.tar.xz is not made"
    fi
    bytes=$(du -sb "$into" | cut -f1)
    # The last tests matter least there.
    for ((k = ${#tests[@]} - 1; k > 0 && bytes >= most_bytes; k--)); do
        say "${tests[k]} is left out: with it $into has $bytes bytes, more than 64 MiB"
        rm "$into/${tests[k]}"
        bytes=$(du -sb "$into" | cut -f1)
    done
    [ "$bytes" -lt "$most_bytes" ] || fail "$into has $bytes bytes, more than 64 MiB"
    say "$into has $bytes bytes; carry it and run real-gpu.sh OUT_DIR in it"
}

# Makes the Vulkan loader and a driver known to the programs, if the system does not.
find_vulkan() {
    local debs=${LOADER_DEBS:-$bin} deb folder lib
    if PATH=$PATH:/sbin:/usr/sbin ldconfig -p | grep -F 'libvulkan.so.1 ' >/dev/null; then
        :
    elif compgen -G "$debs/*.deb" >/dev/null; then
        for deb in "$debs"/*.deb; do dpkg -x "$deb" "$work/loader"; done
        lib=$(find "$work/loader" -name 'libvulkan.so.1' -print -quit)
        [ -n "$lib" ] || { say "the .deb files in $debs hold no libvulkan.so.1"; return; }
        say "the Vulkan loader is that of $debs"
        LD_LIBRARY_PATH=$(dirname "$lib")${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}
        export LD_LIBRARY_PATH
    else
        say "there is no Vulkan loader here, and no .deb of one in $debs"
        return
    fi
    [ -z "${VK_DRIVER_FILES:-}${VK_ICD_FILENAMES:-}" ] || return 0
    # The loader looks into the first two folders by itself, and not into the third, where containers have NVIDIA's driver.
    for folder in /usr/share/vulkan/icd.d /etc/vulkan/icd.d /usr/local/nvidia/share/vulkan/icd.d; do
        [ -e "$folder/nvidia_icd.json" ] || continue
        [ "$folder" = /usr/local/nvidia/share/vulkan/icd.d ] || return 0
        export VK_DRIVER_FILES=$folder/nvidia_icd.json VK_ICD_FILENAMES=$folder/nvidia_icd.json
        say "the driver is that of $VK_DRIVER_FILES"
    done
}

factor=${LIMIT_FACTOR:-1}
[[ $factor =~ ^[1-9][0-9]*$ ]] || fail "LIMIT_FACTOR is $factor; it must be a whole number"
failed=()
total=$((590 * factor))
# Seconds that a step must leave for those after it.
reserve=0
# step NAME SECONDS COMMAND...: runs it within that time, and within the total; what it prints goes to NAME.log.
step() {
    local name=$1 limit=$(($2 * factor)) left=$((total - reserve * factor - SECONDS)) status=0 began=$SECONDS
    shift 2
    printf '%-13s ' "$name"
    case " ${SKIP:-} " in
        *" $name "*) echo "left out"; return ;;
    esac
    [ "$limit" -le "$left" ] || limit=$((left > 0 ? left : 1))
    # An interrupt lets a probe keep what it measured.
    timeout --signal=INT --kill-after=$((5 * factor)) "$limit" "$@" >"$out/$name.log" 2>&1 || status=$?
    case $status in
        0) echo "done, $((SECONDS - began)) s" ;;
        124 | 137) echo "NOT DONE within $limit s; see $name.log" ;;
        *) echo "FAILED with status $status after $((SECONDS - began)) s; see $name.log" ;;
    esac
    [ "$status" = 0 ] || failed+=("$name")
}

what=all
case ${1:-} in
    --pack) [ $# = 2 ] || usage; pack "$2"; exit ;;
    --profiles) what=profiles; shift ;;
    '' | -*) usage ;;
esac
[ $# = 1 ] && [ -n "$1" ] || usage
mkdir -p "$1"
out=$(cd "$1" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
if [ -n "${BIN_DIR:-}" ]; then
    bin=$(cd "$BIN_DIR" && pwd)
elif [ -x "$here/sapwise" ]; then
    bin=$here
else
    bin=$work/bin
    mkdir "$bin"
    build "$bin"
fi
for name in sapwise gpu_bench gpu_contract; do
    [ -x "$bin/$name" ] || fail "there is no program $name in $bin"
done
find_vulkan
cd "$out"
if [ $what = profiles ]; then
    SECONDS=0
    # Stopped by the time, it keeps the profiles that are done, and goes on with the next one in the next run.
    step profiles 580 "$bin/sapwise" probe --profiles --quick --out profiles
    [ ! -e profiles.log ] || tail -n 3 profiles.log
    compgen -G "profiles/*.json" >/dev/null || fail "no profile is there yet; see $out/profiles.log"
    step check 10 "$bin/sapwise" check profiles/*.json
    [ ${#failed[@]} = 0 ] || fail "not done: ${failed[*]}; the same command goes on"
    echo "all done; the reports are in $out/profiles"
    exit
fi
# A test that finds no GPU fails instead of passing with a remark.
export SAPWISE_REQUIRE_GPU=1

# Building does not count.
SECONDS=0
step devices 15 "$bin/sapwise" devices
[ ! -e devices.log ] || cat devices.log
for name in "${tests[@]}"; do
    [ ! -x "$bin/$name" ] || step "$name" 60 "$bin/$name"
done
# Not timed on a card since its large frames have an oracle that is no double loop: with that, three of twenty scenarios took 80 s beside an H200.
step every_size 180 "$bin/gpu_contract" --ignored --nocapture
step gpu_bench 120 "$bin/gpu_bench" --bench
[ ! -e gpu_bench.log ] || sed -n '/^[-|]/p' gpu_bench.log >bench.md
reserve=90
step probe 300 "$bin/sapwise" probe --out report.json
reserve=0
# Looks for the GPUs again, as `devices` does.
step check 15 "$bin/sapwise" check report.json
step predict 25 "$bin/sapwise" predict --out predicted.json
step measured 5 "$bin/sapwise" predict --report report.json --measured --out measured.json
# Every algorithm runs every frame, brute force on one thread too: with 29 of them on 16 cores and an H200 this took 22 s, and ten times the objects
# more than the time that there is.
step run 45 "$bin/sapwise" run fragmentation --objects 20000 --repeats 1 --tuning measured.json --plot run.svg

if [ ${#failed[@]} = 0 ]; then
    echo "all done in $SECONDS s; $out/report.json is the report, bench.md the benchmark"
else
    echo "${#failed[@]} failed: ${failed[*]}; the logs are in $out"
    exit 1
fi
