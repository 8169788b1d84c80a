"""The exceptions and warnings of the package."""

import warnings
from typing import Any


class SapwiseError(RuntimeError):
    """The base of all exceptions of the package; by itself, a failure that is no fault of the arguments."""


class InputError(SapwiseError, ValueError):
    """An argument can't be used; the text says what to give instead."""


class _IndexedError(InputError):
    """An element of an argument can't be used."""

    def __init__(self, text: str, index: int) -> None:
        super().__init__(text)
        self.index = index

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.args[0], self.index)


class InvalidBoxError(_IndexedError):
    """A box that can't be ordered: a bound is NaN, or a minimum lies above its maximum.

    Attributes
    ----------
    index : int
        Position of the first such box.
    """


class InvalidRayError(_IndexedError):
    """A ray, a motion or a point that can't be searched: it is not finite, or its direction is zero.

    Attributes
    ----------
    index : int
        Position of the first one.
    """


class StaleHandleError(_IndexedError):
    """A handle that names no body of the space: the body was removed, or is of another space.

    Not every handle of another space raises it: spaces number their bodies alike, so it may name a body of this one.

    Attributes
    ----------
    index : int
        Position of the first such handle.
    """


class TooManyPairsError(SapwiseError, MemoryError):
    """More pairs overlap than the limit allows.

    Attributes
    ----------
    limit : int
        The limit.
    """

    def __init__(self, text: str, limit: int) -> None:
        super().__init__(text)
        self.limit = limit

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.args[0], self.limit)


class ConversionWarning(UserWarning):
    """Many boxes were copied because they don't have the layout that the library reads; raised once in a process."""


class RoundingWarning(UserWarning):
    """Boxes were rounded outward to 32-bit floats, which may add pairs; raised once in a process."""


def warn_unsaved(why: str) -> None:
    """Warn that what was learned is lost."""
    warnings.warn(f"what was learned is not kept: {why}", RuntimeWarning, stacklevel=2)
