"""`Space` against a list of bodies, its queries against NumPy, pickles, and what can't be."""

import copy
import pickle

import numpy as np
import pytest
from conftest import HERE, allowed, cubes, forks, limited_by_memory, mixed, naive, run
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

import sapwise

ALL = 0xFFFFFFFF


def quiet(**options):
    """One that measures nothing and keeps nothing."""
    return sapwise.Space(**{"cache": False, "measure": False, **options})


def as_set(pairs):
    assert pairs.dtype == np.uint64 and pairs.ndim == 2 and pairs.shape[1] == 2
    found = [tuple(p) for p in pairs.tolist()]
    assert len(set(found)) == len(found) and all(a < b for a, b in found)
    return set(found)


box = st.tuples(*[st.integers(0, 12)] * 3, *[st.integers(0, 4)] * 3).map(lambda b: [*b[:3], *np.add(b[:3], b[3:])])
body = st.fixed_dictionaries(
    {},
    optional={
        "groups": st.sampled_from([1, 2, 3, ALL]),
        "masks": st.sampled_from([0, 1, 2, ALL]),
        "owner": st.integers(0, 2),
        "fixed": st.booleans(),
    },
)
DEFAULT = {"groups": ALL, "masks": ALL, "owner": 0, "fixed": False}


class Machine(RuleBasedStateMachine):
    """Any calls in any order, against a dict of bodies."""

    @initialize()
    def start(self):
        self.space = quiet()
        self.bodies, self.gone, self.before, self.order = {}, [], set(), []

    def teardown(self):
        if hasattr(self, "space"):
            self.space.close()

    def some(self, data):
        handles = st.lists(st.sampled_from(sorted(self.bodies)), min_size=1, max_size=6, unique=True)
        return data.draw(handles)

    @rule(boxes=st.lists(box, max_size=8), of=body)
    def insert(self, boxes, of):
        array = np.array(boxes, np.float32).reshape(-1, 6)
        handles = self.space.insert(array, **of)
        assert handles.dtype == np.uint64 and not set(handles.tolist()) & (set(self.bodies) | set(self.gone))
        self.bodies |= {h: [b, {**DEFAULT, **of}] for h, b in zip(handles.tolist(), boxes)}

    @precondition(lambda self: self.bodies)
    @rule(data=st.data())
    def set(self, data):
        handles = self.some(data)
        boxes = [data.draw(box) for _ in handles]
        self.space.set(np.array(handles, np.uint64), np.array(boxes, np.float32))
        for handle, b in zip(handles, boxes):
            self.bodies[handle][0] = b

    @precondition(lambda self: self.bodies)
    @rule(data=st.data(), of=body.filter(bool))
    def set_body(self, data, of):
        handles = self.some(data)
        self.space.set_body(handles, **of)
        for handle in handles:
            self.bodies[handle][1] = {**self.bodies[handle][1], **of}

    @precondition(lambda self: self.bodies)
    @rule(data=st.data())
    def remove(self, data):
        handles = self.some(data)
        self.space.remove(handles)
        self.gone += handles
        for handle in handles:
            del self.bodies[handle]

    @rule(times=st.sampled_from([1, 1, 12]))
    def update(self, times):
        for _ in range(times):
            self.space.update()
            now = self.known()
            assert as_set(self.space.pairs()) == now
            assert as_set(self.space.begun()) == now - self.before and as_set(self.space.ended()) == self.before - now
            self.before = now

    @rule()
    def pickle(self):
        twin = pickle.loads(pickle.dumps(self.space))
        assert np.array_equal(twin.pairs(), self.space.pairs()) and np.array_equal(twin.begun(), self.space.begun())
        self.space.close()
        self.space = twin

    @precondition(lambda self: self.gone)
    @rule(data=st.data())
    def use_one_that_is_gone(self, data):
        gone = data.draw(st.sampled_from(self.gone))
        handles = [*self.bodies, gone]
        for call in (self.space.remove, self.space.boxes, lambda h: self.space.set_body(h, owner=1)):
            with pytest.raises(sapwise.StaleHandleError) as error:
                call(handles)
            assert error.value.index == len(handles) - 1

    @invariant()
    def has_these_bodies(self):
        if hasattr(self, "space"):
            assert self.space.handles().tolist() == sorted(self.bodies) and len(self.space) == len(self.bodies)
            boxes = self.space.boxes(self.space.handles())
            assert boxes.tolist() == [list(map(float, self.bodies[h][0])) for h in sorted(self.bodies)]

    def known(self):
        handles = sorted(self.bodies)
        of = [self.bodies[h][1] for h in handles]
        may = allowed(*([b[key] for b in of] for key in DEFAULT)) if of else None
        pairs = naive([self.bodies[h][0] for h in handles])
        return {(handles[a], handles[b]) for a, b in pairs.tolist() if may[a, b]}


