"""Reports as tables: one row for each algorithm, scenario and number of boxes."""

import json
from pathlib import Path

import numpy as np

from ._errors import InputError

#: Columns of text and of counts. All others hold floats.
_TEXT = (
    *("file", "host", "cpu", "simd", "hypervisor", "profile", "label", "date", "scenario", "algorithm", "method"),
    *("backend", "gpus", "error"),
)
_COUNTS = ("threads", "revision", "objects", "pairs", "samples")


def read_report(path):
    """Read the timings of one report.

    Parameters
    ----------
    path : path
        A file of the form ``report/3``, as ``sapwise probe --out`` writes it.

    Returns
    -------
    pandas.DataFrame or numpy.recarray
        One row for each algorithm, scenario and number of boxes; a record array with the same names where pandas is not
        installed. ``file``; ``host`` (all profiles of one host share it), ``cpu``, ``simd``, ``hypervisor``;
        ``profile`` (the restriction), ``label``, ``date``; ``scenario``, ``objects`` and ``pairs`` (counts),
        ``axis_candidates``, ``strip_candidates``, ``moved``, ``moved_share`` (the load); ``algorithm``, ``method``, ``backend``,
        ``threads`` (of the CPU; 0 on GPUs), ``revision``; ``median_ns``, ``q25_ns``, ``q75_ns`` (of the time of a
        frame, nanoseconds), ``samples``, ``foreign_load`` (0 to 1), ``error``, ``gpus``; and a column for each hardware
        parameter with its unit in its name. Unknown values are NaN, or an empty text.

    Raises
    ------
    InputError
        The file is no such report; the text says what to do.
    OSError
        It can't be read.

    Notes
    -----
    ``datasets/README.md`` describes each column. Quartiles are interpolated linearly between samples.
    """
    return _table(_rows(Path(path)))


