#!/usr/bin/env bash
# Compiles every kernel with the compilers of GPUs that are not here, and checks the library's calls with Vulkan's
# validation layers:
#
#   Tint (npm's `webgpu`)                makes every pipeline, as Chromium and Dawn do
#   spirv-val                            checks naga's SPIR-V for Vulkan 1.3 with robustness, and for 1.1 without
#   DXC (from PyPI's `compushady`)       compiles naga's HLSL
#   naga                                 writes Metal, for which no compiler runs here
#   RADV (Mesa)                          compiles for four families of AMD: no spills, no scratch memory, and the
#                                        registers, occupancy and instructions of datasets/shaders.csv
#   validation layers, synchronization   no message in a part of the GPU tests, on both software GPUs
#
#     tools/shader-check.sh             fails if one of them refuses something, or datasets/shaders.csv differs
#     tools/shader-check.sh --update    writes datasets/shaders.csv
#
# Each of them also gets something that it must refuse; otherwise it is not active, and the script fails. Needs Node.js
# with npm, Python with pip, and Debian's packages mesa-vulkan-drivers, spirv-tools and vulkan-validationlayers. As
# root, installs what is missing; downloads `webgpu` and DXC into a cache folder.
set -euo pipefail
cd "$(dirname "$0")/.."

fail() { echo "shader-check: $*" >&2; exit 1; }
step() { printf -- '--- %3d s: %s\n' "$SECONDS" "$*"; }
case "${*:-}" in
    "") update= ;;
    --update) update=1 ;;
    *) echo "usage: tools/shader-check.sh [--update]" >&2; exit 2 ;;
esac

families="polaris10 vega10 navi21 gfx1100"
table=datasets/shaders.csv
webgpu=0.6.2
compushady=0.17.5
compushady_sha256=5052caf9e955d8e7a48e22f536e82b44b72e83af46e824a9e99157c7809de691
cache=${XDG_CACHE_HOME:-$HOME/.cache}/sapwise/shader-check
tint=$cache/webgpu-$webgpu/node_modules/webgpu
dxc=$cache/libdxcompiler-$compushady.so
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export CARGO_INCREMENTAL=0

# `refuses WHO WORDS COMMAND...`: the command must fail with these words.
refuses() {
    local who=$1 words=$2
    shift 2
    if "$@" >"$work/said" 2>&1; then fail "$who does not refuse what is wrong ($*)"; fi
    grep -qE -- "$words" "$work/said" \
        || { cat "$work/said" >&2; fail "$who refuses it for another reason than: $words"; }
}

