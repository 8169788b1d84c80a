"""`BroadPhase` through frames, against sets of pairs."""

import gc
import json
import pickle

import numpy as np
import pytest
from conftest import cubes, mixed, naive

import sapwise


def quiet(**options):
    """One that measures nothing and keeps nothing."""
    return sapwise.BroadPhase(**{"cache": False, "measure": False, **options})


def as_set(pairs):
    return {tuple(p) for p in pairs.tolist()}


@pytest.mark.parametrize("count", [40, 600, 4000])
def test_frames_with_what_began_and_ended(count):
    rng = np.random.default_rng(count)
    boxes, before = cubes(count, seed=1), set()
    with quiet() as broad_phase:
        for frame in range(12):
            found = broad_phase.find(boxes)
            assert np.array_equal(found, naive(boxes))
            now = as_set(found)
            # Asked for in some frames only, once twice: what is told is of the last frame always.
            if frame % 3 != 1:
                assert as_set(broad_phase.begun()) == now - before and as_set(broad_phase.ended()) == before - now
                assert as_set(broad_phase.begun()) == now - before and broad_phase.begun().dtype == np.uint32
            before = now
            boxes += np.tile(rng.choice([-0.125, 0, 0.125], (count, 3)), 2).astype(np.float32)
        assert now and broad_phase.last_decision.load["objects"] == count


def test_ids_follow_boxes_that_change_their_positions():
    boxes, ids = mixed(400, seed=3), np.arange(1000, 1400)
    rng = np.random.default_rng(5)
    with quiet(ordered=False) as broad_phase:
        broad_phase.find(boxes, ids=ids)
        assert len(broad_phase.begun()) == len(naive(boxes)) and broad_phase.begun().dtype == np.int64
        for _ in range(5):
            order = rng.permutation(400)
            boxes, ids = boxes[order], ids[order]
            broad_phase.find(boxes, ids=ids)
            assert broad_phase.begun().shape == broad_phase.ended().shape == (0, 2)
        gone = ids[7]
        ended = as_set(np.sort(ids[naive(boxes)], axis=1))
        ended = {p for p in ended if gone in p}
        broad_phase.find(np.delete(boxes, 7, axis=0), ids=np.delete(ids, 7).tolist())
        assert as_set(broad_phase.ended()) == ended and len(ended) > 0 and len(broad_phase.begun()) == 0


def test_ids_in_one_frame_and_none_in_the_next_are_refused():
    boxes = cubes(50)
    with quiet() as broad_phase:
        broad_phase.find(boxes)
        with pytest.raises(sapwise.InputError, match="only one of two consecutive frames"):
            broad_phase.find(boxes, ids=range(50))
        assert np.array_equal(broad_phase.find(boxes), naive(boxes))


@pytest.mark.parametrize(
    "ids, why",
    [
        (range(49), "49 entries"),
        (np.zeros(50), "whole"),
        (np.zeros((50, 1), int), "whole"),
        (["a"] * 50, "whole"),
        (np.full(50, 2**63, np.uint64), "box 0"),
    ],
)
def test_ids_that_can_not_be(ids, why):
    with quiet() as broad_phase, pytest.raises(sapwise.InputError, match=why):
        broad_phase.find(cubes(50), ids=list(ids) if isinstance(ids, range) else ids)


def test_a_frame_that_failed_leaves_no_trace():
    boxes = cubes(300, seed=8)
    moved = boxes + np.float32(0.25) * np.arange(300, dtype=np.float32)[:, None] / 300
    broken = boxes.copy()
    broken[17, 2] = np.nan
    with quiet() as broad_phase:
        broad_phase.find(boxes)
        broad_phase.find(boxes)
        with pytest.raises(sapwise.InvalidBoxError):
            broad_phase.find(broken)
        assert len(broad_phase.begun()) == len(broad_phase.ended()) == 0
        ids = range(300)
        for wrong in ((broken.astype(float),), (boxes, None, ids), (boxes, None, [1, 1]), (boxes[:, :5],)):
            broad_phase.find(moved)
            broad_phase.find(boxes)
            assert len(broad_phase.begun()) > 0
            with pytest.raises((ValueError, sapwise.InputError)):
                broad_phase.find(*wrong[:2], ids=wrong[2] if len(wrong) > 2 else None)
            assert len(broad_phase.begun()) == len(broad_phase.ended()) == 0
        now = as_set(broad_phase.find(moved))
        before = as_set(naive(boxes))
        assert as_set(broad_phase.begun()) == now - before and as_set(broad_phase.ended()) == before - now


