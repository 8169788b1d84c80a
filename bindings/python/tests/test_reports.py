"""Reports as tables: against the files themselves, with pandas and without."""

import json
import statistics
import subprocess
import sys

import numpy as np
import pytest
from conftest import ROOT

import sapwise

DATASETS = ROOT / "datasets"
ONE = DATASETS / "amd-epyc-zen3-2c/full.json"

try:
    import pandas
except ImportError:
    pandas = None


def rows(table):
    """The rows of either kind of table as dicts."""
    if pandas is not None:
        return table.to_dict("records")
    return [dict(zip(table.dtype.names, row.tolist())) for row in table]


def test_a_row_for_each_timing_with_the_figures_of_the_file():
    report = json.loads(ONE.read_text(encoding="utf-8"))
    found = rows(sapwise.read_report(ONE))
    timings = [(point, timing) for point in report["points"] for timing in point["timings"]]
    assert len(found) == len(timings) > 1000
    parameters = {p["name"]: p["value"] for p in report["hardware"]["parameters"]}
    for row, (point, timing) in zip(found, timings):
        assert (row["scenario"], row["algorithm"]) == (point["scenario"], timing["algorithm"])
        load = point["load"]
        assert (row["objects"], row["pairs"]) == (load["objects"], point["pairs"])
        assert (row["moved"], row["moved_share"]) == (load["moved"], load["moved_share"])
        samples = timing["samples_ns"]
        assert row["samples"] == len(samples)
        if len(samples) > 1:
            quartiles = statistics.quantiles(samples, n=4, method="inclusive")
            assert [row["q25_ns"], row["median_ns"], row["q75_ns"]] == pytest.approx(quartiles, rel=1e-12)
        for name, value in parameters.items():
            assert row[name] == value or (value is None and np.isnan(row[name]))
        assert f"{row['method']}@{row['backend']}" == row["algorithm"] and row["threads"] in (1, 2)
    assert {row["profile"] for row in found} == {"full"} and {row["label"] for row in found} == {"real_full"}
    mhz = format(1000 * parameters["clock_reported_ghz"], ".0f")
    assert {row["host"] for row in found} == {"766bf9a6ff86e150-" + mhz}


def test_all_reports_and_their_hosts():
    table = sapwise.read_reports(DATASETS)
    files = [f for f in sorted(DATASETS.rglob("*.json")) if json.loads(f.read_text(encoding="utf-8"))["points"]]
    assert len(np.unique(table["file"].astype(str))) == len(files)
    # One CPU model and one clock of the hypervisor are one host.
    known = set()
    for hardware in (json.loads(f.read_text(encoding="utf-8"))["hardware"] for f in files):
        clock = next(p["value"] for p in hardware["parameters"] if p["name"] == "clock_reported_ghz")
        known.add((hardware["machine"]["physical_id"], round(1000 * clock)))
    assert len(np.unique(table["host"].astype(str))) == len(known) >= 2
    expected = sum(len(p["timings"]) for f in files for p in json.loads(f.read_text(encoding="utf-8"))["points"])
    assert len(table) == expected


def test_gpus_and_restrictions():
    found = rows(sapwise.read_report(DATASETS / "amd-epyc-zen3-2c/two-gpus.json"))
    on_gpus = [row for row in found if row["backend"].startswith("gpu")]
    assert on_gpus and all(row["threads"] == 0 for row in on_gpus) and "SwiftShader" in found[0]["gpus"]
    table = sapwise.read_reports(DATASETS / "amd-epyc-zen3-2c")
    assert set(table["profile"].astype(str)) >= {"full", "portable", "1t", "software-gpus"}


@pytest.mark.skipif(pandas is None, reason="pandas is not installed")
def test_time_over_the_number_of_boxes_in_three_lines():
    table = sapwise.read_reports(DATASETS)
    table = table[(table.scenario == "uniform") & (table.profile == "full")]
    times = table.pivot_table(index="objects", columns=["host", "algorithm"], values="median_ns")
    assert times.shape[0] > 10 and len(times.columns.levels[0]) >= 1
    for column in times:
        # To find the pairs of more boxes takes longer.
        known = times[column].dropna()
        assert known.iloc[-1] > known.iloc[0]


