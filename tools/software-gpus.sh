#!/usr/bin/env bash
# Gives a shell two different software GPUs, Mesa's lavapipe and SwiftShader, side by side:
#
#     eval "$(tools/software-gpus.sh)"
#
# Prints the two variables for it and nothing else; whatever it does is told on standard error. What is missing comes from
# Debian's packages: lavapipe and the Vulkan loader are installed; SwiftShader is one file of the package chromium-common,
# which, where it is not installed, is downloaded and unpacked into a cache folder. Where all is there, nothing is asked of
# the network.
#
# SWIFTSHADER=/path/to/libvk_swiftshader.so takes that file instead. Every Chromium and Chrome brings one along.
set -euo pipefail
. "$(dirname "$0")/vulkan-driver.sh"

say() { echo "software-gpus: $*" >&2; }
fail() { say "$*"; exit 1; }

cache=${XDG_CACHE_HOME:-$HOME/.cache}/sapwise/software-gpus
work=
trap '[ -z "$work" ] || rm -rf "$work"' EXIT

has_loader() {
    # Debian's ldconfig is in no ordinary user's PATH.
    PATH=$PATH:/sbin:/usr/sbin ldconfig -p | grep -F 'libvulkan.so.1 ' >/dev/null
}
# The file that tells the loader where lavapipe is. Its name holds the architecture in older releases of Mesa.
lavapipe() {
    local file
    for file in /usr/share/vulkan/icd.d/lvp_icd*.json /usr/local/share/vulkan/icd.d/lvp_icd*.json /etc/vulkan/icd.d/lvp_icd*.json; do
        if [ -e "$file" ]; then
            echo "$file"
            return
        fi
    done
}
need_apt() {
    command -v apt-get >/dev/null && command -v dpkg >/dev/null && return
    fail "$1 is missing, and there is no apt-get here to get it with. Install Mesa's Vulkan drivers (lavapipe) and the Vulkan" \
        "loader with your system's packages, set SWIFTSHADER to the libvk_swiftshader.so of a Chromium or Chrome, and run this again."
}
as_root() {
    if [ "$(id -u)" = 0 ]; then
        "$@"
    elif command -v sudo >/dev/null; then
        sudo "$@"
    else
        fail "this needs root, and there is no sudo here. Let root run: $*"
    fi
}

if ! has_loader || [ -z "$(lavapipe)" ]; then
    need_apt "lavapipe or the Vulkan loader"
    say "installing lavapipe and the Vulkan loader"
    packages=(mesa-vulkan-drivers libvulkan1)
    # The lists of a fresh machine or container may be empty or too old.
    { as_root apt-get install -qy "${packages[@]}" || { as_root apt-get update -q && as_root apt-get install -qy "${packages[@]}"; }; } >&2
    if ! has_loader || [ -z "$(lavapipe)" ]; then
        fail "mesa-vulkan-drivers and libvulkan1 are installed, and lavapipe is still not there"
    fi
fi

mkdir -p "$cache"
installed=/usr/lib/chromium/libvk_swiftshader.so
if [ -z "${SWIFTSHADER:-}" ] && [ -e "$installed" ]; then SWIFTSHADER=$installed; fi
swiftshader=${SWIFTSHADER:-$cache/libvk_swiftshader.so}
if [ ! -e "$swiftshader" ]; then
    [ -z "${SWIFTSHADER:-}" ] || fail "there is no $swiftshader; SWIFTSHADER names it"
    need_apt SwiftShader
    say "downloading Debian's chromium-common into $cache, for libvk_swiftshader.so"
    work=$(mktemp -d "$cache/unpack.XXXXXX")
    (
        cd "$work"
        apt-get download -q chromium-common || { as_root apt-get update -q && apt-get download -q chromium-common; }
        dpkg -x chromium-common_*.deb .
    ) >&2
    file=$(find "$work" -name libvk_swiftshader.so -print -quit)
    [ -n "$file" ] || fail "this release's chromium-common holds no libvk_swiftshader.so; set SWIFTSHADER to one of a Chromium or Chrome"
    # In one step, so that two of these at once do not see half a file.
    mv -f "$file" "$swiftshader"
fi
swiftshader=$(realpath "$swiftshader")

icd=$cache/swiftshader_icd.json
write_driver "$icd" "$swiftshader" 1.1.0

# The loaders before 1.3.207 know the first name only, later ones prefer the second.
for name in VK_ICD_FILENAMES VK_DRIVER_FILES; do
    printf 'export %s=%q\n' "$name" "$(lavapipe):$icd"
done