def read_reports(folder):
    """Read the timings of all reports in a folder, each as ``read_report`` does, one below the other.

    Parameters
    ----------
    folder : path
        Each ``*.json`` in it and in folders in it whose schema is ``report/...`` is read, in the order of the paths.

    Returns
    -------
    pandas.DataFrame or numpy.recarray
        As of ``read_report``.

    Raises
    ------
    InputError
        There is no report in it, or one that can't be read: the text names the file.
    OSError
        A file can't be read.

    Examples
    --------
    The time over the number of boxes for each algorithm, on each host:

    >>> table = sapwise.read_reports("datasets")  # doctest: +SKIP
    >>> table = table[(table.scenario == "uniform") & (table.profile == "full")]  # doctest: +SKIP
    >>> table.pivot_table(index="objects", columns=["host", "algorithm"], values="median_ns")  # doctest: +SKIP
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise InputError(f"{folder} is no folder; read_report reads one file")
    rows = []
    for path in sorted(folder.rglob("*.json")):
        rows.extend(_rows(path, among_others=True))
    if not rows:
        raise InputError(f"{folder} holds no report; `sapwise probe --out {folder}/report.json` makes one")
    return _table(rows)


def _rows(path, among_others=False):
    """Return one dict for each timing of a file."""
    try:
        report = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as why:
        raise InputError(f"{path} is no JSON: {why}") from why
    schema = report.get("schema") if isinstance(report, dict) else None
    if not (isinstance(schema, str) and schema.startswith("report/")):
        if among_others:
            return []
        raise InputError(f"{path} is no report, its schema is {schema!r}; `sapwise probe --out` makes one")
    if schema.split("/")[1].split(".")[0] != "3":
        raise InputError(f"{path} is {schema}, and only report/3 can be read; measure again with `sapwise probe --out`")
    try:
        return list(_timings(path, report))
    except (KeyError, TypeError, ValueError, OverflowError, IndexError, AttributeError) as why:
        raise InputError(f"{path} lacks what {schema} must have ({why!r}); `sapwise check {path}` says what") from why


def _timings(path, report):
    hardware, machine = report["hardware"], report["hardware"]["machine"]
    parameters = {p["name"]: np.nan if p["value"] is None else float(p["value"]) for p in hardware["parameters"]}
    revisions = {a["id"]: a["revision"] for a in report["algorithms"]}
    of_file = _typed({
        "file": f"{path.parent.name}/{path.name}",
        "host": _host(machine, parameters),
        "cpu": machine["cpu"],
        "simd": machine["simd"],
        "hypervisor": machine["hypervisor"],
        "profile": _profile(report),
        "label": report["label"],
        "date": report["provenance"]["date"],
        "gpus": ", ".join(of["gpu"]["name"] for of in hardware.get("gpus", [])),
    })
    for point in report["points"]:
        load = point["load"]
        of_point = _typed({
            "scenario": point["scenario"],
            "objects": load["objects"],
            "pairs": point["pairs"],
            "axis_candidates": load["axis_candidates"],
            "strip_candidates": load["strip_candidates"],
            "moved": load["moved"],
            "moved_share": load["moved_share"],
            "foreign_load": point["foreign_load"],
        })
        for timing in point["timings"]:
            name = timing["algorithm"]
            method, _, backend = name.partition("@")
            low, median, high = _quartiles(timing["samples_ns"])
            of_timing = _typed({
                "algorithm": name,
                "method": method,
                "backend": backend,
                "threads": int(backend[3:]) if backend.startswith("cpu") else 0,
                "revision": revisions.get(name, 0),
                "median_ns": median,
                "q25_ns": low,
                "q75_ns": high,
                "samples": len(timing["samples_ns"]),
                "error": timing.get("error"),
            })
            yield {**of_file, **of_point, **of_timing, **parameters}


def _typed(row):
    """Return a row with values of the types of its columns. Raises TypeError, ValueError or OverflowError."""
    return {name: _value(name, value) for name, value in row.items()}


def _value(name, value):
    if name in _COUNTS:
        return np.int64(int(value))
    if name not in _TEXT:
        return np.nan if value is None else float(value)
    if not isinstance(value, (str, type(None))):
        raise TypeError(f"{name} is {value!r}, not a text")
    return value or ""


def _host(machine, parameters):
    """Return the id of a host: the CPU and its caches, and in a guest the clock of its hypervisor in MHz."""
    clock = parameters.get("clock_reported_ghz", np.nan)
    if machine["hypervisor"] in ("", "none") or np.isnan(clock):
        return machine["physical_id"]
    return f"{machine['physical_id']}-{1000 * clock:.0f}"


def _profile(report):
    """Return the restriction, as in ``avx2-1t``; ``full`` without any."""
    simd, threads = report["provenance"]["simd"], report["provenance"]["threads"]
    gpus = "software-gpus" if report["label"] == "real_software_gpu" else None
    return "-".join(part for part in (gpus, simd, threads and f"{threads}t") if part) or "full"


def _quartiles(samples):
    if not samples:
        return np.nan, np.nan, np.nan
    ordered, last = sorted(samples), len(samples) - 1

    def at(share):
        below = int(share * last)
        above = min(below + 1, last)
        return ordered[below] + (share * last - below) * (ordered[above] - ordered[below])

    return at(0.25), at(0.5), at(0.75)


def _table(rows):
    """Return a data frame of dicts, or a record array without pandas."""
    names = list(dict.fromkeys(name for row in rows for name in row))
    columns = {name: _column(name, [row.get(name) for row in rows]) for name in names}
    try:
        import pandas
    except ImportError:
        if not names:
            return np.recarray(0, dtype=[("file", "U1")])
        return np.rec.fromarrays(list(columns.values()), names=names)
    return pandas.DataFrame(columns)


def _column(name, values):
    if name in _COUNTS:
        return np.array(values, np.int64)
    if name in _TEXT or any(isinstance(value, str) for value in values):
        return np.array(["" if value is None else value for value in values], dtype=np.str_)
    return np.array([np.nan if value is None else value for value in values], np.float64)
