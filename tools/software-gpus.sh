#!/usr/bin/env bash
# Gives a shell two different software GPUs, Mesa's lavapipe and SwiftShader:
#
#     eval "$(tools/software-gpus.sh)"
#
# Prints two variables on standard output, and its progress on standard error. Gets what is missing from Debian's
# packages: installs lavapipe and the Vulkan loader; SwiftShader is a file of chromium-common, which is downloaded and
# unpacked into a cache folder unless it is installed. Uses no network if nothing is missing.
#
# SWIFTSHADER=/path/to/libvk_swiftshader.so uses that file instead. Every Chromium and Chrome contains one.
set -euo pipefail
. "$(dirname "$0")/vulkan-driver.sh"

say() { echo "software-gpus: $*" >&2; }
fail() { say "$*"; exit 1; }

cache=${XDG_CACHE_HOME:-$HOME/.cache}/sapwise/software-gpus
work=
trap '[ -z "$work" ] || rm -rf "$work"' EXIT

has_loader() {
    # Debian's ldconfig is not in an ordinary user's PATH.
    PATH=$PATH:/sbin:/usr/sbin ldconfig -p | grep -F 'libvulkan.so.1 ' >/dev/null
}
# Prints lavapipe's file for the loader. In older releases of Mesa its name contains the architecture.
lavapipe() {
    find /usr/share/vulkan /usr/local/share/vulkan /etc/vulkan -path '*icd.d/lvp_icd*.json' 2>/dev/null | head -n 1
}
need_apt() {
    command -v apt-get >/dev/null && command -v dpkg >/dev/null && return
    fail "$1 is missing, and there is no apt-get here. Install Mesa's Vulkan drivers (lavapipe) and the Vulkan loader," \
        "set SWIFTSHADER to the libvk_swiftshader.so of a Chromium or Chrome, and run this again."
}
as_root() {
    if [ "$(id -u)" = 0 ]; then
        "$@"
    elif command -v sudo >/dev/null; then
        sudo "$@"
    else
        fail "this needs root, and there is no sudo here; run as root: $*"
    fi
}

if ! has_loader || [ -z "$(lavapipe)" ]; then
    need_apt "lavapipe or the Vulkan loader"
    say "installing lavapipe and the Vulkan loader"
    packages=(mesa-vulkan-drivers libvulkan1)
    {
        # The package lists of a fresh machine or container may be empty or old.
        as_root apt-get install -qy "${packages[@]}" \
            || { as_root apt-get update -q && as_root apt-get install -qy "${packages[@]}"; }
    } >&2
    if ! has_loader || [ -z "$(lavapipe)" ]; then
        fail "mesa-vulkan-drivers and libvulkan1 are installed, but lavapipe is not there"
    fi
fi

mkdir -p "$cache"
installed=/usr/lib/chromium/libvk_swiftshader.so
if [ -z "${SWIFTSHADER:-}" ] && [ -e "$installed" ]; then SWIFTSHADER=$installed; fi
swiftshader=${SWIFTSHADER:-$cache/libvk_swiftshader.so}
if [ ! -e "$swiftshader" ]; then
    [ -z "${SWIFTSHADER:-}" ] || fail "SWIFTSHADER is $swiftshader, which does not exist"
    need_apt SwiftShader
    say "downloading Debian's chromium-common into $cache, for libvk_swiftshader.so"
    work=$(mktemp -d "$cache/unpack.XXXXXX")
    (
        cd "$work"
        apt-get download -q chromium-common || { as_root apt-get update -q && apt-get download -q chromium-common; }
        dpkg -x chromium-common_*.deb .
    ) >&2
    file=$(find "$work" -name libvk_swiftshader.so -print -quit)
    [ -n "$file" ] || fail "this chromium-common has no libvk_swiftshader.so; set SWIFTSHADER to that of a Chrome"
    # In one step, in case another run of this script reads it.
    mv -f "$file" "$swiftshader"
fi
swiftshader=$(realpath "$swiftshader")

icd=$cache/swiftshader_icd.json
write_driver "$icd" "$swiftshader" 1.1.0

# Loaders before 1.3.207 know only the first name; later ones prefer the second.
for name in VK_ICD_FILENAMES VK_DRIVER_FILES; do
    printf 'export %s=%q\n' "$name" "$(lavapipe):$icd"
done
