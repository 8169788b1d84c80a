"""Converts the arrays of callers for the compiled half."""

import sys
import warnings

import numpy as np

from ._errors import ConversionWarning, InputError, RoundingWarning

#: The most boxes that 32 bits can name.
_MOST = 2**32 - 1
#: Fewest boxes for a warning about a copy.
_WORTH_A_WARNING = 10_000
#: Integers up to this are exact as 64-bit floats.
_EXACT = 2**53
_SHAPE = (
    "give shape (n, 6), minx miny minz maxx maxy maxz a row, or lower and upper corners of shape (n, 3) each; "
    "in two dimensions (n, 4), or (n, 2) each"
)
#: What a keyword of a filter holds where it is not given.
_DEFAULTS = {"groups": 0xFFFFFFFF, "masks": 0xFFFFFFFF, "owner": 0, "fixed": False}

_has_warned: set[type] = set()


def _warn(kind, text):
    if kind not in _has_warned:
        _has_warned.add(kind)
        # The first frame that is not of this package.
        level, frame = 1, sys._getframe()
        while frame.f_back and frame.f_globals.get("__name__", "").partition(".")[0] == "sapwise":
            level, frame = level + 1, frame.f_back
        warnings.warn(f"{text} Warned once.", kind, stacklevel=level)


def _warn_of_copy(count, why):
    if count >= _WORTH_A_WARNING:
        text = f"{count} boxes were copied: {why}. C-contiguous float32 of shape (n, 6) is read in place."
        _warn(ConversionWarning, text)


def warn_of_rounding():
    text = (
        "boxes were rounded outward to 32-bit floats, which may add pairs of boxes that nearly touch. Subtract an "
        "origin near the boxes, give float32, or use pairs, which drops such pairs."
    )
    _warn(RoundingWarning, text)


def _array(given, name):
    """Return an argument as an array, with its dtype."""
    if isinstance(given, np.ma.MaskedArray):
        raise TypeError(f"{name} is a masked array; leave out the masked entries, or take its .data")
    try:
        return np.asarray(given)
    except ValueError as why:
        raise InputError(f"{name} can't be made an array: {why}") from why


def _floats(array, name, which):
    """Return C-contiguous, aligned, native float32 if that is exact, else float64, and why the array was copied."""
    kind, size = array.dtype.kind, array.dtype.itemsize
    if kind == "f" and size == 4 or kind == "f" and size == 2 or kind in "iu" and size <= 2:
        wanted = np.float32
    elif kind == "f" and size == 8 or kind in "iu":
        wanted = np.float64
    else:
        raise TypeError(
            f"{name} has dtype {array.dtype}; give floats of 32 or 64 bits, for instance {name}.astype('float64')"
        )
    if kind in "iu" and size == 8 and array.size:
        too_large = (array > _EXACT) | (array < -_EXACT) if kind == "i" else array > _EXACT
        if too_large.any():
            index = int(np.argmax(too_large.reshape(len(array), -1).any(axis=1)))
            raise InputError(
                f"box {index}{which} has an integer beyond 2**53, which no float represents; scale or shift the boxes"
            )
    if array.dtype.newbyteorder("=") != np.dtype(wanted) or not array.dtype.isnative:
        why = f"their dtype is {array.dtype.str}"
    elif wanted is np.float64:
        why = "they are 64-bit floats"
    elif not (array.flags.c_contiguous and array.flags.aligned):
        why = "they are not C-contiguous" if array.flags.aligned else "they are not aligned"
    else:
        why = None
    return np.require(array, dtype=wanted, requirements=["C", "A"]), why


def _flat(array, name, which):
    """Return floats of shape (n, 6), and why they were copied if that could be helped."""
    _check_count(len(array))
    floats, why = _floats(array, name, which)
    if array.ndim == 3:
        floats = floats.reshape(len(array), 2 * array.shape[2])
    if floats.shape[1] == 4:
        flat = np.zeros((len(floats), 6), floats.dtype)
        flat[:, 0:2], flat[:, 3:5] = floats[:, :2], floats[:, 2:]
        return flat, None
    return floats, why


