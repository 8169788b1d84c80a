#!/usr/bin/env python3
"""Notes where and when a benchmark measured, for `tools/results.sh`.

    tools/measured.py FILE COMMAND SAMPLES    # where and when results/FILE was measured: here and now
    tools/measured.py --study                 # what was made from all reports, and from which

Needs Python 3.8 only.
"""

import csv
import datetime
import hashlib
import json
import os
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
RESULTS = ROOT / "results"


def here():
    cpu = re.search(r"model name\s*: (.*)", pathlib.Path("/proc/cpuinfo").read_text())
    return f"{cpu[1] if cpu else 'unknown'} ({len(os.sched_getaffinity(0))} cores)"


def commit():
    """The commit that is checked out."""
    return subprocess.check_output(["git", "rev-parse", "--short=8", "HEAD"], cwd=ROOT, encoding="utf-8").strip()


def note(name, command, samples, machine=None):
    """Writes down where and when a file was measured."""
    with open(RESULTS / "provenance.csv", newline="", encoding="utf-8") as file:
        known = [row for row in csv.DictReader(file) if row["file"] != name]
    known.append(
        dict(zip(known[0], [name, machine or here(), str(datetime.date.today()), commit(), samples, command]))
    )
    with open(RESULTS / "provenance.csv", "w", newline="", encoding="utf-8") as file:
        out = csv.DictWriter(file, known[0], lineterminator="\n")
        out.writeheader()
        out.writerows(sorted(known, key=lambda row: row["file"]))


def study():
    """Notes what `sapwise study` made, with the hash of the model of the same reports: `results.py` compares it."""
    model = (ROOT / "models/default.json").read_bytes()
    trained = json.loads(model)["training"]
    hosts = f"the {trained['validation']['physical_machines']} hosts of datasets/"
    reports = f"n = {len(trained['trained_on'])} reports"
    for name in ("influence.csv", "regrets.csv"):
        note(name, "tools/results.sh influence", reports, hosts)
    drawn = f"{reports}; model {hashlib.sha256(model).hexdigest()[:8]}"
    host = re.search(r"(\S+)/\S+: fastest", (ROOT / "pictures/field-map.svg").read_text(encoding="utf-8"))
    note("field-map.svg", "tools/results.sh influence", drawn, host[1])


if __name__ == "__main__":
    if sys.argv[1:] == ["--study"]:
        study()
    else:
        note(*sys.argv[1:])
