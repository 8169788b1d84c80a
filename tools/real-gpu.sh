#!/usr/bin/env bash
# Measures a machine with a real GPU, in commands of less than ten minutes each:
#
#     tools/real-gpu.sh OUT_DIR
#     tools/real-gpu.sh --scenes OUT_DIR       # eight scenes by the adaptive choice and by every algorithm
#     tools/real-gpu.sh --pair-cache OUT_DIR   # pair-cache beside the GPU, over a stream of rapier3d and four scenes
#     tools/real-gpu.sh --report OUT_DIR       # the report and the benchmark only
#
# The last three leave at most eight files. --scenes prints the mean and the worst time over the best single algorithm.
# Its tuning is predicted by a model that has not seen the card: the built-in one, or unseen.json on an H100 or H200.
#
# Runs the algorithms on GPUs against the oracle, times each dispatch, and runs the benchmark of 1000 to 10 million
# objects with boxes in host and in device memory, the full probe and sweep, predicted and measured tuning, and a
# scenario that runs on them. OUT_DIR gets a log of each step, bench.md, report.json (for datasets/), tuning and a
# picture. A step that fails does not stop the others, and the exit status is 1 then. What did not fit into the time is
# named at the end.
#
# Builds with cargo. For a machine without Rust or network, build elsewhere and carry one folder:
#
#     tools/real-gpu.sh --pack DIR        # this script, the binaries, the Vulkan loader; under 64 MiB
#     DIR/real-gpu.sh OUT_DIR             # there
#
# DIR.tar.xz beside it has a quarter of the size, and the tests that DIR leaves out to stay under 64 MiB. Without tar or
# xz there:
#
#     python3 -c 'import tarfile; tarfile.open("DIR.tar.xz").extractall("DIR")'
#
# Quick reports of every profile of the machine, for datasets/, take longer. Repeat until all are there:
#
#     tools/real-gpu.sh --profiles OUT_DIR
#
# BIN_DIR       folder of the built sapwise, gpu_bench and GPU tests [default: the folder of this script]
# LOADER_DEBS   folder of the Vulkan loader's .deb files, unpacked if the system has no loader [default: BIN_DIR]
# LIMIT_FACTOR  multiplies every time limit; a software GPU on two cores needs 10 [default: 1]
# SKIP          names of steps to leave out, as they are printed; every_size takes hours on a software GPU
# ONLY          names of steps to run, and no others
# SAPWISE_GPUS  the GPUs of the benchmark, such as gpu0,gpu0+1 [default: all]
# SOFTWARE      1: uses software GPUs too, to rehearse on a machine without a real one
# OBJECTS       objects of each scene of --scenes and --pair-cache [default: 20000 and 30000]
# FRAMES        frames of these scenes [default: 100]
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
# The tests that need a GPU, the most important first: a packed folder that is too large loses the last ones.
tests=(gpu_contract gpu_resident gpu_faults gpu_device measure_gpu)
most_bytes=$((64 << 20))

usage() {
    sed -n '2,/^set /{/^set /d; s/^# \{0,1\}//; p}' "${BASH_SOURCE[0]}" >&2
    exit 2
}
say() { echo "real-gpu: $*" >&2; }
fail() { say "$*"; exit 1; }

# Builds everything in one command, so that wgpu is compiled once, and copies it into folder $1.
build() {
    local into=$1 name kind file fields
    local -a wanted=()
    for name in "${tests[@]}"; do wanted+=(--test "$name"); done
    [ -e "$here/../Cargo.toml" ] || fail "${BIN_DIR:-$here} has no binaries, and there is no source; see --pack"
    command -v cargo >/dev/null || fail "there is no cargo; run --pack elsewhere and carry its folder, or set BIN_DIR"
    say "building; the first time takes minutes"
    (cd "$here/.." && cargo build --release --workspace --locked --features sapwise-gpu/long-tests \
        --bin sapwise --bench gpu "${wanted[@]}" --message-format=json) >"$into/build.json"
    fields='.*"kind":\["\([a-z]*\)"\].*"name":"\([a-z_]*\)","src_path".*"executable":"\([^"]*\)".*'
    while read -r kind name file; do
        case $kind:$name in
            bin:sapwise | test:*) cp "$file" "$into/$name" ;;
            bench:gpu) cp "$file" "$into/gpu_bench" ;;
        esac
    done < <(sed -n "s/$fields/\1 \2 \3/p" "$into/build.json")
    rm "$into/build.json"
    for name in sapwise gpu_bench "${tests[@]}"; do
        [ -x "$into/$name" ] || fail "cargo built no $name"
    done
    cp "$here/../tests/fixtures/fragments.npy" "$into/"
    # One GPU of this family is in the built-in model.
    find "$here/../datasets" -name '*.json' ! -path '*/published/*' ! -name 'nvidia-h200.json' -print0 \
        | sort -z | xargs -0 "$into/sapwise" train --out "$into/unseen.json" >/dev/null
}