def boxes(given, upper, which):
    """Return C-contiguous float32 or float64 of shape (n, 6)."""
    name = f"the list{which}" if which else "boxes"
    if upper is None:
        array = _array(given, name)
        if array.shape == (0,):
            return np.empty((0, 6), np.float32)
        if array.shape[1:] not in ((6,), (2, 3), (4,), (2, 2)):
            hint = ""
            if array.ndim == 2 and array.shape[1] == 3:
                hint = "these are lower corners alone; "
            elif array.ndim == 2 and array.shape[0] == 6:
                hint = "these are columns, transpose them; "
            raise InputError(f"{name} has shape {array.shape}: {hint}{_SHAPE}")
        floats, why = _flat(array, name, which)
        if why:
            _warn_of_copy(len(array), why)
        return floats
    names = ("boxes (the lower corners)", "upper")
    corners = [_array(of, name) for of, name in zip((given, upper), names)]
    if any(c.shape == (0,) for c in corners) and all(c.size == 0 for c in corners):
        return np.empty((0, 6), np.float32)
    for corner, name in zip(corners, names):
        if corner.ndim != 2 or corner.shape[1] not in (2, 3):
            raise InputError(f"{name} has shape {corner.shape}: {_SHAPE}")
    lower, upper = corners
    if len(lower) != len(upper):
        raise InputError(f"there are {len(lower)} lower and {len(upper)} upper corners; give one of each for each box")
    if lower.shape != upper.shape:
        raise InputError(f"the lower corners have {lower.shape[1]} axes and the upper ones {upper.shape[1]}: {_SHAPE}")
    _check_count(len(lower))
    (lower, why_lower), (upper, why_upper) = (_floats(of, name, which) for of, name in zip(corners, names))
    if why_lower or why_upper:
        _warn_of_copy(len(lower), why_lower or why_upper)
    return _flat(np.concatenate((lower, upper), axis=1), "boxes", which)[0]


def box_or_boxes(given):
    """Return what `boxes` does, for a single box too."""
    array = _array(given, "boxes")
    return boxes(array[None] if array.shape in ((6,), (4,)) else array, None, "")


def points(given, name, of_one):
    """Return float32 of shape (n, 3), rounded to nearest: of one point if `of_one`, which has shape (3,) or (2,)."""
    array = _array(given, name)
    wanted = "(3,)" if of_one else "(n, 3)"
    if of_one:
        array = array[None]
    elif array.shape == (0,):
        array = np.empty((0, 3), np.float32)
    if array.ndim != 2 or array.shape[1] not in (2, 3):
        shape = array.shape[1:] if of_one else array.shape
        raise InputError(f"{name} has shape {shape}; give {wanted}, or {wanted.replace('3', '2')} in two dimensions")
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name} has dtype {array.dtype}; give numbers")
    flat = np.zeros((len(array), 3), np.float32)
    with np.errstate(over="ignore", invalid="ignore"):
        flat[:, : array.shape[1]] = array
    return flat


def rays(origins, directions, most, of_one):
    """Return origins, directions and maxima as float32, one of each for each ray."""
    name = ("origin", "direction") if of_one else ("origins", "directions")
    origins, directions = points(origins, name[0], of_one), points(directions, name[1], of_one)
    if len(origins) != len(directions):
        raise InputError(f"there are {len(origins)} origins and {len(directions)} directions; give one for each ray")
    most = _array(np.inf if most is None else most, "max")
    if most.dtype.kind not in "fiu" or most.shape not in ((), (len(origins),)):
        raise InputError(f"max has shape {most.shape} and dtype {most.dtype}; give one number, or one for each ray")
    with np.errstate(over="ignore"):
        return origins, directions, np.ascontiguousarray(np.broadcast_to(most, len(origins)), np.float32)


