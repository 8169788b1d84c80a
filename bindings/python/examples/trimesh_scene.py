"""Triangles of a real mesh: pairs whose bounds overlap, candidates for self-intersections, against trimesh's own tree.

    python bindings/python/examples/trimesh_scene.py [MESH [SUBDIVISIONS]]

Without a mesh it takes the aeroplane that pyvista ships (`pip install --no-deps pyvista` is enough, nothing of it is
imported).
"""

import importlib.util
import sys
import time
from pathlib import Path

import numpy as np
import trimesh

import sapwise


def shipped():
    """A model that a package ships."""
    found = importlib.util.find_spec("pyvista")
    if found is None:
        sys.exit("give a mesh, or install one: pip install --no-deps pyvista")
    return Path(found.origin).parent / "examples" / "airplane.ply"


def overlap(bounds, pairs):
    """Which of the pairs overlap as 64-bit floats have it."""
    a, b = bounds[pairs[:, 0]], bounds[pairs[:, 1]]
    return pairs[((a[:, 0] <= b[:, 1]) & (b[:, 0] <= a[:, 1])).all(axis=1)]


def by_tree(mesh, bounds):
    """The same by the tree that trimesh makes of its triangles, which is of rtree."""
    tree = mesh.triangles_tree
    found = [(k, j) for k, box in enumerate(bounds.reshape(-1, 6)) for j in tree.intersection(box) if j > k]
    pairs = overlap(bounds, np.array(found, np.uint32).reshape(-1, 2))
    return pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]


def timed(of, *arguments):
    began = time.perf_counter()
    result = of(*arguments)
    return result, time.perf_counter() - began


path = Path(sys.argv[1]) if len(sys.argv) > 1 else shipped()
mesh = trimesh.load_mesh(path)
for _ in range(int(sys.argv[2]) if len(sys.argv) > 2 else 1):
    mesh = mesh.subdivide()
triangles = mesh.triangles
# Shape (n, 2, 3), 64-bit floats.
bounds = np.stack([triangles.min(axis=1), triangles.max(axis=1)], axis=1)
ours, seconds = timed(sapwise.pairs, bounds)
theirs, seconds_of_tree = timed(by_tree, mesh, bounds)
assert np.array_equal(ours, theirs), (len(ours), len(theirs))
# Neighbours touch by nature.
faces = mesh.faces[ours]
share = (faces[:, 0, :, None] == faces[:, 1, None, :]).any(axis=(1, 2))
apart = np.count_nonzero(~share)
algorithm = sapwise.last_decision().algorithm
print(f"{path.name}: {len(bounds)} triangles, {len(ours)} pairs of bounds overlap, {apart} of them share no vertex")
print(f"sapwise {1e3 * seconds:.1f} ms ({algorithm}), trimesh's tree {1e3 * seconds_of_tree:.0f} ms, the same pairs")
