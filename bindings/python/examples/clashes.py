"""Clash detection in a model of a building: services that meet structure or walls, against an R-tree.

    python bindings/python/examples/clashes.py [ELEMENTS]

The model is made here: storeys of slabs, columns, beams and walls, with ducts, pipes and trays of a random layout.
Elements of one discipline may touch, as walls stand on slabs: only pairs of two disciplines are clashes. What is
found are the candidates, which a geometry kernel then looks at.
"""

import sys
import time

import numpy as np
import rtree

import sapwise

STRUCTURE, WALLS, SERVICES = 1, 2, 4
#: What each discipline may clash with.
MAY_CLASH = {STRUCTURE: SERVICES, WALLS: SERVICES, SERVICES: STRUCTURE | WALLS}
#: Storeys are this high, in metres, columns this far apart.
HEIGHT, BAY = 4.0, 8.0


def model(elements, seed=1):
    """Boxes in metres, shape (n, 6), and the discipline of each."""
    rng = np.random.default_rng(seed)
    storeys = 24
    bays = max(2, round((elements / storeys / 40) ** 0.5))
    x, y, z = (of.ravel() for of in np.meshgrid(range(bays), range(bays), range(storeys), indexing="ij"))
    corner = np.column_stack([x * BAY, y * BAY, z * HEIGHT])
    made = []

    def add(discipline, low, size):
        low, size = np.broadcast_arrays(low, size)
        made.append((np.concatenate([low, low + size], axis=1), np.full(len(low), discipline)))

    add(STRUCTURE, corner + [0, 0, -0.3], [BAY, BAY, 0.3])
    add(STRUCTURE, corner + [-0.2, -0.2, 0], [0.4, 0.4, HEIGHT - 0.3])
    for along in np.eye(3)[:2]:
        add(STRUCTURE, corner + [-0.15, -0.15, HEIGHT - 0.8], 0.3 + along * (BAY - 0.3) + [0, 0, 0.2])
        add(WALLS, corner + along * 0.2, np.where(along, BAY - 0.4, 0.15) + [0, 0, HEIGHT - 0.75])
    # Services run along an axis under the ceiling, most of them in a zone that is kept free for them.
    rest = elements - sum(len(boxes) for boxes, _ in made)
    bay = corner[rng.integers(len(corner), size=rest)]
    length = rng.uniform(0.5, 2.2, rest)
    radius = rng.choice([0.015, 0.03, 0.06, 0.2], rest, p=[0.45, 0.3, 0.15, 0.1])
    size = np.repeat(2 * radius[:, None], 3, axis=1)
    size[np.arange(rest), rng.integers(2, size=rest)] = length
    below = np.where(rng.random(rest) < 0.6, rng.uniform(1.3, 1.9, rest), rng.uniform(0.3, 1.3, rest))
    place = np.column_stack([rng.uniform(0.5, 5, (rest, 2)), HEIGHT - below])
    add(SERVICES, bay + place, size)
    boxes, disciplines = (np.concatenate(of) for of in zip(*made))
    return boxes, disciplines


def by_sapwise(boxes, disciplines):
    masks = np.select([disciplines == key for key in MAY_CLASH], list(MAY_CLASH.values()))
    return sapwise.pairs(boxes, groups=disciplines, masks=masks)


def by_rtree(boxes, disciplines):
    """An R-tree of the building, asked with the services."""
    services = np.flatnonzero(disciplines == SERVICES)
    others = np.flatnonzero(disciplines != SERVICES)
    stored = (others, boxes[others, :3], boxes[others, 3:])
    tree = rtree.index.Index(stored, properties=rtree.index.Property(dimension=3))
    found, counts = tree.intersection_v(boxes[services, :3], boxes[services, 3:])
    pairs = np.sort(np.column_stack([np.repeat(services, counts.astype(int)), found]), axis=1)
    return pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]


boxes, disciplines = model(int(sys.argv[1]) if len(sys.argv) > 1 else 48_000)
times = {by_sapwise: [], by_rtree: []}
found = {}
for turn in range(8):
    for find in times:
        began = time.perf_counter()
        found[find] = find(boxes, disciplines)
        # Drops the first turn, which is cold.
        times[find] += [time.perf_counter() - began] if turn else []
assert np.array_equal(found[by_sapwise], found[by_rtree])
ours, theirs = (1e3 * np.median(times[find]) for find in times)
print(f"clashes: {len(boxes)} elements, {len(found[by_sapwise])} candidates of two disciplines, n = {turn}")
print(f"sapwise.pairs {ours:.2f} ms, rtree {theirs:.0f} ms, the same pairs: {theirs / ours:.0f}×")
