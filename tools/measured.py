#!/usr/bin/env python3
"""Notes where and when a benchmark measured, for `tools/results.sh`.

    tools/measured.py FILE COMMAND SAMPLES    # where and when results/FILE was measured: here and now

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


note(*sys.argv[1:])
