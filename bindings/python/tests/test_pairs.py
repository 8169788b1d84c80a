"""`pairs` and `pairs_between` against the definition, SciPy, rtree and FCL."""

import numpy as np
import pytest
from conftest import allowed, cubes, mixed, naive
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
    assert method in {"brute", "grid-sap", "pair-cache"} and backend.startswith("cpu")
    assert decision.source in {"default", "predicted", "learned"} and decision.load["objects"] == 5000
    assert decision.algorithm in str(decision) and decision.reason in repr(decision)


def keywords(count, seed):
    rng = np.random.default_rng(seed)
    bits = {"groups": rng.integers(0, 8, count), "masks": rng.integers(0, 8, count), "owner": rng.integers(0, 9, count)}
    return {**bits, "fixed": rng.random(count) < 0.5}


@pytest.mark.parametrize("more", [{}, {"algorithm": "brute@cpu1"}, {"algorithm": "bvh@cpu1"}, {"worlds": None}])
def test_filters(more):
    boxes, given = mixed(900, seed=13), keywords(900, 1)
    world = np.random.default_rng(3).integers(0, 3, 900)
    for worlds in (world, np.sort(world)) if "worlds" in more else (np.zeros(900, int),):
        more = {**more, "worlds": worlds} if "worlds" in more else more
        may = allowed(**given) & (worlds[:, None] == worlds)
        known = naive(boxes)
        known = known[may[known[:, 0], known[:, 1]]]
        assert np.array_equal(sapwise.pairs(boxes, **given, **more), known) and len(known) > 20
        unordered = sapwise.pairs(boxes, **given, **more, ordered=False)
        assert np.array_equal(unordered[np.lexsort((unordered[:, 1], unordered[:, 0]))], known)
        # Nothing of it is left for the next call.
        assert np.array_equal(sapwise.pairs(boxes), naive(boxes))
        if more:
            del given["owner"]
        may = allowed(**{"owner": np.zeros(900, int), **given}) & (worlds[:, None] == worlds)
        known = naive(boxes[:300], boxes[300:])
        known = known[may[known[:, 0], known[:, 1] + 300]]
        two = {key: (of[:300], of[300:]) for key, of in {**given, **more}.items() if key != "algorithm"}
        chosen = {key: of for key, of in more.items() if key == "algorithm"}
        assert np.array_equal(sapwise.pairs_between(boxes[:300], boxes[300:], **two, **chosen), known)
        given["owner"] = keywords(900, 1)["owner"]


def test_one_value_for_all_and_none_for_the_default():
    a, b = cubes(200, seed=1), cubes(300, seed=2)
    groups = np.arange(300) % 4
    known = naive(a, b)
    only = known[groups[known[:, 1]] & 2 != 0]
    assert np.array_equal(sapwise.pairs_between(a, b, masks=(2, None), groups=(None, groups)), only) and len(only) > 20
    assert len(sapwise.pairs_between(a, b, fixed=(True, True))) == len(sapwise.pairs(a, owner=7)) == 0
    assert np.array_equal(sapwise.pairs(a, fixed=False, owner=0, groups=1), naive(a))


def test_a_margin_finds_neighbours():
    boxes = cubes(700, seed=3)
    grown = boxes + np.float32([0, 0, 0, 0.25, 0.25, 0.25])
    assert np.array_equal(sapwise.pairs(boxes, margin=0.25), naive(grown)) and len(naive(grown)) > len(naive(boxes))
    assert np.array_equal(sapwise.pairs_between(boxes[:99], boxes[99:], margin=0.25), naive(grown[:99], grown[99:]))
    inverted = boxes.copy()
    inverted[5, 0] = inverted[5, 3] + 0.125
    with pytest.raises(sapwise.InvalidBoxError, match="box 5 is inverted"):
        sapwise.pairs(inverted, margin=0.25)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_margin_is_not_rounded(dtype):
    # A gap of 2. The sum of 16777216 and 1.5 is no 32-bit float: the next ones are 16777216 and 16777218.
    a, b = [0, 0, 0, 16777216, 1, 1], [16777218, 0, 0, 16777220, 1, 1]
    for boxes in (np.array([a, b], dtype), np.array([b, a], dtype)):
        for margin, pairs in [(1.5, []), (1.9999, []), (2.0, [[0, 1]]), (2.5, [[0, 1]])]:
            assert sapwise.pairs(boxes, margin=margin, limit=len(pairs)).tolist() == pairs
            assert sapwise.pairs(boxes, margin=margin, worlds=[0, 0]).tolist() == pairs
            assert len(sapwise.pairs_between(boxes[:1], boxes[1:], margin=margin)) == len(pairs)
            assert len(sapwise.pairs_between(boxes[:1], boxes[1:].astype(np.float64), margin=margin)) == len(pairs)


