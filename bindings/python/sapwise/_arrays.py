"""Converts the arrays of callers for the compiled half."""

import warnings

import numpy as np

from ._errors import ConversionWarning, InputError

#: The most boxes that 32 bits can name.
_MOST = 2**32 - 1
#: Fewest boxes for a warning about a copy.
_WORTH_A_WARNING = 10_000
#: Integers up to this are exact as 64-bit floats.
_EXACT = 2**53
_SHAPE = "give shape (n, 6), minx miny minz maxx maxy maxz a row, or lower and upper corners of shape (n, 3) each"

_has_warned = False


def _warn(count, why):
    global _has_warned
    if count < _WORTH_A_WARNING or _has_warned:
        return
    _has_warned = True
    text = f"{count} boxes were copied: {why}. C-contiguous float32 of shape (n, 6) is read in place. Warned once."
    warnings.warn(text, ConversionWarning, stacklevel=3)


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
        why = "they are 64-bit floats, which are rounded to 32 bits"
    elif not (array.flags.c_contiguous and array.flags.aligned):
        why = "they are not C-contiguous" if array.flags.aligned else "they are not aligned"
    else:
        why = None
    return np.require(array, dtype=wanted, requirements=["C", "A"]), why


def boxes(given, upper, which):
    """Return one array of shape (n, 6), or a tuple of two of shape (n, 3), all float32 or all float64."""
    name = f"the list{which}" if which else "boxes"
    if upper is None:
        array = _array(given, name)
        if array.shape == (0,):
            return np.empty((0, 6), np.float32)
        if array.ndim == 3 and array.shape[1:] == (2, 3):
            flat = True
        elif array.ndim == 2 and array.shape[1] == 6:
            flat = False
        else:
            hint = ""
            if array.ndim == 2 and array.shape[1] == 3:
                hint = "these are lower corners alone; "
            elif array.ndim == 2 and array.shape[0] == 6:
                hint = "these are columns, transpose them; "
            raise InputError(f"{name} has shape {array.shape}: {hint}{_SHAPE}")
        _check_count(len(array))
        floats, why = _floats(array, name, which)
        if why:
            _warn(len(array), why)
        return floats.reshape(-1, 6) if flat else floats
    corners = [_array(given, "boxes (the lower corners)"), _array(upper, "upper")]
    if any(c.shape == (0,) for c in corners) and all(c.size == 0 for c in corners):
        return np.empty((0, 6), np.float32)
    for corner, name in zip(corners, ("boxes (the lower corners)", "upper")):
        if corner.ndim != 2 or corner.shape[1] != 3:
            raise InputError(f"{name} has shape {corner.shape}: {_SHAPE}")
    lower, upper = corners
    if len(lower) != len(upper):
        raise InputError(f"there are {len(lower)} lower and {len(upper)} upper corners; give one of each for each box")
    _check_count(len(lower))
    lower, why_lower = _floats(lower, "boxes (the lower corners)", which)
    upper, why_upper = _floats(upper, "upper", which)
    if why_lower or why_upper:
        _warn(len(lower), why_lower or why_upper)
    if lower.dtype != upper.dtype:
        lower, upper = lower.astype(np.float64, copy=False), upper.astype(np.float64, copy=False)
    return lower, upper


def _check_count(count):
    if count > _MOST:
        raise InputError(f"{count} boxes are more than the {_MOST} that 32 bits can number; split the scene")


def _whole(given, name, count):
    """Return an array of whole numbers, of any length if `count` is None."""
    array = _array(given, name)
    if array.shape == (0,):
        array = array.astype(np.int64)
    if array.ndim != 1 or array.dtype.kind not in "iu":
        raise InputError(f"{name} has shape {array.shape} and dtype {array.dtype}; give one whole number for each box")
    if count is not None and len(array) != count:
        raise InputError(f"{name} has {len(array)} entries and there are {count} boxes; give one for each box")
    return array


def ids(given, count):
    """Return ids as int64."""
    array = _whole(given, "ids", count)
    most = np.iinfo(np.int64).max
    if array.dtype.kind == "u" and array.size and array.max() > most:
        index = int(np.argmax(array > most))
        raise InputError(f"the id of box {index} does not fit into 63 bits; number the boxes anew")
    return np.ascontiguousarray(array, np.int64)


def _bits(given, name, count):
    """Return 32 bits for each box."""
    if given is None:
        return np.full(count, 0xFFFFFFFF, np.uint32)
    array = _whole(given, name, count)
    outside = (array < 0) | (array > 0xFFFFFFFF)
    if outside.any():
        index = int(np.argmax(outside))
        raise InputError(f"{name} of box {index} is {array[index]}; give 32 bits, 0 to 4294967295")
    return np.ascontiguousarray(array, np.uint32)


def memberships(groups, masks, fixed):
    """Return groups, masks and fixed, each with one entry a box."""
    if fixed is not None:
        fixed = _array(fixed, "fixed")
        if fixed.shape == (0,):
            fixed = fixed.astype(bool)
        if fixed.ndim != 1 or fixed.dtype.kind != "b":
            raise InputError(f"fixed has shape {fixed.shape} and dtype {fixed.dtype}; give True or False for each box")
    given = next(of for of in (groups, masks, fixed) if of is not None)
    count = len(np.atleast_1d(_array(given, "groups, masks or fixed")))
    if fixed is None:
        fixed = np.zeros(count, bool)
    elif len(fixed) != count:
        raise InputError(f"fixed has {len(fixed)} entries and groups or masks {count}; give one for each box")
    return _bits(groups, "groups", count), _bits(masks, "masks", count), np.ascontiguousarray(fixed)
