#!/usr/bin/env bash
# Builds the Python package, installs it into a fresh environment, and tests it there: first without pandas, then with it.
#
#   tools/python.sh            # formatting, clippy, wheel, tests
#   tools/python.sh wheel      # builds the wheel and tells where it is
#   tools/python.sh sdist      # builds the source distribution, and installs it
#   tools/python.sh gpu        # builds the wheel sapwise-gpu, with methods on GPUs, and tests it on software adapters
#   tools/python.sh aarch64    # builds the wheel for 64-bit ARM with zig, and uses it in QEMU
#   tools/python.sh bench      # times: overhead, other libraries, the import; into results/python.csv
#   tools/python.sh examples   # runs bindings/python/examples/ and writes their pictures to target/python/examples/
#   tools/python.sh index      # writes the index of docs/python.md from the docstrings
#
# Needs Python 3.10 or later with venv (Debian: python3-venv). Everything goes into target/python/; what cargo
# builds goes into target/bindings/, as for C and MPI. PYTHON names the interpreter.
set -euo pipefail
cd "$(dirname "$0")/.."
what=${1:-test}
root=$PWD
folder=${CARGO_TARGET_DIR:-$PWD/target}/python
python=${PYTHON:-python3}
fail() { echo "python: $*" >&2; exit 1; }
"$python" -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 10))' 2>/dev/null \
    || fail "$python must be Python 3.10 or later with venv: install python3-venv, or set PYTHON"
mkdir -p "$folder"
export PIP_DISABLE_PIP_VERSION_CHECK=1 CARGO_TARGET_DIR=${folder%/python}/bindings CARGO_INCREMENTAL=0
pip() { local environment=$1; shift; "$environment/bin/python" -m pip install --quiet "$@"; }

# maturin stays from run to run.
[ -x "$folder/tools/bin/maturin" ] || { "$python" -m venv "$folder/tools"; pip "$folder/tools" 'maturin>=1.9,<2'; }

wheel() {
    rm -rf "$folder/wheels"
    "$folder/tools/bin/maturin" build --quiet --release --locked --strip --manifest-path bindings/python/Cargo.toml --out "$folder/wheels" \
        --interpreter "$python" "$@"
    wheel=$(echo "$folder"/wheels/*.whl)
}

# A fresh environment with the wheel and these packages.
fresh() {
    rm -rf "$folder/fresh"
    "$python" -m venv "$folder/fresh"
    pip "$folder/fresh" "$wheel" "$@"
}

sizes() {
    local bytes installed
    bytes=$(stat -c %s "$wheel")
    installed=$(du -sb "$folder"/fresh/lib/python*/site-packages/sapwise | cut -f 1)
    echo "python: the wheel has $bytes bytes, installed $installed"
    [ "$bytes" -le 4000000 ] || fail "the wheel has more than 4 MB"
    [ "$installed" -le 10000000 ] || fail "installed it has more than 10 MB"
}

# These files of tests, or all. From outside of bindings/python/, so that what is tested is what was installed.
run() {
    local package=$root/bindings/python files=("${@:-.}")
    cd "$folder"
    fresh/bin/python -m pytest -c "$package/pyproject.toml" --rootdir "$package" -p no:cacheprovider "${files[@]/#/$package/tests/}"
}

case $what in
wheel)
    wheel
    echo "$wheel"
    ;;
test)
    cargo fmt --manifest-path bindings/python/Cargo.toml --check
    PYO3_PYTHON=$folder/tools/bin/python cargo clippy --quiet --manifest-path bindings/python/Cargo.toml --all-targets --locked -- -D warnings
    wheel
    fresh pytest scipy hypothesis rtree python-fcl
    sizes
    run test_reports.py test_package.py test_machine.py
    # mypy holds the stubs against the package.
    pip "$folder/fresh" pandas pandas-stubs mypy
    run
    ;;
