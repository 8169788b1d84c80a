"""Every kind of input: the right answer or an exception that says what to do, never a crash."""

import pickle
import warnings

import numpy as np
import pytest
from conftest import cubes, limited_by_memory, naive
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

import sapwise

BOXES = cubes(300, seed=21)
KNOWN = naive(BOXES)


def finders():
    """Everything that takes boxes, as functions of the boxes."""
    with sapwise.BroadPhase(cache=False, measure=False) as broad_phase:
        yield sapwise.pairs
        yield broad_phase.find
        yield lambda boxes: sapwise.pairs_between(boxes, BOXES)
        yield lambda boxes: sapwise.pairs_between(BOXES, boxes)


@pytest.mark.parametrize(
    "name, array",
    [
        ("read-only", np.frombuffer(BOXES.tobytes(), np.float32).reshape(-1, 6)),
        ("Fortran order", np.asfortranarray(BOXES)),
        ("reversed", BOXES[::-1][::-1]),
        ("every second", np.repeat(BOXES, 2, axis=0)[::2]),
        ("columns of a wider array", np.concatenate([BOXES, BOXES], axis=1)[:, :6]),
        ("big-endian", BOXES.astype(">f4")),
        ("big-endian doubles", BOXES.astype(">f8")),
        ("doubles", BOXES.astype(np.float64)),
        ("unaligned", np.frombuffer(b"x" + BOXES.tobytes(), np.float32, offset=1).reshape(-1, 6)),
        ("a list of lists", BOXES.tolist()),
        ("a tuple of arrays", tuple(BOXES)),
        ("a subclass", BOXES.view(np.recarray)),
    ],
)
def test_layouts_and_dtypes(name, array):
    assert np.array_equal(sapwise.pairs(array), KNOWN), name
    before = np.array(array, copy=True)
    sapwise.pairs(array)
    assert np.array_equal(np.asarray(array), before)


