"""Neighbours of particles within a radius, as molecular dynamics and fluids want them, against SciPy's tree.

    python bindings/python/examples/particles.py [PARTICLES]
"""

import sys
import time

import numpy as np
from scipy.spatial import cKDTree

import sapwise

RADIUS = 1.0
#: Neighbours of a particle on average.
NEIGHBOURS = 30


def near(points, pairs):
    """The pairs no further apart than the radius."""
    apart = points.take(pairs[:, 0], axis=0)
    apart -= points.take(pairs[:, 1], axis=0)
    return pairs.compress(np.einsum("ij,ij->i", apart, apart) <= RADIUS**2, axis=0)


def by_sapwise(points):
    # A point is a box without a size. Its neighbours in a cube, then those in the sphere.
    return near(points, sapwise.pairs(points, points, margin=RADIUS, ordered=False))


def by_scipy(points):
    return cKDTree(points).query_pairs(RADIUS, output_type="ndarray")


def in_order(pairs):
    pairs = np.sort(pairs, axis=1)
    return pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]


count = int(sys.argv[1]) if len(sys.argv) > 1 else 50_000
rng = np.random.default_rng(1)
edge = (count * 4 / 3 * np.pi * RADIUS**3 / NEIGHBOURS) ** (1 / 3)
points = rng.uniform(0, edge, (count, 3)).astype(np.float32)
times = {by_sapwise: [], by_scipy: []}
found = {}
for turn in range(8):
    points += rng.normal(0, 0.02, points.shape).astype(np.float32)
    for find in times:
        began = time.perf_counter()
        found[find] = find(points)
        # Drops the first turn, which is cold.
        times[find] += [time.perf_counter() - began] if turn else []
# On the sphere itself the last bit decides: SciPy computes with 64 bits.
ours, theirs = (in_order(found[find]) for find in times)
differ = len(set(map(tuple, ours.tolist())) ^ set(map(tuple, theirs.tolist())))
assert differ <= 1e-5 * len(theirs), differ
here, there = (1e3 * np.median(times[find]) for find in times)
print(f"particles: {count}, {len(ours)} pairs within {RADIUS}, n = {turn}")
print(f"sapwise.pairs with a margin {here:.1f} ms, scipy cKDTree.query_pairs {there:.1f} ms: {there / here:.1f}×")
