#!/usr/bin/env bash
# Builds the C library and tests it: with gcc and clang, under AddressSanitizer and valgrind, and beside Bullet.
#
#   tools/c.sh             # formatting, clippy, tests of the border, and all of that; needs no cargo-c
#   tools/c.sh install     # as its users: builds it in CMake, installs it by CMake and by cargo-c, and builds with it
#   tools/c.sh overhead    # instructions of a frame through C over those through Rust, at 100 and 100 000 boxes
#   tools/c.sh bench       # 10 000 moving boxes beside btDbvtBroadphase, into results/c.csv
#   tools/c.sh header      # writes bindings/c/include/sapwise.h
#
# Needs compilers, valgrind and Bullet; `install` also cargo-c, CMake and Meson. On Debian it installs what is missing.
# Everything goes into target/c/; what cargo builds goes into target/bindings/, as for Python and MPI.
set -euo pipefail
cd "$(dirname "$0")/.."
what=${1:-test}
root=$PWD
folder=${CARGO_TARGET_DIR:-$PWD/target}/c
manifest=bindings/c/Cargo.toml
examples=$root/bindings/c/examples
bullet=(-std=c++17 -isystem /usr/include/bullet "$examples/bullet.cpp" -lBulletDynamics -lBulletCollision -lLinearMath)
fail() { echo "c: $*" >&2; exit 1; }
export CARGO_INCREMENTAL=0 CARGO_TARGET_DIR=${folder%/c}/bindings
mkdir -p "$folder"

# Installs Debian's packages if a command or Bullet is missing.
need() {
    local packages=$1
    shift
    { [ -e /usr/include/bullet/btBulletDynamicsCommon.h ] && type "$@"; } >/dev/null 2>&1 || install "$packages"
}

install() {
    apt-get update -q
    # shellcheck disable=SC2086 # several packages
    apt-get install -qy --no-install-recommends libbullet-dev $1
}

# Builds the shared library by cargo alone. dev also knows of freed objects.
built() {
    local profile=$1 of=$1
    [ "$profile" != dev ] || of=debug
    cargo rustc --quiet --locked --manifest-path $manifest --profile "$profile" --lib --crate-type cdylib
    mkdir -p "$folder/$profile/lib"
    ln -sfn "$root/bindings/c/include" "$folder/$profile/include"
    ln -sf "$CARGO_TARGET_DIR/$of/libsapwise_capi.so" "$folder/$profile/lib/libsapwise.so"
}

# Builds and installs the library as its users do.
installed() {
    # The last version that this compiler builds. It contains cargo, which takes minutes, once.
    command -v cargo-cinstall >/dev/null 2>&1 || {
        CARGO_TARGET_DIR=$root/target/tools CARGO_PROFILE_DEV_DEBUG=false \
            cargo install cargo-c --version '0.10.24+cargo-0.98.0' --locked --debug --quiet
    }
    (cd bindings/c && cargo cinstall --locked --release --prefix "$prefix" --libdir "$prefix/lib")
}

# Compiles one program against a library.
compile() {
    local compiler=$1 profile=$2 out=$3
    shift 3
    "$compiler" -O1 -g -Wall -Wextra -Wpedantic -Werror "-I$folder/$profile/include" "$@" \
        "-L$folder/$profile/lib" -lsapwise "-Wl,-rpath,$folder/$profile/lib" -lm -o "$folder/$out"
}

# Fails if a program leaks or reads what it must not.
checked() {
    valgrind --quiet --leak-check=full --show-leak-kinds=definite,indirect \
        --errors-for-leak-kinds=definite,indirect --error-exitcode=1 "$@"
}

case $what in
header)
    SAPWISE_WRITE_HEADER=1 cargo test --quiet --manifest-path $manifest --locked --test header
    ;;