@pytest.mark.parametrize("dtype", ["i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "f2"])
def test_whole_numbers_and_halves(dtype):
    boxes = np.array([[0, 0, 0, 1, 1, 1], [1, 1, 1, 2, 2, 2], [3, 3, 3, 100, 4, 4], [100, 4, 4, 101, 5, 5]], dtype)
    assert sapwise.pairs(boxes).tolist() == [[0, 1], [2, 3]]


@pytest.mark.parametrize("given", [[], np.empty((0, 6)), np.empty((0, 6), np.float32), np.empty((0, 2, 3), np.float32)])
def test_no_boxes(given):
    for find in finders():
        assert find(given).shape == (0, 2)
    assert sapwise.pairs([], []).shape == (0, 2)


@pytest.mark.parametrize(
    "shape, hint",
    [
        ((5, 5), "shape"),
        ((5, 2, 4), "shape"),
        ((5, 3), "lower corners alone"),
        ((6, 5), "transpose"),
        ((6,), "shape"),
        ((2, 3, 6), "shape"),
        ((), "shape"),
    ],
)
def test_wrong_shapes(shape, hint):
    for find in finders():
        with pytest.raises(sapwise.InputError, match=hint):
            find(np.zeros(shape, np.float32))
    assert issubclass(sapwise.InputError, ValueError)


def test_wrong_corners():
    with pytest.raises(sapwise.InputError, match="3 lower and 2 upper"):
        sapwise.pairs(np.zeros((3, 3)), np.zeros((2, 3)))
    with pytest.raises(sapwise.InputError, match="upper has shape"):
        sapwise.pairs(np.zeros((3, 3)), np.zeros((3, 6)))
    with pytest.raises(sapwise.InputError, match="lower corners have 3 axes and the upper ones 2"):
        sapwise.pairs(np.zeros((3, 3)), np.zeros((3, 2)))


@pytest.mark.parametrize(
    "array",
    [
        *(np.zeros((4, 6), dtype) for dtype in (bool, complex, object, "M8[s]", np.longdouble)),
        *(np.full((4, 6), "a"), "boxes", None, {}),
    ],
)
def test_dtypes_that_are_no_boxes(array):
    if getattr(array, "dtype", None) == np.float64:
        pytest.skip("long doubles are doubles here")
    for find in finders():
        with pytest.raises((TypeError, sapwise.InputError), match="give|shape"):
            find(array)


def test_ragged_and_masked():
    with pytest.raises(sapwise.InputError, match="array"):
        sapwise.pairs([[0, 0, 0, 1, 1, 1], [0, 0]])
    for dtype in (np.float32, np.float64):
        with pytest.raises(TypeError, match="masked"):
            sapwise.pairs(np.ma.masked_array(np.zeros((4, 6), dtype), mask=True))


@pytest.mark.parametrize("dtype", [np.float32, np.float64, ">f4"])
@pytest.mark.parametrize("index", [0, 150, 299])
@pytest.mark.parametrize("defect", ["NaN", "inverted"])
def test_an_invalid_box_is_named(dtype, index, defect):
    boxes = BOXES.astype(dtype)
    if defect == "NaN":
        boxes[index, index % 6] = np.nan
    else:
        boxes[index, 4] = boxes[index, 1] - 1
    for find in finders():
        with pytest.raises(sapwise.InvalidBoxError, match=f"box {index} .*{defect}") as error:
            find(boxes)
        assert error.value.index == index
        copy = pickle.loads(pickle.dumps(error.value))
        assert (str(copy), copy.index) == (str(error.value), index)
    with pytest.raises(sapwise.InvalidBoxError, match=f"box {index} of b"):
        sapwise.pairs_between(BOXES[:10], boxes)
    with pytest.raises(sapwise.InvalidBoxError, match=f"box {index} "):
        sapwise.pairs(boxes[:, :3], boxes[:, 3:])


def test_two_dimensions():
    rng = np.random.default_rng(3)
    low = np.round(rng.uniform(0, 20, (400, 2)) * 64) / 64
    flat = np.concatenate([low, low + 1], axis=1)
    deep = np.concatenate([low, np.zeros((400, 1)), low + 1, np.zeros((400, 1))], axis=1)
    known = naive(deep)
    assert len(known) > 100
    for boxes in (flat, flat.astype(np.float32), flat.tolist(), flat.reshape(-1, 2, 2)):
        assert np.array_equal(sapwise.pairs(boxes), known)
    assert np.array_equal(sapwise.pairs(flat[:, :2], flat[:, 2:]), known)
    assert np.array_equal(sapwise.pairs_between(flat[:9], flat), naive(deep[:9], deep))
    flat[7, 1] = 99
    with pytest.raises(sapwise.InvalidBoxError, match="box 7 is inverted"):
        sapwise.pairs(flat)


#: Beside each other, a hair apart, and as far as a 32-bit float can tell.
special = [0.1, 0.1 + 1e-17, 0.1 + 1e-12, 0.1 - 1e-12, 0.3, 0.1 + 0.2, 0.1000001, 1e300, -1e300, 1e-300, -np.inf, np.inf]
near = st.sampled_from(special) | st.floats(-1, 1)


@settings(max_examples=300, deadline=None)
@given(
    arrays.arrays(np.float64, st.tuples(st.integers(0, 20), st.just(2), st.just(3)), elements=near),
    st.sampled_from([0.0, 0.1, 1e-12, 0.30000001]),
)
def test_pairs_of_doubles_are_those_of_doubles(corners, margin):
    boxes = np.concatenate([corners.min(axis=1), corners.max(axis=1)], axis=1)
    grown = boxes + [0, 0, 0, margin, margin, margin]
    assert np.array_equal(sapwise.pairs(boxes, margin=margin), naive(grown))
    assert np.array_equal(sapwise.pairs(boxes[:, :3], boxes[:, 3:]), naive(boxes))
    a, b = boxes[:9], boxes[9:]
    assert np.array_equal(sapwise.pairs_between(a, b, margin=margin), naive(grown[:9], grown[9:]))
    with np.errstate(over="ignore"):
        short = b.astype(np.float32)
    assert np.array_equal(sapwise.pairs_between(a, short), naive(a, short))


@settings(max_examples=100, deadline=None)
@given(arrays.arrays(np.float64, st.tuples(st.integers(0, 20), st.just(2), st.just(3)), elements=near))
def test_frames_and_spaces_lose_no_pair_of_doubles(corners):
    boxes = np.concatenate([corners.min(axis=1), corners.max(axis=1)], axis=1)
    known = {tuple(p) for p in naive(boxes).tolist()}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sapwise.RoundingWarning)
        with sapwise.BroadPhase(cache=False, measure=False, threads=1) as broad_phase:
            assert {tuple(p) for p in broad_phase.find(boxes).tolist()} >= known
        with sapwise.Space(cache=False, measure=False, threads=1) as space:
            handles = space.insert(boxes)
            space.update()
            found = {tuple(p) for p in np.searchsorted(handles, space.pairs()).tolist()}
            kept = space.boxes(handles).astype(float)
    assert found >= known and (kept[:, :3] <= boxes[:, :3]).all() and (kept[:, 3:] >= boxes[:, 3:]).all()


def test_positions_on_a_chromosome():
    rng = np.random.default_rng(1)
    start = 248_000_000 + rng.integers(0, 60_000, 600)
    boxes = np.zeros((600, 6), np.int64)
    boxes[:, 0], boxes[:, 3] = start, start + rng.integers(0, 100, 600)
    assert np.array_equal(sapwise.pairs(boxes), naive(boxes)) and len(naive(boxes)) > 50
    with sapwise.BroadPhase(cache=False, measure=False) as broad_phase, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert len(broad_phase.find(boxes)) > len(naive(boxes))


def test_rounding_is_told_once_and_only_if_it_can_change_an_answer(warns_again):
    exact, inexact = np.array([[0, 0, 0, 1, 1, 0.5]]), np.array([[0, 0, 0, 1, 1, 0.1]])
    with sapwise.Space(cache=False, measure=False) as space, sapwise.BroadPhase(cache=False, measure=False) as frames:
        space.insert(exact), frames.find(exact), space.insert([[0, 0, 0, 2**24, 1, 1]]), sapwise.pairs(inexact)
        with pytest.warns(sapwise.RoundingWarning, match="rounded outward"):
            space.insert(inexact)
        space.insert(inexact), frames.find(inexact)


def test_doubles_beyond_floats_and_an_inversion_that_rounding_would_hide():
    ranges = [(1e300, 2e300), (-2e300, -1e300), (-1e-300, 1e-300), (1e38, 3e38)]
    boxes = np.array([[low, 0, 0, high, 1, 1] for low, high in ranges])
    assert sapwise.pairs(boxes).tolist() == []
    one = np.nextafter(1.0, 2.0)
    with pytest.raises(sapwise.InvalidBoxError, match="box 1 is inverted"):
        sapwise.pairs(np.array([[0, 0, 0, 1, 1, 1], [one, 0, 0, 1.0, 1, 1]]))
    infinite = np.array([[-np.inf] * 3 + [np.inf] * 3, [0, 0, 0, 1, 1, 1]])
    assert sapwise.pairs(infinite).tolist() == [[0, 1]]


def test_integers_that_floats_can_not_tell_apart():
    boxes = np.zeros((5, 6), np.int64)
    boxes[3, 3] = 2**53 + 1
    with pytest.raises(sapwise.InputError, match="box 3 has an integer"):
        sapwise.pairs(boxes)
    with pytest.raises(sapwise.InputError, match="box 3 has an integer"):
        sapwise.pairs(boxes.astype(np.uint64))
    boxes[3, 3] = 2**53
    assert len(sapwise.pairs(boxes)) == 10


def test_more_boxes_than_32_bits_name():
    huge = np.lib.stride_tricks.as_strided(np.zeros(6, np.float32), (2**32, 6), (0, 4))
    for find in finders():
        with pytest.raises(sapwise.InputError, match="4294967296 boxes"):
            find(huge)
    corners = np.lib.stride_tricks.as_strided(np.zeros(3, np.float32), (2**32, 3), (0, 4))
    with pytest.raises(sapwise.InputError, match="4294967296 boxes"):
        sapwise.pairs(corners, corners)


def test_too_many_pairs_are_an_exception():
    boxes = np.zeros((3000, 6), np.float32)
    with pytest.raises(sapwise.TooManyPairsError, match="limit of 1000") as error:
        sapwise.pairs(boxes, limit=1000)
    assert error.value.limit == 1000 and isinstance(error.value, MemoryError)
    with pytest.raises(sapwise.TooManyPairsError):
        sapwise.pairs_between(boxes, boxes, limit=1000)
    limited = sapwise.BroadPhase(cache=False, measure=False, limit=1000)
    with limited as broad_phase, pytest.raises(sapwise.TooManyPairsError):
        broad_phase.find(boxes)
    # Only rounded to 32 bits would the first two meet.
    boxes = np.array([[0, 0, 0, 1, 1, 1], [1 + 1e-12, 0, 0, 2, 1, 1], [2, 0, 0, 3, 1, 1]])
    assert sapwise.pairs(boxes, limit=1).tolist() == [[1, 2]]
    with pytest.raises(sapwise.TooManyPairsError, match="limit of 0"):
        sapwise.pairs(boxes, limit=0)
    # Two million pairs need not be refused: the limit follows the memory.
    assert len(sapwise.pairs(np.zeros((2001, 6), np.float32))) == 2001 * 1000


@limited_by_memory
def test_a_crowd_whose_pairs_fill_no_memory():
    # 2e11 pairs, 1.6 TB.
    with pytest.raises((sapwise.TooManyPairsError, MemoryError)):
        sapwise.pairs(np.zeros((632_456, 6), np.float32))


def test_a_copy_of_many_boxes_is_told_once(warns_again):
    boxes = cubes(10_000).astype(np.float64)
    with pytest.warns(sapwise.ConversionWarning, match="10000 boxes were copied: they are 64-bit floats") as told:
        sapwise.pairs(boxes)
    assert told[0].filename == __file__
    sapwise.pairs(boxes)


def test_few_boxes_or_boxes_as_they_should_be_warn_not(warns_again):
    sapwise.pairs(cubes(9_999).astype(np.float64))
    sapwise.pairs(cubes(10_000))
    sapwise.pairs(cubes(10_000)[:, :3].copy(), cubes(10_000)[:, 3:].copy())
    sapwise.pairs(cubes(10_000).reshape(-1, 2, 3))


def test_arguments_that_do_not_exist():
    for wrong in ({"order": True}, {"limit": "many"}, {"limit": 1.5}):
        with pytest.raises(TypeError):
            sapwise.pairs(BOXES, **wrong)
    for wrong in (-1, 2**70):
        with pytest.raises(sapwise.InputError, match=f"limit is {wrong}; give 0 or more"):
            sapwise.pairs(BOXES, limit=wrong)