TestAnyCalls = Machine.TestCase
TestAnyCalls.settings = settings(max_examples=60, stateful_step_count=25, deadline=None)


def test_many_bodies_that_move_rest_and_wake():
    rng = np.random.default_rng(1)
    boxes = cubes(3000, seed=1)
    fixed = np.arange(3000) < 500
    with quiet(threads=1) as space:
        handles = space.insert(boxes, fixed=fixed)
        assert handles.shape == (3000,) and handles[0] in space and 0 not in space
        for frame in range(30):
            moving = rng.choice(3000, 3000 if frame == 20 else 30, replace=False)
            boxes[moving] += np.tile(rng.choice([-0.25, 0, 0.25], (len(moving), 3)), 2).astype(np.float32)
            space.set(handles[moving], boxes[moving])
            space.update()
            pairs = naive(boxes)
            pairs = pairs[~(fixed[pairs[:, 0]] & fixed[pairs[:, 1]])]
            assert as_set(space.pairs()) == {tuple(p) for p in handles[pairs].tolist()}
        assert len(pairs) > 500 and space.last_decision.algorithm.endswith("@cpu1")


def scene():
    boxes = mixed(800, seed=4)
    space = quiet()
    groups = np.random.default_rng(2).integers(0, 8, 800)
    handles = space.insert(boxes, groups=groups)
    space.update()
    return space, handles, boxes, groups


@pytest.mark.parametrize("by", [None, 5])
def test_queries_by_box_and_point(by):
    space, handles, boxes, groups = scene()
    view = space if by is None else space.view(masks=by)
    wanted = np.full(800, True) if by is None else groups & by != 0
    asked = mixed(200, seed=5)
    positions, found = view.query_boxes(asked)
    known = naive(asked, boxes)
    known = known[wanted[known[:, 1]]]
    assert np.array_equal(np.stack([positions, found]), [known[:, 0], handles[known[:, 1]]]) and len(known) > 50
    assert positions.dtype == np.int64 and found.dtype == np.uint64
    for k in range(5):
        assert np.array_equal(view.query_box(asked[k]), found[positions == k])
        point = asked[k, :3]
        inside = ((boxes[:, :3] <= point) & (point <= boxes[:, 3:])).all(axis=1) & wanted
        assert np.array_equal(view.query_point(point), handles[inside])


def entries(origin, direction, boxes, max):
    """Where a ray enters each box: NaN if it does not."""
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = (boxes[:, :3] - origin) / direction, (boxes[:, 3:] - origin) / direction
    low, high = np.fmax.reduce(np.fmin(a, b), axis=1), np.fmin.reduce(np.fmax(a, b), axis=1)
    low = np.maximum(low, 0)
    return np.where((low <= high) & (low <= max), low, np.nan)


def test_rays_and_moving_boxes():
    space, handles, boxes, _ = scene()
    rng = np.random.default_rng(8)
    origins, directions = rng.normal(0, 5, (100, 3)).astype(np.float32), rng.normal(0, 1, (100, 3)).astype(np.float32)
    positions, found, t = space.cast_rays(origins, directions, max=3.0)
    first, at = space.first_hits(origins, directions, max=np.full(100, 3.0))
    hits = 0
    for k in range(100):
        known = entries(origins[k].astype(float), directions[k].astype(float), boxes.astype(float), 3.0)
        mine = positions == k
        assert set(found[mine]) == set(handles[~np.isnan(known)])
        assert np.all(np.diff(t[mine]) >= 0)
        assert np.allclose(t[mine], known[np.searchsorted(handles, found[mine])], atol=1e-4)
        assert (first[k], at[k]) == ((found[mine][0], t[mine][0]) if mine.any() else (0, np.inf))
        one, t_one = space.cast_ray(origins[k], directions[k], 3.0)
        assert np.array_equal(one, found[mine]) and np.array_equal(t_one, t[mine])
        hits += mine.sum()
    assert hits > 50
    moved, share = space.cast_box([-50, -50, -50, -49, -49, -49], [100, 100, 100])
    # A box that moves is a ray in a world of boxes that are larger by its size.
    grown = boxes.astype(float) - [1, 1, 1, 0, 0, 0]
    known = entries(np.full(3, -50.0), np.full(3, 100.0), grown, 1.0)
    assert set(moved) == set(handles[~np.isnan(known)]) and len(moved) > 5
    assert np.allclose(share, known[np.searchsorted(handles, moved)], atol=1e-5)