def _check_count(count):
    if count > _MOST:
        raise InputError(f"{count} boxes are more than the {_MOST} that 32 bits can number; split the scene")


def _check_length(array, name, count):
    if count is not None and array.ndim == 1 and len(array) != count:
        raise InputError(f"{name} has {len(array)} entries and there are {count} boxes; give one for each box")


def _whole(given, name, count, or_one=False):
    """Return an array of whole numbers, of any length if `count` is None; a single one only if `or_one`."""
    array = _array(given, name)
    if array.shape == (0,):
        array = array.astype(np.int64)
    if array.ndim > 1 or array.ndim == 0 and not or_one or array.dtype.kind not in "iu":
        raise InputError(f"{name} has shape {array.shape} and dtype {array.dtype}; give one whole number for each box")
    _check_length(array, name, count)
    return array


def ids(given, count):
    """Return ids as int64."""
    array = _whole(given, "ids", count)
    most = np.iinfo(np.int64).max
    if array.dtype.kind == "u" and array.size and array.max() > most:
        index = int(np.argmax(array > most))
        raise InputError(f"the id of box {index} does not fit into 63 bits; number the boxes anew")
    return np.ascontiguousarray(array, np.int64)


def handles(given):
    """Return handles as uint64."""
    array = np.atleast_1d(_whole(given, "handles", None, True))
    if array.dtype.kind == "i" and array.size and array.min() < 0:
        index = int(np.argmax(array < 0))
        raise InputError(f"the handle at position {index} is {array[index]}; give what insert has returned")
    return np.ascontiguousarray(array, np.uint64)


def _joined(given, name, counts, column):
    """Return the column of one list, or the columns of two lists one after the other."""
    if not isinstance(counts, tuple):
        return column(given, name, counts)
    if not isinstance(given, (tuple, list)) or len(given) != 2:
        raise InputError(f"{name} is for two lists here; give a pair, ({name} of a, {name} of b)")
    ends = (f"{name} of a", f"{name} of b")
    return np.concatenate([column(of, end, count) for of, end, count in zip(given, ends, counts)])


def _column(given, name, count):
    """Return the entries of a keyword of a filter: one for each box, or one for all, or None for the default."""
    keyword = name.split()[0]
    if given is None:
        given = _DEFAULTS[keyword]
    if keyword != "fixed":
        array = _whole(given, name, count, True)
        outside = (array < 0) | (array > 0xFFFFFFFF)
        if outside.any():
            index = int(np.argmax(outside))
            raise InputError(f"{name} of box {index} is {array.flat[index]}; give 32 bits, 0 to 4294967295")
        array = array.astype(np.uint32, copy=False)
    else:
        array = _array(given, name)
        array = array.astype(bool) if array.shape == (0,) else array
        if array.ndim > 1 or array.dtype.kind != "b":
            raise InputError(
                f"{name} has shape {array.shape} and dtype {array.dtype}; give True or False for each box"
            )
        _check_length(array, name, count)
    return np.ascontiguousarray(np.broadcast_to(array, array.shape if count is None else (count,)))


def memberships(counts, groups, masks, owner, fixed):
    """Return groups, masks, owner and fixed: None, or an array with one entry for each box."""
    given = {"groups": groups, "masks": masks, "owner": owner, "fixed": fixed}
    if counts is None:
        counts = next((len(of) for of in given.values() if np.ndim(of) > 0), None)
        if counts is None:
            raise InputError("each keyword has a single number; give one of them an entry for each box")
    return tuple(None if of is None else _joined(of, name, counts, _column) for name, of in given.items())


def worlds(given, counts):
    """Return the world of each box as int64."""
    of = lambda given, name, count: np.ascontiguousarray(_whole(given, name, count), np.int64)
    return np.ascontiguousarray(_joined(given, "worlds", counts, of))
