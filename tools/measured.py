#!/usr/bin/env python3
"""Stores what a benchmark measured, for `tools/results.sh`.

    tools/measured.py note FILE COMMAND SAMPLES    # where and when results/FILE was measured: here and now
    tools/measured.py python OUTPUT                # the times that `tools/python.sh bench` printed

Needs Python 3.8 only.
"""

import csv
import datetime
import os
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
RESULTS = ROOT / "results"


def read_python(path):
    """Keeps the medians of other libraries out of what `tools/python.sh bench` printed."""
    lines = pathlib.Path(path).read_text(encoding="utf-8").splitlines()
    objects, found = None, []
    for line in lines:
        head = re.match(r"(\d+) boxes of `uniform`", line)
        entry = re.match(r"  (.+?): ([\d.]+) (ms|µs)", line)
        objects = head[1] if head else objects
        if entry and objects:
            found.append([objects, entry[1], f"{float(entry[2]) / (1 if entry[3] == 'ms' else 1000):.3g}"])
    assert found, f"{path} has no times"
    with open(RESULTS / "python.csv", "w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows([["objects", "contestant", "median_ms"], *found])


def note(name, command, samples):
    """Writes down where and when a file was measured."""
    cpu = re.search(r"model name\s*: (.*)", pathlib.Path("/proc/cpuinfo").read_text())
    commit = subprocess.run(
        ["git", "rev-parse", "--short=8", "HEAD"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    with open(RESULTS / "provenance.csv", newline="", encoding="utf-8") as file:
        known = [row for row in csv.DictReader(file) if row["file"] != name]
    machine = f"{cpu[1] if cpu else 'unknown'} ({len(os.sched_getaffinity(0))} cores)"
    known.append(
        dict(zip(known[0], [name, machine, str(datetime.date.today()), commit.stdout.strip(), samples, command]))
    )
    with open(RESULTS / "provenance.csv", "w", newline="", encoding="utf-8") as file:
        out = csv.DictWriter(file, known[0], lineterminator="\n")
        out.writeheader()
        out.writerows(sorted(known, key=lambda row: row["file"]))


{"note": note, "python": read_python}[sys.argv[1]](*sys.argv[2:])