test)
    need "clang valgrind" clang valgrind
    # Debian packs clang's sanitizers apart, and names their archive by the architecture.
    [ -e "$(clang -print-file-name="libclang_rt.asan-$(uname -m).a")" ] || install libclang-rt-dev
    cargo fmt --manifest-path $manifest --check
    cargo clippy --quiet --manifest-path $manifest --all-targets --locked -- -D warnings
    cargo test --quiet --manifest-path $manifest --locked
    built dev
    sanitize=(-fsanitize=address,undefined -fno-sanitize-recover=all)
    export ASAN_OPTIONS=detect_stack_use_after_return=1 UBSAN_OPTIONS=print_stacktrace=1
    for pair in gcc:g++ clang:clang++; do
        c=${pair%:*} cpp=${pair#*:}
        compile "$c" dev pairs -std=c99 "${sanitize[@]}" "$examples/pairs.c"
        compile "$cpp" dev entities -std=c++17 "${sanitize[@]}" "$examples/entities.cpp"
        compile "$cpp" dev api -std=c++17 "${sanitize[@]}" bindings/c/tests/api.cpp
        compile "$cpp" dev api-codes -std=c++17 "${sanitize[@]}" -fno-exceptions -DSAPWISE_NO_EXCEPTIONS \
            bindings/c/tests/api.cpp
        compile "$cpp" dev bullet "${sanitize[@]}" "${bullet[@]}"
        for program in pairs entities api api-codes "bullet 100"; do
            echo "c: $program by $c"
            # shellcheck disable=SC2086 # a program and its argument
            "$folder/"$program
        done
    done
    rm -rf "$folder/cache"
    "$folder/api" "$folder/cache"
    echo "c: pairs under valgrind"
    compile gcc dev pairs -std=c99 "$examples/pairs.c"
    checked "$folder/pairs"
    ;;
install)
    need "cmake libssl-dev meson ninja-build pkg-config valgrind" cmake meson ninja pkg-config valgrind
    rm -rf "$folder/added" "$folder/found"
    mkdir -p "$folder/added"
    cat >"$folder/added/CMakeLists.txt" <<END
cmake_minimum_required(VERSION 3.16)
project(added LANGUAGES C CXX)
add_subdirectory("$root/bindings/c" "$folder/library")
add_subdirectory("$examples" examples)
END
    cmake -G Ninja -S "$folder/added" -B "$folder/added/build" >/dev/null
    ninja -C "$folder/added/build" --quiet
    cmake --install "$folder/added/build" --prefix "$folder/by-cmake" >/dev/null
    cmake -G Ninja -S "$examples" -B "$folder/found" -DCMAKE_PREFIX_PATH="$folder/by-cmake" >/dev/null
    ninja -C "$folder/found" --quiet
    for program in {added/build/examples,found}/{pairs,pairs-static,entities}; do
        echo "c: $program"
        "$folder/$program"
    done
    prefix=$folder/installed
    installed
    bytes=$(stat -L -c %s "$prefix/lib/libsapwise.so")
    echo "c: the shared library has $bytes bytes"
    [ "$bytes" -le 2150000 ] || fail "it has more than 2.15 MB"
    for how in cmake meson; do
        rm -rf "${folder:?}/$how"
        if [ $how = cmake ]; then
            cmake -G Ninja -S "$examples" -B "$folder/cmake" -DCMAKE_PREFIX_PATH="$prefix" >/dev/null
        else
            PKG_CONFIG_PATH=$prefix/lib/pkgconfig meson setup "$folder/meson" "$examples" >/dev/null
        fi
        ninja -C "$folder/$how" --quiet
        for program in pairs pairs-static entities bullet; do
            echo "c: $program by $how"
            LD_LIBRARY_PATH=$prefix/lib "$folder/$how/$program"
        done
    done
    for program in pairs pairs-static; do
        echo "c: $program under valgrind"
        LD_LIBRARY_PATH=$prefix/lib checked "$folder/meson/$program"
    done
    ;;
overhead)
    # With the name of the function to count.
    export CARGO_PROFILE_RELEASE_STRIP=false
    built release
    cargo build --quiet --release --locked --manifest-path $manifest --example overhead
    compile gcc release overhead -std=c99 bindings/c/benches/overhead.c
    # Instructions of the eight frames, without the linker's, which looks functions up when they are first called.
    count() {
        LD_BIND_NOW=1 valgrind --tool=callgrind "--callgrind-out-file=$folder/callgrind" \
            --toggle-collect=measured_frame "$@" >"$folder/pairs" 2>/dev/null
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
    need pkg-config pkg-config
    built release
    compile g++ release bullet -O2 "${bullet[@]}"
    "$folder/bullet" --bench >"$folder/bench.csv"
    machine="$(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -1) ($(nproc) cores)"
    known="$machine,$(date +%F),$(pkg-config --modversion bullet)"
    sed "1s/^/machine,date,bullet,/; 2,\$s/^/$known,/" "$folder/bench.csv" | tee results/c.csv
    ;;
*) fail "usage: tools/c.sh [test|install|overhead|bench|header]" ;;
esac
