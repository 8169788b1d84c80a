"""`predict`, `probe` and `probe_report`."""

import json
import os
import pickle
import sys

import numpy as np
import pytest
from conftest import ROOT, cubes

import sapwise


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("cache")


@pytest.fixture(scope="module")
def tuning(folder):
    return sapwise.predict(cache=folder)


def test_a_prediction_tells_fields_crossovers_and_costs(tuning):
    assert tuning.source == "predicted" and tuning.setup["origin"] == "probed" and tuning.model
    methods = {name.split("@")[0] for name in tuning.algorithms}
    assert methods >= {"brute", "pair-cache"}
    froms = [at for at, _ in tuning.fields]
    assert froms[0] == 0 and froms == sorted(froms) and len(tuning.crossovers) == len(froms) - 1
    for crossover, (at, name) in zip(tuning.crossovers, tuning.fields[1:]):
        assert crossover["above"] == name
        # Where no interval is claimed it has no ends.
        assert crossover["low"] is None or crossover["low"] <= crossover["objects"] <= crossover["high"]
    costs = tuning.costs(10_000, pairs=5000, axis_candidates=2e6, strip_candidates=1e5)
    assert set(costs) == set(tuning.algorithms) and list(costs.values()) == sorted(costs.values())
    assert costs["brute@cpu1"] > costs["pair-cache@cpu1"] > 1e4
    assert tuning.costs(20, pairs=3)["brute@cpu1"] < tuning.costs(20, pairs=3)["pair-cache@cpu1"]
    assert "predicted" in repr(tuning)


def test_the_load_is_estimated_from_boxes(tuning):
    few, many = tuning.costs_of(cubes(1000)), tuning.costs_of(cubes(50_000))
    assert all(many[name] > few[name] for name in few)
    still = tuning.costs_of(cubes(50_000), moved=0.0)
    assert still["pair-cache@cpu1"] < many["pair-cache@cpu1"]
    with pytest.raises(sapwise.InvalidBoxError):
        tuning.costs_of(np.full((3, 6), np.nan, np.float32))
    with pytest.raises(sapwise.InputError, match="negative"):
        tuning.costs(10, pairs=-1)


def test_it_is_kept_and_taken_again(tuning, folder):
    again = sapwise.predict(cache=folder)
    assert again.setup["origin"] == "cached" and again.to_json() == tuning.to_json()
    for wrong in (-1.0, float("inf")):
        with pytest.raises(sapwise.InputError, match="seconds is"):
            sapwise.predict(cache=False, seconds=wrong)


def test_json_goes_there_and_back(tuning):
    text = tuning.to_json()
    assert json.loads(text)["schema"] == "tuning/3"
    assert sapwise.Tuning.from_json(text).to_json() == text
    assert pickle.loads(pickle.dumps(tuning)).to_json() == text
    for damaged in ("{", '{"schema": "report/3"}', text.replace('"revision"', '"version"', 1)):
        with pytest.raises(sapwise.InputError):
            sapwise.Tuning.from_json(damaged)


def test_single_calls_take_what_was_predicted():
    boxes = cubes(3000)
    sapwise.pairs(boxes)
    assert sapwise.last_decision().source == "default"
    sapwise.predict()
    sapwise.pairs(boxes)
    decision = sapwise.last_decision()
    assert decision.source in {"predicted", "learned"} and decision.expected_ns > 0


def test_a_probe_tells_of_each_family():
    told = []
    hardware = sapwise.probe(progress=lambda *of: told.append(of))
    assert [k for k, _, _ in told] == list(range(len(told)))
    assert told[-1][0] == told[-1][1] and "memory" in [w for _, _, w in told]
    names = list(hardware.parameters["name"])
    value = dict(zip(names, hardware.parameters["value"]))
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    assert value["usable_cores"] == cores and value["memory_bytes"] > 1e8
    assert set(hardware.parameters["unit"]) > {"cores", "GHz"}
    systems = {"linux": "linux", "darwin": "macos", "win32": "windows"}
    assert hardware.machine["os"] == systems[sys.platform] and "host" not in hardware.machine
    report = json.loads((ROOT / "datasets/amd-epyc-zen3-2c/full.json").read_text(encoding="utf-8"))
    assert set(names) <= {p["name"] for p in report["hardware"]["parameters"]}


def test_what_progress_raises_ends_a_probe():
    def stop(done, of, what):
        if done == 2:
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        sapwise.probe(progress=stop)


scripts = pytest.mark.skipif(sys.platform == "win32", reason="a script with a #! line is no program here")


def command(tmp_path, body):
    """A program in the place of the command."""
    program = tmp_path / "sapwise"
    program.write_text(f"#!{sys.executable}\nimport shutil, signal, sys, time\n{body}")
    program.chmod(0o755)
    return str(program)


@scripts
def test_a_report_by_the_command(tmp_path):
    example = ROOT / "datasets/amd-epyc-zen3-2c/full.json"
    told = []
    copies = (
        f"print('one\\ntwo', file=sys.stderr)\nshutil.copy({str(example)!r}, sys.argv[3])\n"
        "print(sys.argv[1:], file=sys.stderr)"
    )
    path = tmp_path / "report.json"
    threads = ["--threads", "1"]
    table = sapwise.probe_report(path, progress=told.append, command=command(tmp_path, copies), arguments=threads)
    assert len(table) == len(sapwise.read_report(example))
    assert told[:2] == ["one", "two"] and told[2] == str(["probe", "--out", str(path), "--quick", "--threads", "1"])


@scripts
def test_a_command_that_fails(tmp_path):
    with pytest.raises(sapwise.SapwiseError, match="(?s)status 1.*no cores left"):
        sapwise.probe_report(tmp_path / "r.json", command=command(tmp_path, "sys.exit('no cores left')"))


def test_a_command_that_is_missing(tmp_path):
    with pytest.raises(sapwise.SapwiseError, match="cargo install"):
        sapwise.probe_report(tmp_path / "r.json", command="no-such-sapwise")


@scripts
def test_what_interrupts_a_command_lets_it_end_well(tmp_path):
    # It is told once, and keeps what it has measured.
    body = f"""
def end(*_):
    open({str(tmp_path / 'kept')!r}, 'a').write('kept ')
    sys.exit(1)
signal.signal(signal.SIGINT, end)
print('ready', file=sys.stderr, flush=True)
time.sleep(60)
"""

    def interrupt(line):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sapwise.probe_report(tmp_path / "r.json", command=command(tmp_path, body), progress=interrupt)
    assert (tmp_path / "kept").read_text() == "kept "
