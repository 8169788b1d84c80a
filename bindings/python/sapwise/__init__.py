"""Sapwise finds the overlapping pairs of axis-aligned boxes, with whichever algorithm is fastest on this machine for this frame.

``pairs`` and ``pairs_between`` take NumPy arrays of boxes. ``BroadPhase`` is for frames that follow each other. ``predict`` tells which
algorithm is expected to be fastest from how many boxes on, ``probe`` measures the hardware, and ``read_report`` and ``read_reports`` make data
frames of measured timings.
"""

from ._errors import ConversionWarning, InputError, InvalidBoxError, SapwiseError, TooManyPairsError
from ._sapwise import BroadPhase, Decision, Tuning, __version__, last_decision, pairs, pairs_between, predict
from .measuring import probe, probe_report
from .reports import read_report, read_reports

__all__ = [
    "BroadPhase",
    "ConversionWarning",
    "Decision",
    "InputError",
    "InvalidBoxError",
    "SapwiseError",
    "TooManyPairsError",
    "Tuning",
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
