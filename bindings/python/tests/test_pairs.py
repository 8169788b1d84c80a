"""`pairs` and `pairs_between` against the definition, SciPy, rtree and FCL."""

import numpy as np
import pytest
from conftest import cubes, mixed, naive
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

import sapwise

INF = np.float32(np.inf)


@pytest.mark.parametrize("count", [0, 1, 2, 3, 17, 100, 299, 300, 301, 1000, 3000])
@pytest.mark.parametrize("scene", [cubes, mixed])
def test_every_pair_once_and_in_order(count, scene):
    boxes = scene(count, seed=count)
    found = sapwise.pairs(boxes)
    assert found.dtype == np.uint32 and found.shape == (len(found), 2)
    assert found.flags.c_contiguous and found.flags.writeable
    assert np.array_equal(found, naive(boxes))
    if count >= 100:
        assert len(found) > count / 20


def test_any_order_holds_the_same_pairs():
    boxes = cubes(20_000, seed=3)
    ordered, any_order = sapwise.pairs(boxes), sapwise.pairs(boxes, ordered=False)
    assert len(ordered) > 1000
    assert np.array_equal(ordered, any_order[np.lexsort((any_order[:, 1], any_order[:, 0]))])


def test_scipy_finds_the_same_cubes():
    from scipy.spatial import cKDTree

    boxes = cubes(30_000, seed=5)
    centres = (boxes[:, :3] + boxes[:, 3:]).astype(np.float64) / 2
    # Cubes with edges of 1 overlap where their centres lie no further apart on any axis: exact, on the lattice of 1/64.
    known = cKDTree(centres).query_pairs(1.0, p=np.inf, output_type="ndarray")
    known = np.sort(known, axis=1)
    known = known[np.lexsort((known[:, 1], known[:, 0]))]
    assert np.array_equal(sapwise.pairs(boxes), known.astype(np.uint32))


def test_rtree_finds_the_same():
    rtree = pytest.importorskip("rtree")
    boxes = mixed(1500, seed=7)
    properties = rtree.index.Property(dimension=3)
    tree = rtree.index.Index(((k, tuple(map(float, b)), None) for k, b in enumerate(boxes)), properties=properties)
    known = sorted((k, int(j)) for k, b in enumerate(boxes) for j in tree.intersection(tuple(map(float, b))) if j > k)
    assert np.array_equal(sapwise.pairs(boxes), np.array(known, np.uint32))


def test_fcl_finds_the_same():
    fcl = pytest.importorskip("fcl")
    boxes = cubes(1000, seed=9)
    centres = (boxes[:, :3] + boxes[:, 3:]).astype(np.float64) / 2
    objects = [fcl.CollisionObject(fcl.Box(1.0, 1.0, 1.0), fcl.Transform(centre)) for centre in centres]
    # What the callback gets are other objects in Python: known by where they are.
    places = {tuple(centre): k for k, centre in enumerate(centres)}
    assert len(places) == 1000
    manager = fcl.DynamicAABBTreeCollisionManager()
    manager.registerObjects(objects)
    manager.setup()
    found = set()

    def callback(a, b, _):
        found.add(tuple(sorted(places[tuple(of.getTranslation())] for of in (a, b))))
        return False

    manager.collide(None, callback)
    assert np.array_equal(sapwise.pairs(boxes), np.array(sorted(found), np.uint32))


def test_boxes_that_touch_overlap_and_the_next_float_does_not():
    a = [0, 0, 0, 1, 1, 1]
    beyond = np.nextafter(np.float32(1), INF)
    boxes = np.array([a, [1, 1, 1, 2, 2, 2], [beyond, 0, 0, 2, 1, 1], [-1, -1, -1, -0.0, 0, 0]], np.float32)
    assert sapwise.pairs(boxes).tolist() == [[0, 1], [0, 3], [1, 2]]


def test_infinite_boxes_are_legal():
    everything = [-INF, -INF, -INF, INF, INF, INF]
    half = [0, -INF, -INF, INF, INF, INF]
    boxes = np.array([everything, [1, 1, 1, 2, 2, 2], half, [-5, 0, 0, -4, 1, 1], [INF] * 6], np.float32)
    assert np.array_equal(sapwise.pairs(boxes), naive(boxes))
    many = np.concatenate([cubes(500), boxes])
    assert np.array_equal(sapwise.pairs(many), naive(many))


def test_all_boxes_in_one_place():
    boxes = np.tile(np.array([[1, 2, 3, 4, 5, 6]], np.float32), (400, 1))
    assert len(sapwise.pairs(boxes)) == 400 * 399 // 2


def test_corners_apart_and_boxes_as_trimesh_has_them():
    boxes = mixed(500, seed=11)
    known = naive(boxes)
    assert np.array_equal(sapwise.pairs(boxes[:, :3], boxes[:, 3:]), known)
    assert np.array_equal(sapwise.pairs(boxes.reshape(-1, 2, 3)), known)
    assert np.array_equal(sapwise.pairs(boxes[:, :3].copy(), upper=boxes[:, 3:].astype(np.float64)), known)


@pytest.mark.parametrize("first, second", [(0, 5), (5, 0), (0, 0), (1, 1000), (1000, 1), (700, 700), (300, 2000)])
def test_between_two_lists(first, second):
    a, b = mixed(first, seed=1), mixed(second, seed=2)
    found = sapwise.pairs_between(a, b)
    assert found.dtype == np.uint32
    assert np.array_equal(found, naive(a, b))
    swapped = sapwise.pairs_between(b, a, ordered=False)[:, ::-1]
    assert np.array_equal(found, swapped[np.lexsort((swapped[:, 1], swapped[:, 0]))])


def test_between_a_list_and_itself_holds_each_box_with_itself():
    boxes = cubes(200)
    found = sapwise.pairs_between(boxes, boxes)
    assert np.array_equal(found, naive(boxes, boxes)) and [7, 7] in found.tolist()


def test_between_leaves_nothing_behind_for_the_next_call():
    boxes = cubes(500, seed=4)
    known = naive(boxes)
    assert np.array_equal(sapwise.pairs(boxes), known)
    sapwise.pairs_between(boxes[:100], boxes[100:])
    with pytest.raises(sapwise.TooManyPairsError):
        sapwise.pairs(boxes, limit=3)
    assert np.array_equal(sapwise.pairs(boxes), known)


def test_the_last_decision_tells_what_ran():
    sapwise.pairs(cubes(5000))
    decision = sapwise.last_decision()
    method, _, backend = decision.algorithm.partition("@")
    # Of work that is kept from frame to frame no single call has any use.
    assert method in {"brute", "sap", "grid-sap", "bvh"} and backend.startswith("cpu")
    assert decision.source in {"default", "predicted", "learned"} and decision.load["objects"] == 5000
    assert decision.algorithm in str(decision) and decision.reason in repr(decision)


coordinates = st.floats(-4, 4, width=16) | st.sampled_from([-np.inf, np.inf, 0.0, -0.0, 1.0])


@settings(max_examples=200, deadline=None)
@given(arrays.arrays(np.float32, st.tuples(st.integers(0, 30), st.just(2), st.just(3)), elements=coordinates))
def test_any_boxes(corners):
    boxes = np.concatenate([corners.min(axis=1), corners.max(axis=1)], axis=1)
    assert np.array_equal(sapwise.pairs(boxes), naive(boxes))
    assert np.array_equal(sapwise.pairs_between(boxes[:9], boxes[9:]), naive(boxes[:9], boxes[9:]))
