#!/usr/bin/env bash
# Builds the C library as its users do, installs it into a folder, and tests it there: with gcc and clang, under
# AddressSanitizer and valgrind, through CMake and Meson, and beside Bullet.
#
#   tools/c.sh             # formatting, clippy, tests of the border, and all of that
#   tools/c.sh overhead    # instructions of a frame through C over those through Rust, at 100 and 100 000 boxes
#   tools/c.sh bench       # 10 000 moving boxes beside btDbvtBroadphase, into results/c.csv
#   tools/c.sh header      # writes bindings/c/include/sapwise.h
#
# Needs cargo-c, compilers, CMake, Meson and Bullet; on Debian it installs them if they are missing. Everything goes
# into target/c/.
set -euo pipefail
cd "$(dirname "$0")/.."
what=${1:-test}
root=$PWD
folder=${CARGO_TARGET_DIR:-$PWD/target}/c
manifest=bindings/c/Cargo.toml
examples=$root/bindings/c/examples
bullet=(-std=c++17 -isystem /usr/include/bullet "$examples/bullet.cpp" -lBulletDynamics -lBulletCollision -lLinearMath)
fail() { echo "c: $*" >&2; exit 1; }
export CARGO_INCREMENTAL=0 CARGO_TARGET_DIR=$folder/build
mkdir -p "$folder"

has_bullet() { [ -e /usr/include/bullet/btBulletDynamicsCommon.h ]; }
has_tools() { command -v clang && command -v cmake && command -v meson && command -v ninja && command -v pkg-config; }
{ has_tools && has_bullet; } >/dev/null 2>&1 || {
    apt-get update -q
    apt-get install -qy --no-install-recommends clang cmake libbullet-dev meson ninja-build pkg-config
}

# The last version that this compiler builds. It contains cargo, which takes minutes, once.
cargo_c() {
    command -v cargo-cinstall >/dev/null 2>&1 || {
        pkg-config --exists openssl || apt-get install -qy --no-install-recommends libssl-dev
        CARGO_TARGET_DIR=$root/target/tools CARGO_PROFILE_DEV_DEBUG=false \
            cargo install cargo-c --version '0.10.24+cargo-0.98.0' --locked --debug --quiet
    }
}

# A build and an installed library: release, or dev with what it knows of freed objects.
installed() {
    cargo_c
    (cd bindings/c && cargo cinstall --quiet --locked --profile "$1" --prefix "$folder/$1" --libdir "$folder/$1/lib")
}

# Compiles one program against an installed library.
compile() {
    local compiler=$1 profile=$2 out=$3
    shift 3
    "$compiler" -O1 -g -Wall -Wextra -Wpedantic -Werror "-I$folder/$profile/include" "$@" \
        "-L$folder/$profile/lib" -lsapwise "-Wl,-rpath,$folder/$profile/lib" -lm -o "$folder/$out"
}

case $what in
header)
    SAPWISE_WRITE_HEADER=1 cargo test --quiet --manifest-path $manifest --locked --test header
    ;;
test)
    cargo fmt --manifest-path $manifest --check
    cargo clippy --quiet --manifest-path $manifest --all-targets --locked -- -D warnings
    cargo test --quiet --manifest-path $manifest --locked
    installed release
    installed dev
    bytes=$(stat -L -c %s "$folder/release/lib/libsapwise.so")
    echo "c: the shared library has $bytes bytes"
    [ "$bytes" -le 2000000 ] || fail "it has more than 2 MB"
    sanitize=(-fsanitize=address,undefined -fno-sanitize-recover=all)
    export ASAN_OPTIONS=detect_stack_use_after_return=1 UBSAN_OPTIONS=print_stacktrace=1
    for pair in gcc:g++ clang:clang++; do
        c=${pair%:*} cpp=${pair#*:}
        compile "$c" dev pairs -std=c99 "${sanitize[@]}" "$examples/pairs.c"
        compile "$cpp" dev api -std=c++17 "${sanitize[@]}" bindings/c/tests/api.cpp
        compile "$cpp" dev api-codes -std=c++17 "${sanitize[@]}" -fno-exceptions -DSAPWISE_NO_EXCEPTIONS \
            bindings/c/tests/api.cpp
        compile "$cpp" release bullet "${sanitize[@]}" "${bullet[@]}"
        for program in pairs api api-codes bullet; do
            echo "c: $program by $c"
            "$folder/$program"
        done
    done
    rm -rf "$folder/cache"
    "$folder/api" "$folder/cache"
    # The builds of a user.
    for how in cmake meson; do
        rm -rf "$folder/$how"
        if [ $how = cmake ]; then
            cmake -G Ninja -S "$examples" -B "$folder/cmake" -DCMAKE_PREFIX_PATH="$folder/release" >/dev/null
        else
            PKG_CONFIG_PATH=$folder/release/lib/pkgconfig meson setup "$folder/meson" "$examples" >/dev/null
        fi
        ninja -C "$folder/$how" --quiet
        for program in pairs pairs-static bullet; do
            echo "c: $program by $how"
            LD_LIBRARY_PATH=$folder/release/lib "$folder/$how/$program"
        done
    done
    for program in pairs pairs-static; do
        echo "c: $program under valgrind"
        LD_LIBRARY_PATH=$folder/release/lib valgrind --quiet --leak-check=full \
            --show-leak-kinds=definite,indirect --errors-for-leak-kinds=definite,indirect \
            --error-exitcode=1 "$folder/meson/$program"
    done
    ;;
overhead)
    installed release
    # With the name of the function to count.
    CARGO_PROFILE_RELEASE_STRIP=false \
        cargo build --quiet --release --locked --manifest-path $manifest --example overhead
    compile gcc release overhead -std=c99 bindings/c/benches/overhead.c
    # Instructions of the eight frames.
    count() {
        valgrind --tool=callgrind "--callgrind-out-file=$folder/callgrind" --toggle-collect=measured_frame "$@" \
            >"$folder/pairs" 2>/dev/null
        sed -n 's/^\(totals\|summary\): //p' "$folder/callgrind" | head -1
    }
    for n in 100 100000; do
        through_c=$(count "$folder/overhead" $n)
        cp "$folder/pairs" "$folder/pairs-c"
        through_rust=$(count "$CARGO_TARGET_DIR/release/examples/overhead" $n)
        cmp "$folder/pairs" "$folder/pairs-c" || fail "the two find other pairs"
        echo "$n boxes: $((through_c / 8)) instructions a frame through C, $((through_rust / 8)) through Rust"
    done
    ;;
bench)
    installed release
    compile g++ release bullet -O2 "${bullet[@]}"
    "$folder/bullet" --bench >"$folder/bench.csv"
    machine="$(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -1) ($(nproc) cores)"
    known="$machine,$(date +%F),$(pkg-config --modversion bullet)"
    sed "1s/^/machine,date,bullet,/; 2,\$s/^/$known,/" "$folder/bench.csv" | tee results/c.csv
    ;;
*) fail "usage: tools/c.sh [test|overhead|bench|header]" ;;
esac