pack() {
    local into=$1 name bytes k
    mkdir -p "$into"
    into=$(cd "$into" && pwd)
    build "$into"
    for name in sapwise gpu_bench "${tests[@]}"; do strip "$into/$name"; done
    cp "${BASH_SOURCE[0]}" "$into/real-gpu.sh"
    if command -v apt-get >/dev/null; then
        # NVIDIA's driver needs the libraries of GLVND as well.
        (cd "$into" && rm -f ./*.deb && apt-get download -q libvulkan1 libglvnd0 libglx0 libegl1) >&2 \
            || fail "the Vulkan loader could not be downloaded; if the lists of packages are old: apt-get update"
    else
        say "there is no apt-get, so the Vulkan loader is not packed; the other machine must have libvulkan.so.1"
    fi
    if command -v xz >/dev/null; then
        tar -C "$into" -cf - . | xz -T0 >"$into.tar.xz"
        say "$into.tar.xz has everything in $(stat -c %s "$into.tar.xz") bytes"
    else
        say "there is no xz, so there is no $into.tar.xz"
    fi
    bytes=$(du -sb "$into" | cut -f1)
    for ((k = ${#tests[@]} - 1; k > 0 && bytes >= most_bytes; k--)); do
        say "$into has $bytes bytes, more than 64 MiB: ${tests[k]} is left out"
        rm "$into/${tests[k]}"
        bytes=$(du -sb "$into" | cut -f1)
    done
    [ "$bytes" -lt "$most_bytes" ] || fail "$into has $bytes bytes, more than 64 MiB"
    say "$into has $bytes bytes; carry it and run real-gpu.sh OUT_DIR in it"
}

# Sets the variables for the Vulkan loader and a driver, unless the system has them.
find_vulkan() {
    local debs=${LOADER_DEBS:-$bin} deb folder lib
    if PATH=$PATH:/sbin:/usr/sbin ldconfig -p | grep -F 'libvulkan.so.1 ' >/dev/null; then
        :
    elif compgen -G "$debs/*.deb" >/dev/null; then
        for deb in "$debs"/*.deb; do dpkg -x "$deb" "$work/loader"; done
        lib=$(find "$work/loader" -name 'libvulkan.so.1' -print -quit)
        [ -n "$lib" ] || { say "the .deb files in $debs have no libvulkan.so.1"; return; }
        say "the Vulkan loader is that of $debs"
        LD_LIBRARY_PATH=$(dirname "$lib")${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}
        export LD_LIBRARY_PATH
    else
        say "there is no Vulkan loader, and no .deb of one in $debs"
        return
    fi
    [ -z "${VK_DRIVER_FILES:-}${VK_ICD_FILENAMES:-}" ] || return 0
    # The loader searches the first two folders itself. In containers NVIDIA's driver is in the third.
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
# Seconds that a step must leave for the following steps.
reserve=0
# step NAME SECONDS COMMAND...: runs the command within that time and the total, with its output in NAME.log.
step() {
    local name=$1 limit=$(($2 * factor)) left=$((total - reserve * factor - SECONDS)) status=0 began=$SECONDS
    shift 2
    printf '%-13s ' "$name"
    case " ${ONLY:-$name} " in *" $name "*) ;; *) echo "left out"; return ;; esac
    case " ${SKIP:-} " in *" $name "*) echo "left out"; return ;; esac
    [ "$limit" -le "$left" ] || limit=$((left > 0 ? left : 1))
    # After an interrupt, a probe keeps what it measured.
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
    --profiles | --scenes | --pair-cache | --report) what=${1#--}; shift ;;
    '' | -*) usage ;;
esac
[ $# = 1 ] && [ -n "$1" ] || usage
mkdir -p "$1"
out=$(cd "$1" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
if [ -n "${BIN_DIR:-}" ]; then
    bin=$(cd "$BIN_DIR" && pwd)
elif [ -x "$here/gpu_bench" ]; then
    bin=$here
else
    bin=$work/bin
    mkdir "$bin"
    build "$bin"
fi
for name in sapwise gpu_bench gpu_contract; do
    [ -x "$bin/$name" ] || [ -n "${ONLY:-}" ] || fail "there is no program $name in $bin"
done
find_vulkan
cd "$out"
if [ $what = profiles ]; then
    SECONDS=0
    # If time runs out, it keeps the complete profiles, and the next run continues.
    step profiles 580 "$bin/sapwise" probe --profiles --quick --out profiles
    [ ! -e profiles.log ] || tail -n 3 profiles.log
    compgen -G "profiles/*.json" >/dev/null || fail "there is no profile yet; see $out/profiles.log"
    step check 10 "$bin/sapwise" check profiles/*.json
    [ ${#failed[@]} = 0 ] || fail "not done: ${failed[*]}; the same command goes on"
    echo "all done; the reports are in $out/profiles"
    exit
fi
# Tests fail if they find no GPU.
export SAPWISE_REQUIRE_GPU=1
software=()
[ -z "${SOFTWARE:-}" ] || software=(--software-gpus)

# scene SCENE SECONDS OPTION...: a step that runs a scene or a stream, with its output at the end of scenes.log.
scene() {
    local name=${1##*/} limit=$2
    name=${name%.npy}
    step "$name" "$limit" "$bin/sapwise" run "$1" --tuning predicted.json "${software[@]}" "${@:3}"
    [ ! -e "$name.log" ] || { cat "$name.log" >>scenes.log; rm "$name.log"; }
}
end() {
    [ ${#failed[@]} = 0 ] || { echo "${#failed[@]} failed: ${failed[*]}; the logs are in $out"; exit 1; }
    echo "all done in $SECONDS s; $*"
    exit
}

# Building does not count.
SECONDS=0
step devices 15 "$bin/sapwise" devices
[ ! -e devices.log ] || cat devices.log
if [ $what = scenes ] || [ $what = pair-cache ]; then
    grep -qE '^gpu[0-9]+ ' devices.log || fail "there is no GPU"
    [ -n "${SOFTWARE:-}" ] || grep -qE '^gpu[0-9]+ +(discrete|integrated|virtual|other)' devices.log \
        || fail "there is no real GPU; SOFTWARE=1 rehearses on others"
    model=()
    ! grep -qE 'H[12]00' devices.log || model=(--model "$bin/unseen.json")
    step predict 30 "$bin/sapwise" predict "${model[@]}" "${software[@]}" --out predicted.json
    [ -e predicted.json ] || fail "there is no tuning; see $out/predict.log"
    rm -f scenes.log
fi
if [ $what = scenes ]; then
    objects=${OBJECTS:-20000} frames=${FRAMES:-100}
    for name in uniform fast clustered mixed resting gravity; do
        scene $name 60 --objects "$objects" --frames "$frames" --repeats 4
    done
    scene slab 80 --objects "$objects" --swing 50 --frames $((3 * frames)) --repeats 2
    scene fragmentation 100 --objects "$objects" --repeats 2 ${FRAMES:+--frames "$FRAMES"}
    # The first number after `all` is the time over that of the best single algorithm.
    awk '/^[a-z-]+, [0-9 ]+ frames/ { name = $1; sub(",", "", name) }
        $1 == "all" { printf "%-14s %s\n", name, $2; n++; sum += log($2); if ($2 > worst) worst = $2 }
        END { printf "%d scenes over the best single algorithm: mean %.3f, worst %.3f\n", n, exp(sum / n), worst }' \
        scenes.log | tee scenes.txt
    end "$out/scenes.txt has the times over the best single algorithm, scenes.log every algorithm"
fi
if [ $what = pair-cache ]; then
    scene "$bin/fragments.npy" 60 --repeats 4
    for name in resting asleep brownian gravity; do
        scene $name 110 --objects "${OBJECTS:-30000}" --frames "${FRAMES:-100}" --repeats 3
    done
    grep -E '^(run by|pair-cache|[a-z-]+@gpu|adaptive)|, [0-9 ]+ frames' scenes.log | tee pair-cache.txt
    end "$out/pair-cache.txt has the times, scenes.log those of every algorithm"
fi
if [ $what = report ]; then
    step probe 300 "$bin/sapwise" probe "${software[@]}" --out report.json
    step check 15 "$bin/sapwise" check report.json
    step gpu_bench 240 "$bin/gpu_bench" --bench
    [ ! -e gpu_bench.log ] || sed -n '/^[-|]/p' gpu_bench.log >bench.md
    end "$out/report.json is the report, bench.md the benchmark"
fi
for name in "${tests[@]}"; do
    [ ! -x "$bin/$name" ] || step "$name" 60 "$bin/$name"
done
# A program that was built without the test would run none and succeed.
step every_size 180 bash -c '"$1" --ignored --list | grep ": test$" && exec "$1" --ignored --nocapture' \
    bash "$bin/gpu_contract"
step dispatches 60 "$bin/gpu_bench" --bench --dispatches
step gpu_bench 120 "$bin/gpu_bench" --bench
[ ! -e gpu_bench.log ] || sed -n '/^[-|]/p' gpu_bench.log >bench.md
reserve=90
step probe 300 "$bin/sapwise" probe --out report.json
reserve=0
step check 15 "$bin/sapwise" check report.json
step predict 25 "$bin/sapwise" predict --out predicted.json
step measured 5 "$bin/sapwise" predict --report report.json --measured --out measured.json
# Runs every algorithm in every frame: 22 s with 29 algorithms on 16 cores and an H200.
step run 45 "$bin/sapwise" run fragmentation --objects 20000 --repeats 1 --tuning measured.json --plot run.svg

end "$out/report.json is the report, bench.md the benchmark"
