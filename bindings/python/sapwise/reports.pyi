from os import PathLike
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas

# A numpy.recarray with the same names where pandas is not installed.
def read_report(path: str | PathLike[str]) -> pandas.DataFrame: ...
def read_reports(folder: str | PathLike[str]) -> pandas.DataFrame: ...
def _table(rows: list[dict[str, Any]]) -> pandas.DataFrame: ...