@pytest.mark.parametrize(
    "text, why",
    [
        ("{", "no JSON"),
        ("[]", "no report"),
        ('{"schema": "tuning/3"}', "schema is 'tuning/3'"),
        ('{"schema": "report/2"}', "sapwise probe"),
        ('{"schema": "report/3"}', "lacks"),
        ('{"schema": "report/3", "hardware": 3}', "lacks"),
        ("\x00\xff", "no JSON"),
    ],
)
def test_files_that_are_no_reports(tmp_path, text, why):
    path = tmp_path / "file.json"
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(sapwise.InputError, match=why) as error:
        sapwise.read_report(path)
    assert "file.json" in str(error.value)


@pytest.mark.parametrize(
    "place, wrong",
    [
        ("points 0 timings 0 algorithm", "bvh@cpuX"),
        ("points 0 timings 0 algorithm", 7),
        ("points 0 timings 0 samples_ns 0", "fast"),
        ("points 0 load objects", "many"),
        ("points 0 load objects", 1e30),
        ("points 0 load moved", {}),
        ("points 0 pairs", None),
        ("points 0 foreign_load", [1]),
        ("points 0 scenario", []),
        ("algorithms 0 revision", "new"),
        ("hardware parameters 0 value", "big"),
        ("hardware machine cpu", 5),
    ],
)
def test_values_of_another_type_name_the_file(tmp_path, place, wrong):
    report = json.loads(ONE.read_text(encoding="utf-8"))
    report["points"] = report["points"][:1]
    *outer, last = [int(key) if key.isdigit() else key for key in place.split()]
    of = report
    for key in outer:
        of = of[key]
    of[last] = wrong
    path = tmp_path / "file.json"
    path.write_text(json.dumps(report), encoding="utf-8")
    with pytest.raises(sapwise.InputError, match="file.json lacks"):
        sapwise.read_report(path)


def test_folders(tmp_path):
    with pytest.raises(sapwise.InputError, match="holds no report"):
        sapwise.read_reports(tmp_path)
    (tmp_path / "tuning.json").write_text('{"schema": "tuning/3"}')
    with pytest.raises(sapwise.InputError, match="holds no report"):
        sapwise.read_reports(tmp_path)
    (tmp_path / "a.json").write_bytes(ONE.read_bytes())
    assert len(sapwise.read_reports(tmp_path)) == len(sapwise.read_report(ONE))
    (tmp_path / "b.json").write_text("{")
    with pytest.raises(sapwise.InputError, match="b.json"):
        sapwise.read_reports(tmp_path)
    with pytest.raises(sapwise.InputError, match="is no folder"):
        sapwise.read_reports(ONE)
    with pytest.raises(FileNotFoundError):
        sapwise.read_report(tmp_path / "missing.json")


def test_a_point_without_samples_is_not_a_number(tmp_path):
    report = json.loads(ONE.read_text(encoding="utf-8"))
    report["points"] = report["points"][:1]
    report["points"][0]["timings"] = [{"algorithm": "brute@cpu1", "samples_ns": [], "error": "it was lost"}]
    (tmp_path / "one.json").write_text(json.dumps(report))
    (row,) = rows(sapwise.read_report(tmp_path / "one.json"))
    assert np.isnan(row["median_ns"]) and row["error"] == "it was lost" and row["profile"] == "full"


def test_without_pandas_it_is_a_record_array():
    script = f"""
import sys
sys.modules['pandas'] = None
import numpy as np, sapwise
table = sapwise.read_report({str(ONE)!r})
assert isinstance(table, np.recarray), type(table)
some = table[(table.scenario == 'uniform') & (table.algorithm == 'bvh@cpu1')]
assert len(some) > 5 and (some.median_ns > 0).all() and some.objects.dtype == np.int64
print(len(table))
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert int(done.stdout) == len(sapwise.read_report(ONE))
