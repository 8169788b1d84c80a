from os import PathLike
from typing import TYPE_CHECKING, Callable, NamedTuple, Sequence

if TYPE_CHECKING:
    import pandas

class Hardware(NamedTuple):
    machine: dict[str, str]
    # A numpy.recarray with the same names where pandas is not installed.
    parameters: pandas.DataFrame

def probe(quick: bool = True, progress: Callable[[int, int, str], object] | None = None) -> Hardware: ...
def probe_report(
    path: str | PathLike[str],
    quick: bool = True,
    progress: Callable[[str], object] | None = None,
    command: str = "sapwise",
    arguments: Sequence[str] = (),
) -> pandas.DataFrame: ...