def test_the_nearest():
    space, handles, boxes, groups = scene()
    for point in np.random.default_rng(9).normal(0, 6, (20, 3)).astype(np.float32):
        gap = np.maximum(np.maximum(boxes[:, :3] - point, point - boxes[:, 3:]), 0).astype(float)
        distance = np.sqrt((gap**2).sum(axis=1))
        found, distances = space.nearest(point, 7)
        assert np.allclose(distances, np.sort(distance)[:7], atol=1e-4)
        assert np.allclose(distance[np.searchsorted(handles, found)], distances, atol=1e-4)
        only, _ = space.view(masks=4).nearest(point, 3)
        assert (groups[np.searchsorted(handles, only)] & 4 != 0).all() and len(only) == 3
    assert len(space.nearest([0, 0, 0], 10**18)[0]) == 800


def test_two_dimensions_and_single_bodies():
    with quiet() as space:
        one, other = space.insert([[0, 0, 2, 2], [1, 1, 3, 3]])
        third = space.insert([5, 5, 0, 6, 6, 0])[0]
        space.update()
        assert space.pairs().tolist() == [[one, other]]
        space.set(third, [2, 2, 4, 4])
        space.update()
        assert len(space.begun()) == 2 and space.boxes(third).tolist() == [[2, 2, 0, 4, 4, 0]]
        assert space.query_point([0.5, 0.5]).tolist() == [one]
        assert space.query_box([0, 0, 1, 1]).tolist() == [one, other]
        assert space.cast_ray([-1, 0.5], [1, 0])[1].tolist() == [1.0]
        space.remove(one)
        assert one not in space and other in space


def test_a_pickle_goes_on_as_the_original():
    boxes = cubes(500, seed=6)
    space = quiet(threads=1, exploring=False)
    handles = space.insert(boxes, fixed=np.arange(500) < 100)
    for k in range(12):
        space.set(handles[k::50], boxes[k::50] + np.float32(0.25))
        space.update()
    space.remove(handles[3])
    twins = [pickle.loads(pickle.dumps(space)), copy.deepcopy(space)]
    for step in range(4):
        assert len({int(of.insert([step, 0, 0, 9, 9, 9])[0]) for of in (space, *twins)}) == 1
        for of in (space, *twins):
            of.update()
            for name in ("pairs", "begun", "ended", "handles"):
                assert np.array_equal(getattr(of, name)(), getattr(space, name)()), name
        assert len(space.begun()) > 0
    assert twins[0].tuning.to_json() == space.tuning.to_json() and twins[0].setup["file"] is None
    _, (snapshot, *rest) = space.__reduce__()
    for damaged in (b"", snapshot[:-9], snapshot[:16] + bytes([255] * 40), b"sapwise space 0\n" + snapshot[16:]):
        with pytest.raises(sapwise.InputError, match="pickle the space again"):
            sapwise._sapwise.restored_space(damaged, *rest)


def test_it_saves_when_the_block_ends(tmp_path):
    with sapwise.Space(cache=tmp_path, background=False) as space:
        assert space.setup["origin"] == "probed"
        space.insert(cubes(200))
        space.update()
    assert space.closed and [f for f in tmp_path.iterdir() if f.suffix == ".json"]
    with pytest.raises(sapwise.SapwiseError, match="this Space is closed"):
        space.update()
    assert sapwise.Space(cache=tmp_path, measure=False, background=False).setup["origin"] == "cached"


def test_a_crowd_beyond_the_limit():
    with quiet(limit=1000) as space:
        one, *_ = space.insert(np.zeros((40, 6)))
        space.update()
        space.insert(np.zeros((10, 6)))
        for of in (space, pickle.loads(pickle.dumps(space))):
            with pytest.raises(sapwise.TooManyPairsError, match="limit of 1000"):
                of.update()
        space.remove(space.handles()[40:])
        space.update()
        assert len(space.pairs()) == 780 and len(space.begun()) == len(space.ended()) == 0


@limited_by_memory
def test_a_crowd_whose_pairs_fill_no_memory():
    # 2e11 pairs, 3.2 TB.
    with quiet() as space, pytest.raises((sapwise.TooManyPairsError, MemoryError)):
        space.insert(np.zeros((632_456, 6), np.float32))
        space.update()