def test_groups_masks_and_fixed_boxes():
    boxes = cubes(500, seed=9)
    rng = np.random.default_rng(9)
    groups, masks, fixed = rng.integers(1, 8, 500), rng.integers(0, 8, 500), rng.random(500) < 0.5
    owner = rng.integers(0, 9, 500)
    pairs = naive(boxes)
    a, b = pairs[:, 0], pairs[:, 1]
    by_group = (groups[a] & masks[b] != 0) & (groups[b] & masks[a] != 0)
    by_fixed = ~(fixed[a] & fixed[b])
    by_owner = (owner[a] != owner[b]) | (owner[a] == 0)
    with quiet() as broad_phase:
        for arguments, wanted in [
            ({"groups": groups, "masks": masks}, by_group),
            ({"fixed": fixed}, by_fixed),
            ({"owner": owner, "groups": 1}, by_owner),
            ({"groups": groups.tolist(), "masks": masks, "fixed": fixed.tolist()}, by_group & by_fixed),
            ({"masks": masks}, (masks[a] != 0) & (masks[b] != 0)),
            ({}, np.ones(len(pairs), bool)),
        ]:
            broad_phase.set_filter(**arguments)
            for _ in range(3):
                assert np.array_equal(broad_phase.find(boxes), pairs[wanted])
        assert 0 < by_group.sum() < len(pairs) and 0 < by_fixed.sum() < len(pairs)


@pytest.mark.parametrize(
    "arguments, why",
    [
        ({"groups": [1, 2], "masks": [1]}, "masks has 1"),
        ({"groups": [1, 2], "fixed": [True]}, "fixed has 1"),
        ({"groups": [1, -1]}, "groups of box 1 is -1"),
        ({"groups": 1, "owner": 5}, "single number"),
        ({"masks": [1, 2**32]}, "masks of box 1"),
        ({"groups": [0.5]}, "whole"),
        ({"fixed": [1, 0]}, "True or False"),
    ],
)
def test_filters_that_can_not_be(arguments, why):
    with quiet() as broad_phase, pytest.raises(sapwise.InputError, match=why):
        broad_phase.set_filter(**arguments)


def test_a_filter_of_another_length_is_refused():
    with quiet() as broad_phase:
        broad_phase.set_filter(fixed=[True] * 5)
        with pytest.raises(sapwise.InputError, match="filter is for 5 boxes and there are 6"):
            broad_phase.find(cubes(6))


def test_it_saves_when_the_block_ends(tmp_path):
    boxes = cubes(500)
    with sapwise.BroadPhase(cache=tmp_path, background=False) as broad_phase:
        assert broad_phase.setup["origin"] == "probed"
        # More than ever pass between two decisions: the second one learns from the frames since the first.
        for _ in range(1500):
            broad_phase.find(boxes)
    assert broad_phase.closed
    kept = [f for f in tmp_path.iterdir() if f.suffix == ".json"]
    assert len(kept) == 1 and json.loads(kept[0].read_text(encoding="utf-8"))["schema"].startswith("tuning/")
    again = sapwise.BroadPhase(cache=str(tmp_path), measure=False, background=False)
    assert again.setup["origin"] == "cached" and again.setup["file"] == str(kept[0])
    assert again.tuning.source == "learned" and again.save()
    # What the block raises comes through, and all is saved.
    kept[0].unlink()
    with pytest.raises(KeyError), again:
        raise KeyError
    assert kept[0].exists()