step "tools"
missing=()
command -v node >/dev/null || missing+=(nodejs)
command -v npm >/dev/null || missing+=(npm)
python3 -m pip --version >/dev/null 2>&1 || missing+=(python3-pip)
command -v spirv-val >/dev/null || missing+=(spirv-tools)
vulkan() { find /usr/share/vulkan /usr/local/share/vulkan /etc/vulkan -path "$1" 2>/dev/null | head -n 1; }
radv() { vulkan '*icd.d/radeon_icd*.json'; }
layer() { vulkan '*layer.d/VkLayer_khronos_validation.json'; }
[ -n "$(radv)" ] || missing+=(mesa-vulkan-drivers)
[ -n "$(layer)" ] || missing+=(vulkan-validationlayers)
if [ ${#missing[@]} -gt 0 ]; then
    [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null \
        || fail "missing: ${missing[*]}; install them, or run this as root on Debian"
    apt-get update -q
    apt-get install -qy --no-install-recommends "${missing[@]}"
    [ -n "$(radv)" ] || fail "this release's mesa-vulkan-drivers has no RADV"
    [ -n "$(layer)" ] || fail "this release's vulkan-validationlayers has no Khronos layer"
fi
mkdir -p "$cache"
# Each gets its name when it is complete.
if [ ! -d "$tint" ]; then
    npm install --silent --ignore-scripts --no-audit --no-fund --prefix "$cache/webgpu-$webgpu.part" "webgpu@$webgpu"
    mv "$cache/webgpu-$webgpu.part" "$cache/webgpu-$webgpu"
fi
if [ ! -e "$dxc" ]; then
    echo "compushady==$compushady --hash=sha256:$compushady_sha256" >"$work/requirements"
    python3 -m pip --quiet --disable-pip-version-check download --no-deps --no-binary compushady \
        -d "$work" -r "$work/requirements"
    tar -xzOf "$work/compushady-$compushady.tar.gz" --wildcards "*/libdxcompiler_$(uname -m).so.*" >"$dxc.part"
    mv "$dxc.part" "$dxc"
fi
gpus=$(tools/software-gpus.sh)

step "kernels"
naga_of() { sed -n '/^name = "naga"$/{n;p}' "$1"; }
[ "$(naga_of Cargo.lock)" = "$(naga_of tools/shaders/Cargo.lock)" ] \
    || fail "tools/shaders has another naga than the library: change its Cargo.toml, and compare wgpu-hal's options"
tools=${CARGO_TARGET_DIR:-target}/tools
CARGO_TARGET_DIR=$tools cargo build --quiet --locked --manifest-path tools/shaders/Cargo.toml
shaders=$tools/debug/sapwise-shaders
mkdir "$work"/{wgsl,out,wrong,heavy}
# All default packages, as in `cargo test`: with fewer, cargo builds dependencies again with other features.
SAPWISE_SHADERS=$work/wgsl cargo test --quiet --locked --lib -- every_shader_is_valid >"$work/said" 2>&1 \
    || { cat "$work/said" >&2; fail "no kernels"; }
git ls-files '*.wgsl' | while read -r file; do
    grep -qFx -- "$(head -n 1 "$file")" "$work"/wgsl/*.wgsl \
        || fail "$file is in none of the shaders that the tests every_shader_is_valid write"
done

step "Tint"
# After a crash or a timeout, tries again.
tint_of() {
    local status
    for _ in 1 2 3; do
        status=0
        timeout 60 node tools/shaders/tint.mjs "$tint" "$1" || status=$?
        [ $status -gt 1 ] || return $status
    done
    return $status
}
pipelines=0
for file in "$work"/wgsl/*.wgsl; do
    tint_of "$file" >"$work/made" || fail "Tint does not take ${file##*/}"
    pipelines=$((pipelines + $(tail -n 1 "$work/made")))
done
echo "$pipelines pipelines through Tint"
# naga accepts this: a barrier that not every invocation reaches.
cat >"$work/wrong/barrier.wgsl" <<'WGSL'
@group(0) @binding(0) var<storage, read_write> words: array<u32>;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (words[id.x] == 1u) { workgroupBarrier(); }
    words[id.x] = 0u;
}
WGSL
refuses Tint "must only be called from uniform control flow" tint_of "$work/wrong/barrier.wgsl"

step "SPIR-V, HLSL, Metal"
"$shaders" translate "$work/wgsl" "$work/out"
for file in "$work"/out/*.spv; do
    case $file in *.1_1.spv) vulkan=vulkan1.1 ;; *) vulkan=vulkan1.3 ;; esac
    spirv-val --target-env $vulkan "$file" || fail "spirv-val refuses ${file##*/} for $vulkan"
done
# The fourth word is the bound of ids.
{ head -c 12 "$file"; printf '\1\0\0\0'; tail -c +17 "$file"; } >"$work/wrong/bound.spv"
refuses spirv-val "must be less than the ID bound" spirv-val "$work/wrong/bound.spv"
"$shaders" dxc "$dxc" "$work/out"
hlsl=("$work"/out/*.hlsl)
{ cat "${hlsl[0]}"; echo "uint wrong() { return no_such_name; }"; } >"$work/wrong/${hlsl[0]##*/}"
refuses DXC "undeclared identifier 'no_such_name'" "$shaders" dxc "$dxc" "$work/wrong"