def test_what_can_not_be_changes_nothing():
    with quiet() as space:
        handles = space.insert(cubes(3))
        nan = cubes(3)
        nan[2, 1] = np.nan
        for call, error, why in [
            (lambda: space.insert(nan), sapwise.InvalidBoxError, "box 2 .*NaN"),
            (lambda: space.insert(nan, owner=[1, 2, 3]), sapwise.InvalidBoxError, "box 2 .*NaN"),
            (lambda: space.insert(cubes(3), owner=[1, 2]), sapwise.InputError, "owner has 2 entries"),
            (lambda: space.insert(cubes(3), groups=-1), sapwise.InputError, "groups of box 0 is -1"),
            (lambda: space.set(handles, nan), sapwise.InvalidBoxError, "box 2 .*NaN"),
            (lambda: space.set(handles, nan.astype(float)[:, ::-1]), sapwise.InvalidBoxError, "box"),
            (lambda: space.set(handles, cubes(2)), sapwise.InputError, "3 handles and 2 boxes"),
            (lambda: space.set([0], cubes(1)), sapwise.StaleHandleError, "handle 0 at position 0"),
            (lambda: space.remove([1, 77]), sapwise.StaleHandleError, "handle 77 at position 1"),
            (lambda: space.remove([-1]), sapwise.InputError, "position 0 is -1"),
            (lambda: space.remove([0.5]), sapwise.InputError, "whole"),
            (lambda: space.remove(np.ma.array(handles, mask=[1, 0, 0])), TypeError, "handles is a masked array"),
            (lambda: space.set(np.ma.array(handles, mask=[1, 0, 0]), cubes(3, 1)), TypeError, "masked"),
            (lambda: space.boxes(np.ma.array(handles)), TypeError, "masked"),
            (lambda: space.set_body(handles), sapwise.InputError, "nothing is set"),
            (lambda: space.query_box(cubes(2)), sapwise.InputError, "2 boxes; give one"),
            (lambda: space.query_boxes(nan), sapwise.InvalidBoxError, "box 2"),
            (lambda: space.query_point([0, 0, 0, 0]), sapwise.InputError, r"shape \(4,\)"),
            (lambda: space.query_point("here"), sapwise.InputError, "shape"),
            (lambda: space.query_point(["a", "b", "c"]), TypeError, "give numbers"),
            (lambda: space.query_point([0, np.nan, 0]), sapwise.InvalidRayError, "point 0"),
            (lambda: space.cast_ray([0, 0, 0], [0, 0, 0]), sapwise.InvalidRayError, "ray 0 has the direction zero"),
            (lambda: space.cast_rays(np.zeros((2, 3)), [[0, 0, 1], [0, np.inf, 0]]), sapwise.InvalidRayError, "ray 1"),
            (lambda: space.cast_rays(np.zeros((2, 3)), np.ones((3, 3))), sapwise.InputError, "2 origins and 3"),
            (lambda: space.cast_rays(np.zeros((2, 3)), np.ones((2, 3)), [1]), sapwise.InputError, "max has shape"),
            (lambda: space.cast_box([0, 0, 0, 1, 1, 1], [0, 0, np.inf]), sapwise.InvalidRayError, "motion 0"),
            (lambda: space.nearest([0, 0, 0], -1), sapwise.InputError, "k is -1"),
            (lambda: quiet(threads=-2), sapwise.InputError, "threads is -2"),
            (lambda: quiet(algorithm="bvh"), sapwise.InputError, "threads too: bvh@cpu1"),
        ]:
            with pytest.raises(error, match=why):
                call()
        space.update()
        assert np.array_equal(space.boxes(handles), cubes(3)) and space.handles().tolist() == handles.tolist()


def test_threads_query_and_change_at_once():
    script = """
import sys, threading
import numpy as np, sapwise
sys.path.insert(0, %r)
from conftest import cubes, naive
boxes = cubes(20_000, seed=1)
space = sapwise.Space(cache=False, measure=False)
handles = space.insert(boxes); space.update()
known, wrong, stop = len(naive(boxes[:500], boxes)), [], threading.Event()
def ask():
    while not stop.is_set():
        if len(space.query_boxes(boxes[:500])[0]) != known: wrong.append('query')
        space.pairs(), repr(space), space.first_hits(boxes[:50, :3], boxes[:50, 3:] + 1)
threads = [threading.Thread(target=ask) for _ in range(3)]
[t.start() for t in threads]
for _ in range(30): space.set(handles, boxes); space.update()
stop.set(); [t.join() for t in threads]
print(wrong)
""" % HERE
    assert run(script).strip() == "[]"


@forks
def test_a_fork_has_a_space_of_its_own():
    script = """
import os, sys, warnings
import numpy as np, sapwise
sys.path.insert(0, %r)
from conftest import cubes
warnings.simplefilter('ignore')
space = sapwise.Space(cache=False, measure=False)
handles = space.insert(cubes(60_000, seed=2)); space.update(); space.update()
known = space.pairs()
child = os.fork()
if child == 0:
    status = 1
    try:
        assert np.array_equal(space.pairs(), known)
        space.remove(handles[:100]); space.set(handles[100:], cubes(59_900, seed=3)); space.update()
        assert len(space) == 59_900 and len(space.ended()) > 0
        space.close()
        status = 0
    finally: os._exit(status)
assert os.waitpid(child, 0)[1] == 0
space.update()
print(np.array_equal(space.pairs(), known), len(space))
""" % HERE
    assert run(script).strip() == "True 60000"
