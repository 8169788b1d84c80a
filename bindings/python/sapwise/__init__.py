"""Finds the overlapping pairs of axis-aligned boxes, with the algorithm that is fastest on this machine for this frame.

``Space`` holds bodies with handles, their pairs and queries. ``pairs`` and ``pairs_between`` take NumPy arrays of
boxes. ``BroadPhase`` is for consecutive arrays. ``predict`` returns the expected fastest algorithm for each number of
boxes, ``probe`` measures the hardware, and ``read_report`` and ``read_reports`` return measured timings as data frames.
"""

from ._errors import (
    ConversionWarning,
    InputError,
    InvalidBoxError,
    InvalidRayError,
    RoundingWarning,
    SapwiseError,
    StaleHandleError,
    TooManyPairsError,
)
from ._sapwise import (
    BroadPhase,
    Decision,
    Space,
    Tuning,
    View,
    __version__,
    last_decision,
    pairs,
    pairs_between,
    predict,
)
from .measuring import probe, probe_report
from .reports import read_report, read_reports

__all__ = [
    "BroadPhase",
    "ConversionWarning",
    "Decision",
    "InputError",
    "InvalidBoxError",
    "InvalidRayError",
    "RoundingWarning",
    "SapwiseError",
    "Space",
    "StaleHandleError",
    "TooManyPairsError",
    "Tuning",
    "View",
    "__version__",
    "last_decision",
    "pairs",
    "pairs_between",
    "predict",
    "probe",
    "probe_report",
    "read_report",
    "read_reports",
]