step "RADV"
on() { VK_ICD_FILENAMES=$(radv) VK_DRIVER_FILES=$(radv) RADV_FORCE_FAMILY=$1 "$shaders" statistics "$1" "$2"; }
for family in $families; do on "$family" "$work/wgsl" >"$work/$family.csv"; done
# Each file has the same head.
for family in $families; do cat "$work/$family.csv"; done | awk 'NR == 1 { head = $0 } NR == 1 || $0 != head' \
    >"$work/shaders.csv"
# A kernel that keeps 200 words over a barrier. Workgroups of 1024 have 64 registers for them on GCN, and 128 on RDNA.
{
    echo "@group(0) @binding(0) var<storage, read_write> words: array<u32>;"
    echo "@compute @workgroup_size(1024)"
    echo "fn main(@builtin(global_invocation_id) id: vec3u) {"
    for k in $(seq 200); do echo "let v$k = words[id.x * $k + words[$k]];"; done
    echo "storageBarrier();"
    for k in $(seq 200); do echo "words[id.x + $k] = v$k ^ words[v$k];"; done
    echo "}"
} >"$work/heavy/kernel.wgsl"
for family in $families; do
    for column in spilled_vgprs scratch_bytes; do
        refuses "the check of $family" "kernel.main on $family: $column is [1-9]" on "$family" "$work/heavy"
    done
done
driver() { sed -n '2s/,.*//p' "$1"; }
if [ -n "$update" ]; then
    cp "$work/shaders.csv" "$table"
    echo "wrote $table"
elif [ "$(driver "$table")" != "$(driver "$work/shaders.csv")" ]; then
    echo "$table is of $(driver "$table") and this is $(driver "$work/shaders.csv"): not compared"
else
    diff "$table" "$work/shaders.csv" >&2 || fail "if this is intended, run tools/shader-check.sh --update and commit"
fi

step "validation layers"
cat >"$work/vk_layer_settings.txt" <<'SETTINGS'
khronos_validation.debug_action = VK_DBG_LAYER_ACTION_LOG_MSG
khronos_validation.report_flags = error,warn,perf,info
khronos_validation.log_filename = stdout
khronos_validation.enables = VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT
SETTINGS
# Runs a command, with its output in $work/said. Fails if the command does, or if the layers printed no settings.
watched() {
    (
        eval "$gpus"
        # The layers cache which shaders they have checked.
        export XDG_CACHE_HOME=$work
        export VK_LAYER_SETTINGS_PATH=$work/vk_layer_settings.txt VK_INSTANCE_LAYERS=VK_LAYER_KHRONOS_validation
        SAPWISE_REQUIRE_GPU=1 "$@" >"$work/said" 2>&1
    ) || { tail -n 50 "$work/said" >&2; fail "under the validation layers: $*"; }
    grep -q "Current Enables:.*SYNCHRONIZATION_VALIDATION" "$work/said" \
        || fail "no validation layers, or without synchronization, or no such test: $*"
}
messages() { grep "MessageID = " "$work/said" | grep -v "Validation Information: "; }
watched "$shaders" hazard
for rule in VUID-vkCmdFillBuffer-dstBuffer-00029 SYNC-HAZARD-WRITE-AFTER-WRITE; do
    messages | grep -F "$rule" >/dev/null || fail "the validation layers don't report $rule"
done
# The program of `cargo test`: with `-p sapwise-gpu` cargo builds wgpu again with other features.
of_gpu=$(cargo test --locked --no-run --lib 2>&1 | sed -n 's/.*(\(.*sapwise_gpu-[^)]*\))$/\1/p')
[ -x "$of_gpu" ] || fail "cargo names no program of the tests of sapwise-gpu"
# All methods, the measurements, pieces and windows. Tests that repeat the same calls at other sizes take minutes.
for tests in "" "--test gpu_device" "--test gpu_resident" "--test measure_gpu" \
    "--test gpu_contract random_boxes" "--test gpu_faults come_in_"; do
    # shellcheck disable=SC2086 # Words of cargo's.
    if [ -n "$tests" ]; then watched cargo test --quiet --locked $tests; else watched "$of_gpu"; fi
    if messages >&2; then fail "the validation layers report errors in ${tests:-the tests of the library}"; fi
done
step "all is well"
