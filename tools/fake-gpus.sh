#!/usr/bin/env bash
# Gives a shell cards of AMD's that are not there: Mesa's driver over a kernel interface that says what a card is and executes nothing.
#
#     eval "$(tools/fake-gpus.sh)"
#     AMDGPU_GPU_ID=navi21 LD_PRELOAD=$SAPWISE_FAKE_GPU_SHIM VK_DRIVER_FILES=$SAPWISE_FAKE_GPU_ICD \
#         VK_ICD_FILENAMES=$SAPWISE_FAKE_GPU_ICD sapwise probe --hardware-only
#
# The driver reports the true parameters of the card, takes every submission and says that it is done. Good for whatever reads parameters, and
# for what becomes of a device that hangs. The cards: polaris10, vega10, navi21, navi31 and more.
#
# Prints the two variables and nothing else; whatever it does is told on standard error. The driver and the shim are two packages of
# Debian's backports, of Mesa 25.0, downloaded and unpacked into a cache folder: nothing is installed, and root is not needed. Where they are there
# already, nothing is asked of the network.
set -euo pipefail
. "$(dirname "$0")/vulkan-driver.sh"

say() { echo "fake-gpus: $*" >&2; }
fail() { say "$*"; exit 1; }

cache=${XDG_CACHE_HOME:-$HOME/.cache}/sapwise/fake-gpus
packages=(mesa-drm-shim mesa-vulkan-drivers)
suite=bookworm-backports
work=
trap '[ -z "$work" ] || rm -rf "$work"' EXIT

find_one() { find "$cache/mesa" -name "$1" -print -quit 2>/dev/null; }

if [ -z "$(find_one libamdgpu_noop_drm_shim.so)" ] || [ -z "$(find_one libvulkan_radeon.so)" ]; then
    [ "$(uname -sm)" = "Linux x86_64" ] || fail "the shim is known to work on Linux on x86-64 only"
    command -v apt-get >/dev/null && command -v dpkg >/dev/null || fail "the packages ${packages[*]} come from Debian, and there is no apt-get here"
    # The one that this machine has its packages from.
    mirror=${DEBIAN_MIRROR:-$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' | grep -m 1 '/debian/*$' || true)}
    [ -n "$mirror" ] || fail "apt-get knows no mirror of Debian's here: name one in DEBIAN_MIRROR"
    say "downloading ${packages[*]} of $suite into $cache"
    mkdir -p "$cache"
    work=$(mktemp -d "$cache/unpack.XXXXXX")
    # Lists of its own: those of the machine stay as they are. apt's own user can't write here, and need not.
    mkdir -p "$work/lists/partial" "$work/archives/partial" "$work/mesa"
    echo "deb [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] $mirror $suite main" >"$work/sources.list"
    own=(-o "Dir::Etc::sourcelist=$work/sources.list" -o Dir::Etc::sourceparts=- -o "Dir::State::lists=$work/lists"
        -o "Dir::Cache=$work" -o "Dir::Cache::archives=$work/archives" -o APT::Sandbox::User=)
    (
        cd "$work"
        apt-get "${own[@]}" update -q
        apt-get "${own[@]}" download -q "${packages[@]}"
        for package in *.deb; do
            dpkg -x "$package" mesa
        done
    ) >&2 || fail "$mirror has no ${packages[*]} in $suite; DEBIAN_MIRROR names another mirror or an archive of Debian's"
    # In one step, so that two of these at once do not see half of it.
    mv -T "$work/mesa" "$cache/mesa" 2>/dev/null || [ -d "$cache/mesa" ]
fi
shim=$(find_one libamdgpu_noop_drm_shim.so)
driver=$(find_one libvulkan_radeon.so)
[ -n "$shim" ] && [ -n "$driver" ] || fail "the packages hold no libamdgpu_noop_drm_shim.so or no libvulkan_radeon.so; remove $cache and try again"
missing=$(ldd "$driver" | sed -n 's/^\s*\(\S*\) => not found$/\1/p' | paste -sd ' ')
[ -z "$missing" ] || fail "the driver needs libraries that are not here: $missing (Debian's mesa-vulkan-drivers and libvulkan1 bring them)"

icd=$cache/radeon_icd.json
write_driver "$icd" "$driver" 1.4.305

printf 'export SAPWISE_FAKE_GPU_SHIM=%q\nexport SAPWISE_FAKE_GPU_ICD=%q\n' "$shim" "$icd"