@settings(max_examples=200, deadline=None)
@given(
    # Where 32-bit floats are 2 apart.
    arrays.arrays(np.float32, (12, 2, 3), elements=st.integers(2**23, 2**23 + 5).map(lambda half: 2.0 * half)),
    st.floats(0, 10) | st.integers(0, 20).map(lambda halves: halves / 2),
    st.booleans(),
)
def test_any_margin(corners, margin, wide):
    boxes = np.concatenate([corners.min(axis=1), corners.max(axis=1)], axis=1).astype(float)
    if wide:
        boxes[:, 3:] += 0.25
    low, high = boxes[:, None, :3], boxes[None, :, 3:] + margin
    near = (low <= high).all(axis=2) & (low <= high).all(axis=2).T
    known = np.argwhere(np.triu(near, 1))
    assert np.array_equal(sapwise.pairs(boxes if wide else boxes.astype(np.float32), margin=margin), known)
    if not wide:
        assert np.array_equal(sapwise.pairs(boxes, margin=margin), known)


def test_many_small_worlds():
    world = np.repeat(np.arange(500), 31)
    boxes = np.tile(cubes(31, seed=5), (500, 1))
    known = naive(boxes[:31])
    assert len(known) > 3
    expected = (known[None].astype(np.int64) + 31 * np.arange(500)[:, None, None]).reshape(-1, 2)
    assert np.array_equal(sapwise.pairs(boxes, worlds=world), expected)
    assert sapwise.last_decision().algorithm == "worlds" and sapwise.last_decision().load["objects"] == 15_500
    order = np.random.default_rng(1).permutation(len(boxes))
    found = order[sapwise.pairs(boxes[order], worlds=world[order])]
    found.sort(axis=1)
    assert np.array_equal(found[np.lexsort((found[:, 1], found[:, 0]))], expected)
    boxes[order[3]] = np.nan
    with pytest.raises(sapwise.InvalidBoxError, match="box 3 "):
        sapwise.pairs(boxes[order], worlds=world[order])
    assert sapwise.pairs([], worlds=[]).shape == (0, 2)


@pytest.mark.parametrize(
    "arguments, why",
    [
        ({"margin": -0.5}, "margin is -0.5; give 0 or more"),
        ({"margin": float("nan")}, "margin is NaN"),
        ({"algorithm": "grid-sap"}, "name its threads too: grid-sap@cpu1"),
        ({"algorithm": "octree@cpu1"}, "known here"),
        ({"algorithm": "bvh@cpu1", "worlds": [0] * 9}, "exclude each other"),
        ({"worlds": [0, 1]}, "worlds has 2 entries and there are 9"),
        ({"worlds": 0}, "one whole number for each box"),
        ({"groups": [1] * 8}, "groups has 8"),
        ({"owner": [2**32] * 9}, "owner of box 0 is 4294967296"),
        ({"fixed": [1] * 9}, "True or False"),
    ],
)
def test_keywords_that_can_not_be(arguments, why):
    with pytest.raises(sapwise.InputError, match=why):
        sapwise.pairs(cubes(9), **arguments)
    for key in set(arguments) - {"margin", "algorithm"}:
        with pytest.raises(sapwise.InputError, match=f"{key} is for two lists here"):
            sapwise.pairs_between(cubes(4), cubes(5), **{key: [1] * 9})
    with pytest.raises(sapwise.InputError, match="owner excludes"):
        sapwise.pairs_between(cubes(4), cubes(5), algorithm="sap@cpu1", owner=(1, 2))


def test_intervals_on_one_axis_are_swept():
    start = np.sort(np.random.default_rng(1).integers(0, 100_000, 3000))
    boxes = np.zeros((3000, 6), np.float32)
    boxes[:, 0], boxes[:, 3] = start, start + 300
    assert np.array_equal(sapwise.pairs(boxes), naive(boxes))
    if sapwise.last_decision().source == "default":
        assert sapwise.last_decision().algorithm.startswith("sap@")


def test_a_decision_for_every_call():
    boxes = cubes(3000)
    for call, algorithm in [
        (lambda: sapwise.pairs(boxes), ""),
        (lambda: sapwise.pairs_between(boxes[:9], boxes), "between"),
        (lambda: sapwise.pairs(boxes, algorithm="sap@cpu1"), "sap@cpu1"),
        (lambda: sapwise.pairs_between(boxes[:9], boxes, algorithm="bvh@cpu1"), "bvh@cpu1"),
        # So many pairs that what searched is not kept.
        (lambda: sapwise.pairs(np.zeros((6000, 6), np.float32)), ""),
    ]:
        found = call()
        decision = sapwise.last_decision()
        assert algorithm in decision.algorithm and (algorithm or "@cpu" in decision.algorithm)
        assert decision.load["objects"] in {3000, 3009, 6000} and str(decision)
    assert len(found) == 6000 * 5999 // 2


coordinates = st.floats(-4, 4, width=16) | st.sampled_from([-np.inf, np.inf, 0.0, -0.0, 1.0])


@settings(max_examples=200, deadline=None)
@given(arrays.arrays(np.float32, st.tuples(st.integers(0, 30), st.just(2), st.just(3)), elements=coordinates))
def test_any_boxes(corners):
    boxes = np.concatenate([corners.min(axis=1), corners.max(axis=1)], axis=1)
    assert np.array_equal(sapwise.pairs(boxes), naive(boxes))
    assert np.array_equal(sapwise.pairs_between(boxes[:9], boxes[9:]), naive(boxes[:9], boxes[9:]))