gpu)
    PYO3_PYTHON=$folder/tools/bin/python cargo clippy --quiet --manifest-path bindings/python/Cargo.toml --features gpu --locked -- -D warnings
    wheel --features gpu
    # The same module under another name: only one of the two wheels is installed.
    pip "$folder/tools" wheel
    (
        cd "$folder/wheels"
        "$folder/tools/bin/wheel" unpack --dest . "$wheel" && rm "$wheel"
        mv sapwise-* sapwise_gpu && cd sapwise_gpu
        for info in *.dist-info; do mv "$info" "sapwise_gpu-${info#sapwise-}"; done
        sed -i 's/^Name: sapwise$/Name: sapwise-gpu/' ./*.dist-info/METADATA
        "$folder/tools/bin/wheel" pack --dest-dir .. .
    )
    wheel=$(echo "$folder"/wheels/*.whl)
    fresh pytest scipy hypothesis rtree python-fcl
    bytes=$(stat -c %s "$wheel")
    echo "python: the wheel with GPUs has $bytes bytes"
    [ "$bytes" -le 12000000 ] || fail "the wheel with GPUs has more than 12 MB"
    gpus=$("$root/tools/software-gpus.sh")
    eval "$gpus"
    cd "$folder"
    fresh/bin/python - <<'END'
import numpy as np, sapwise
low = np.random.default_rng(1).uniform(0, 20, (3000, 3)).astype(np.float32)
boxes = np.concatenate([low, low + 1], axis=1)
known = sapwise.pairs(boxes, algorithm="brute@cpu1")
for name in ["brute@gpu0", "sap@gpu0", "grid-sap@gpu0", "bvh@gpu1", "bvh@gpu0+1"]:
    assert len(known) > 1000 and np.array_equal(sapwise.pairs(boxes, algorithm=name), known)
    assert sapwise.last_decision().algorithm == name
with sapwise.Space(algorithm="grid-sap@gpu0", cache=False) as space:
    space.insert(boxes)
    space.update()
    assert len(space.pairs()) == len(known)
END
    run
    ;;
sdist)
    rm -rf "$folder/sdist"
    "$folder/tools/bin/maturin" sdist --manifest-path bindings/python/Cargo.toml --out "$folder/sdist"
    wheel=$(echo "$folder"/sdist/*.tar.gz)
    fresh
    cd "$folder"
    fresh/bin/python -c 'import numpy, sapwise; assert len(sapwise.pairs(numpy.zeros((3, 6)))) == 3'
    echo "$wheel"
    ;;
aarch64)
    target=aarch64-unknown-linux-gnu
    [ -d "$(rustc --print sysroot)/lib/rustlib/$target/lib" ] || rustup target add $target
    command -v qemu-aarch64 >/dev/null || { apt-get update -q; apt-get install -qy --no-install-recommends qemu-user; }
    pip "$folder/tools" ziglang
    rm -rf "$folder/arm"
    PATH=$folder/tools/bin:$PATH maturin build --quiet --release --locked --strip --manifest-path bindings/python/Cargo.toml \
        --target $target --zig --out "$folder/arm"
    # Debian's Python for that processor, in a folder of its own, with the wheels beside it.
    cd "$folder/arm"
    mkdir -p state/lists/partial cache/archives/partial root site
    touch status
    foreign() {
        apt-get -q -o Dir::State="$PWD/state" -o Dir::State::status="$PWD/status" -o Dir::Cache="$PWD/cache" \
            -o APT::Sandbox::User=root -o APT::Architecture=arm64 -o APT::Architectures=arm64 "$@"
    }
    foreign update
    minor=$(foreign show python3 | sed -n 's/^Version: 3\.\([0-9]*\).*/\1/p' | head -1)
    (cd cache && foreign download "python3.$minor-minimal" "libpython3.$minor-minimal" "libpython3.$minor-stdlib" libc6 libgcc-s1 \
        libexpat1 zlib1g libffi8 libstdc++6 liblzma5 libbz2-1.0)
    for package in cache/*.deb; do dpkg-deb -x "$package" root; done
    "$folder/tools/bin/python" -m pip download --quiet --no-deps --only-binary=:all: --python-version "3.$minor" \
        --platform manylinux2014_aarch64 --platform manylinux_2_27_aarch64 --platform manylinux_2_28_aarch64 --dest . numpy
    for wheel in *.whl; do "$python" -m zipfile -e "$wheel" site; done
    qemu-aarch64 -L root -E PYTHONPATH="$PWD/site" -E PYTHONHOME="$PWD/root/usr" "root/usr/bin/python3.$minor" - <<'END'
import pickle, platform
import numpy as np, sapwise
low = np.random.default_rng(1).uniform(0, 20, (3000, 3)).astype(np.float32)
boxes = np.concatenate([low, low + 1], axis=1)
known = [(i, j) for i in range(3000) for j in np.flatnonzero((np.abs(low[i + 1 :] - low[i]) < 1).all(axis=1)) + i + 1]
assert len(known) > 1000 and np.array_equal(sapwise.pairs(boxes), known)
with sapwise.Space(cache=False, measure=False) as space:
    handles = space.insert(boxes)
    space.update()
    assert len(pickle.loads(pickle.dumps(space)).pairs()) == len(known)
print("python:", platform.machine(), sapwise.last_decision())
END
    ls -l sapwise-*.whl
    ;;
bench)
    wheel
    fresh scipy rtree python-fcl trimesh
    sizes
    cargo build --quiet --release --locked --manifest-path bindings/python/Cargo.toml --example figures
    cd "$folder"
    fresh/bin/python "$root/bindings/python/benches/figures.py" "$CARGO_TARGET_DIR/release/examples/figures" >bench.csv
    machine="$(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -1) ($(nproc) cores)"
    sed "1s/^/machine,date,/; 2,\$s/^/$machine,$(date +%F),/" bench.csv | tee "$root/results/python.csv"
    ;;
examples)
    wheel
    fresh pandas matplotlib trimesh rtree scipy mujoco
    # For a mesh that it ships: nothing of it is imported, nor what it depends on.
    pip "$folder/fresh" --no-deps pyvista
    mkdir -p "$folder/examples"
    cd "$folder"
    fresh/bin/python "$root/bindings/python/examples/study.py" "$root/datasets" examples/study.png
    for example in clashes particles trimesh_scene mujoco_geoms; do fresh/bin/python "$root/bindings/python/examples/$example.py"; done
    ;;
index)
    wheel
    fresh
    "$folder/fresh/bin/python" tools/python_index.py docs/python.md
    ;;
*) fail "usage: tools/python.sh [test|wheel|gpu|sdist|aarch64|bench|examples|index]" ;;
esac
