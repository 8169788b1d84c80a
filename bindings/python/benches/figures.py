"""Times of the Python package in nanoseconds, interleaved in one run, as CSV: `tools/python.sh bench`.

Overhead: wall clock of `sapwise.pairs`, and of a `Space` in which all boxes move, with the array of its pairs, less
that of the library's own calls on the same boxes, in a process of Rust beside this one; the two take turns.

Other libraries: the pairs of boxes that are there as an array of NumPy. What each is timed with: making its structure
and asking for all pairs. Of FCL the objects are there already, with the Python callback that counts the pairs: what is
timed is `update` and `collide`. SciPy's tree takes the centres, with the largest edge as the distance on each axis, and
drops what does not overlap.
"""

import itertools
import os
import subprocess
import sys
import tempfile
import time
import warnings
from pathlib import Path

import fcl
import numpy as np
import rtree
import trimesh
from scipy.spatial import cKDTree

import sapwise

RUST = sys.argv[1]
#: No call of the others can take work from the frame before.
FOLLOWING = "sapwise.BroadPhase.find of frames that follow each other"
# What this machine has kept is not part of it: thresholds decide.
os.environ["XDG_CACHE_HOME"] = tempfile.mkdtemp(prefix="sapwise-figures-")
FOLDER = Path(tempfile.mkdtemp(prefix="sapwise-figures-"))


def scene(objects, frames=1, seed=1):
    """Frames of `uniform` from the second on, shape (frames, n, 6), and the file they are in."""
    path = FOLDER / f"{objects}-{frames}.f32"
    subprocess.run([RUST, "scene", "uniform", str(objects), str(seed), str(frames), str(path)], check=True)
    return np.fromfile(path, np.float32).reshape(frames, objects, 6), path


def row(what, objects, pairs, contestant, samples_ns):
    low, median, high = np.quantile(np.asarray(samples_ns, float), [0.25, 0.5, 0.75])
    print(f"{what},{objects},{pairs},{contestant},{len(samples_ns)},{low:.0f},{median:.0f},{high:.0f}", flush=True)


def overhead(objects, visits, frames):
    (boxes,), path = scene(objects)
    # From scratch in each frame.
    algorithm = "bvh@cpu1"
    call = lambda: sapwise.pairs(boxes, algorithm=algorithm)
    compare("pairs", call, [RUST, "serve", str(path), algorithm], objects, visits, frames)


def overhead_of_space(objects, visits, frames):
    turns, path = scene(objects, 2)
    space = sapwise.Space(algorithm="pair-cache@cpu1")
    handles = space.insert(turns[0])
    order = itertools.cycle([turns[1], turns[0]])

    def frame():
        space.set(handles, next(order))
        space.update()
        return space.pairs()

    compare("Space", frame, [RUST, "space", str(path), "pair-cache@cpu1"], objects, visits, frames)


def compare(name, call, command, objects, visits, frames):
    serve = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    python, rust = [], []
    for visit in range(visits + 1):
        serve.stdin.write(f"{frames + 1}\n")
        serve.stdin.flush()
        *times, count = map(int, serve.stdout.readline().split())
        here = []
        for _ in range(frames + 1):
            began = time.perf_counter_ns()
            answer = call()
            here.append(time.perf_counter_ns() - began)
            found = len(answer)
            del answer
        assert found == count
        # Drops the first frame of a visit and the first visit, which are cold.
        if visit > 0:
            python.append(np.median(here[1:]))
            rust.append(np.median(times[1:]))
    serve.stdin.close()
    serve.wait()
    more = np.array(python) - np.array(rust)
    for contestant, samples in (("Rust", rust), ("Python", python), ("Python less Rust", more)):
        row(f"{name} by {command[-1]}", objects, count, contestant, samples)


def contestants(frames):
    boxes = frames[0]
    wide = boxes.astype(np.float64)
    low, high = np.ascontiguousarray(wide[:, :3]), np.ascontiguousarray(wide[:, 3:])
    centres, edges = (low + high) / 2, high - low
    objects = [fcl.CollisionObject(fcl.Box(*edge), fcl.Transform(centre)) for edge, centre in zip(edges, centres)]
    manager = fcl.DynamicAABBTreeCollisionManager()
    manager.registerObjects(objects)
    manager.setup()
    broad_phase = sapwise.BroadPhase(cache=False, measure=False)
    following = iter(frames)
    # In another order each time: no call has a use for what was kept of the previous one.
    order = np.random.default_rng(2)
    shuffled = iter([order.permutation(boxes) for _ in frames])
    shuffled_wide = iter([order.permutation(wide) for _ in frames])

    def by_fcl():
        count = [0]

        def callback(a, b, counts):
            counts[0] += 1
            return False

        manager.update()
        manager.collide(count, callback)
        return count[0]

    def by_rtree():
        tree = rtree.index.Index((np.arange(len(wide)), low, high), properties=rtree.index.Property(dimension=3))
        found, counts = tree.intersection_v(low, high)
        return int((found > np.repeat(np.arange(len(wide)), counts.astype(np.int64))).sum())

    def by_scipy():
        pairs = cKDTree(centres).query_pairs(edges.max(), p=np.inf, output_type="ndarray")
        a, b = pairs[:, 0], pairs[:, 1]
        return int(((low[a] <= high[b]) & (low[b] <= high[a])).all(axis=1).sum())

    def by_trimesh():
        tree = trimesh.util.bounds_tree(wide)
        return sum(j > k for k, box in enumerate(wide) for j in tree.intersection(box))

    return {
        "sapwise.pairs": lambda: len(sapwise.pairs(next(shuffled))),
        "sapwise.pairs of float64": lambda: len(sapwise.pairs(next(shuffled_wide))),
        FOLLOWING: lambda: len(broad_phase.find(next(following))),
        "python-fcl DynamicAABBTree": by_fcl,
        "rtree intersection_v": by_rtree,
        "scipy cKDTree.query_pairs": by_scipy,
        "trimesh bounds_tree": by_trimesh,
    }


def others(objects, rounds):
    frames, _ = scene(objects, rounds + 1)
    names = contestants(frames)
    times = {name: [] for name in names}
    counts = {}
    order = np.random.default_rng(1)
    for a_round in range(rounds + 1):
        for name in order.permutation(list(names)):
            began = time.perf_counter_ns()
            counts[name] = names[name]()
            # Drops the first round, which is cold.
            if a_round > 0:
                times[name].append(time.perf_counter_ns() - began)
    assert len({count for name, count in counts.items() if name != FOLLOWING}) == 1, counts
    for name in names:
        row("all pairs", objects, counts[name], name, times[name])


def imports():
    for first, name in (("numpy, time", "after numpy"), ("time", "with numpy")):
        script = f"import {first}; began = time.perf_counter_ns(); import sapwise; print(time.perf_counter_ns() - began)"
        command = [sys.executable, "-c", script]
        run = lambda: int(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
        row(f"import {name}", 0, 0, "sapwise", [run() for _ in range(21)][1:])


warnings.simplefilter("ignore", sapwise.ConversionWarning)
print("what,boxes,pairs,contestant,samples,low_ns,median_ns,high_ns")
imports()
for measured in (overhead, overhead_of_space):
    measured(1000, 200, 50)
    measured(1_000_000, 12, 3)
others(10_000, 15)
others(100_000, 3)