def test_a_folder_that_can_not_be_written_is_a_warning(tmp_path):
    with sapwise.BroadPhase(cache=tmp_path / "cache", background=False) as broad_phase:
        broad_phase.find(cubes(100))
    broad_phase = sapwise.BroadPhase(cache=tmp_path / "cache", measure=False, background=False)
    for file in (tmp_path / "cache").iterdir():
        file.unlink()
    (tmp_path / "cache").rmdir()
    (tmp_path / "cache").write_text("in the way")
    with pytest.raises(sapwise.SapwiseError, match="can't be written"):
        broad_phase.save()
    with pytest.warns(RuntimeWarning, match="not kept"), broad_phase:
        pass


def test_it_starts_in_the_background_and_ends_soon(tmp_path):
    boxes = cubes(2000)
    for _ in range(3):
        broad_phase = sapwise.BroadPhase(cache=tmp_path)
        assert np.array_equal(broad_phase.find(boxes), naive(boxes))
        assert broad_phase.setup["origin"] in {"awaited", "cached"}
        del broad_phase
        gc.collect()


def test_a_closed_one_says_so():
    broad_phase = quiet()
    assert "no frame yet" in repr(broad_phase) and broad_phase.last_decision is None
    assert broad_phase.begun().shape == broad_phase.ended().shape == (0, 2)
    broad_phase.close()
    broad_phase.close()
    assert broad_phase.closed and "closed" in repr(broad_phase)
    find, begun = lambda: broad_phase.find(cubes(3)), lambda: broad_phase.begun()
    for use in (find, begun, broad_phase.save, broad_phase.set_filter):
        with pytest.raises(sapwise.SapwiseError, match="closed"):
            use()


def test_one_algorithm_always_and_a_tuning_of_the_caller():
    boxes = cubes(1500)
    for algorithm in ("brute@cpu1", "sap@cpu1", "grid-sap@cpu1", "bvh@cpu1", "pair-cache@cpu1"):
        with quiet(algorithm=algorithm) as broad_phase:
            assert np.array_equal(broad_phase.find(boxes), naive(boxes))
            assert broad_phase.last_decision.algorithm == algorithm
            tuning = broad_phase.tuning
        with quiet(tuning=tuning) as broad_phase:
            broad_phase.find(boxes)
            assert broad_phase.last_decision.algorithm == algorithm
            with pytest.raises(sapwise.SapwiseError, match="no cache file"):
                broad_phase.save()
    with quiet(threads=1) as broad_phase:
        broad_phase.find(cubes(20_000))
        assert broad_phase.last_decision.algorithm.endswith("@cpu1")


@pytest.mark.parametrize(
    "arguments, why",
    [
        ({"algorithm": "fastest"}, "known here: .*bvh@cpu1"),
        ({"algorithm": "octree@cpu1"}, "known here"),
        ({"algorithm": "grid-sap"}, "name its threads too: grid-sap@cpu1"),
        ({"algorithm": "bvh@cpu1", "tuning": sapwise.Space(cache=False, measure=False).tuning}, "exclude each other"),
        ({"threads": 0}, "threads is 0"),
        ({"threads": -1}, "threads is -1"),
        ({"limit": -1}, "limit is -1"),
        ({"cache": 5}, "cache is a folder"),
    ],
)
def test_arguments_that_can_not_be(arguments, why):
    with pytest.raises(sapwise.InputError, match=why):
        sapwise.BroadPhase(**arguments)


def test_more_threads_than_there_are_cores_is_an_error():
    with pytest.raises(sapwise.SapwiseError, match="needs 2 threads, and 1 may be used"):
        quiet(algorithm="bvh@cpu2", threads=1)


def test_it_can_not_be_pickled_and_says_so():
    with quiet() as broad_phase, pytest.raises(TypeError, match="pickle"):
        pickle.dumps(broad_phase)
