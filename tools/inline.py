#!/usr/bin/env python3
"""Runs the adaptive choice beside every fixed algorithm on this machine and writes results/inline.csv.

    tools/inline.py HOST --report datasets/HOST/full.json --other datasets/amd-epyc-zen3-2c/portable.json

HOST names the rows; those of other hosts stay. Three tunings take part: the prediction of a model, the one measured
here (--report), and another machine's (--other), which is judged from frame 300 on. Runs on the CPU only. Nothing else
should run meanwhile; takes about 15 minutes. SAPWISE names a binary that was built elsewhere.
"""

import argparse
import csv
import datetime
import json
import math
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile

sys.dont_write_bytecode = True
import measured  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parent.parent
TABLE = ROOT / "results/inline.csv"
LEARNED = "300"
TUNINGS = ["predicted", "measured", "other"]
STEADY = ["uniform", "fast", "clustered", "slab", "mixed", "resting", "brownian", "free-fall", "gravity"]
# Scenes whose best algorithm changes: recorded streams and the numbers of objects that swing.
STREAMS = ["level", "fight", "pooled"]


def scenes(streams):
    """Returns name and options of each run that is judged as a whole."""
    for scene in STEADY:
        yield scene, [scene, "--objects", "3000", "--frames", "600"]
        yield f"{scene}-swing", [scene, "--objects", "3000", "--swing", "50", "--frames", "600"]
    yield "uniform-100", ["uniform", "--objects", "100", "--frames", "600"]
    yield "uniform-800", ["uniform", "--objects", "800", "--frames", "600"]
    yield "fragmentation-2000", ["fragmentation", "--objects", "2000"]
    yield "fragmentation-20000", ["fragmentation"]
    yield "clustered-20000-swing", ["clustered", "--swing", "50", "--frames", "600"]
    for name in STREAMS:
        yield name, [str(streams / f"{name}.npy")]


def run(sapwise, options):
    command = [sapwise, "run", *options, "--no-gpus", "--json"]
    return json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)


def row(host, tuning, scene, answer, part):
    fixed = answer["fixed"].get(answer["best_fixed"], {})
    return {
        "host": host,
        "date": datetime.date.today().isoformat(),
        "commit": measured.commit(),
        "tuning": tuning,
        "scene": scene,
        "repeats": answer["repeats"],
        "over_single": f"{part['over_best_fixed']:.4f}",
        "over_windows": f"{part['over_windows']:.4f}",
        "best_single": answer["best_fixed"],
        "median_ms": f"{part['adaptive']['median_ms']:.5f}",
        "p99_ms": f"{part['adaptive']['p99_ms']:.5f}",
        "single_median_ms": f"{fixed.get('median_ms', math.nan):.5f}",
        "single_p99_ms": f"{fixed.get('p99_ms', math.nan):.5f}",
        "switches": part["switches"],
        "explored": part["explored"],
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("host")
    parser.add_argument("--report", required=True, help="report of this machine")
    parser.add_argument("--other", required=True, help="report of another machine")
    parser.add_argument("--predicted", help="tuning by a model that has not seen this machine [default: built-in model]")
    parser.add_argument("--repeats", default="5")
    parser.add_argument("--only", nargs="*", default=[], help="names of scenes")
    parser.add_argument("--tunings", nargs="*", default=TUNINGS, choices=TUNINGS)
    options = parser.parse_args()
    os.chdir(ROOT)
    target = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", "target")) / "release"
    if "SAPWISE" not in os.environ:
        subprocess.run(["cargo", "build", "--quiet", "--release", "-p", "sapwise-cli"], check=True)
    sapwise = os.environ.get("SAPWISE", str(target / "sapwise"))
    rows = []

    def judge(tuning, scene, arguments, more=()):
        if tuning not in options.tunings:
            return
        answer = run(sapwise, [*arguments, "--repeats", options.repeats, *more])
        part = answer["parts"][-1] if "--after" in more else answer
        rows.append(row(options.host, tuning, scene, answer, part))
        print(f"{tuning:10} {scene:24} {rows[-1]['over_single']} {rows[-1]['over_windows']}", flush=True)

    with tempfile.TemporaryDirectory() as folder:
        streams = pathlib.Path(folder)
        example = ["cargo", "run", "--quiet", "--release", "-p", "sapwise-scenes", "--example", "streams", "--", folder]
        subprocess.run(example, check=True)
        chosen = [s for s in scenes(streams) if not options.only or s[0] in options.only]
        for name, arguments in chosen:
            judge("predicted", name, arguments, ["--tuning", options.predicted] if options.predicted else [])
        for name, arguments in chosen:
            if name.startswith(("fragmentation", "clustered")) or name in STREAMS:
                judge("measured", name, arguments, ["--tuning", options.report])
        for name, arguments in chosen:
            if name in ["fragmentation-20000", "clustered-20000-swing", "fight", "gravity"]:
                longer = ["--frames", "1200"] if name != "fight" else []
                arguments = [a for a in arguments if a not in ("--frames", "600")] if longer else arguments
                judge("other", name, [*arguments, *longer], ["--tuning", options.other, "--after", LEARNED])

    kept = []
    if TABLE.exists():
        with TABLE.open(newline="") as file:
            kept = [r for r in csv.DictReader(file) if r["host"] != options.host or r["tuning"] not in options.tunings]
    with TABLE.open("w", newline="") as file:
        table = csv.DictWriter(file, rows[0].keys(), lineterminator="\n")
        table.writeheader()
        table.writerows(kept + rows)
    for tuning in TUNINGS:
        over = [float(r["over_single"]) for r in rows if r["tuning"] == tuning]
        if over:
            mean = math.exp(statistics.fmean(map(math.log, over)))
            print(f"{tuning}, {len(over)} runs over the best single algorithm: mean {mean:.3f}, worst {max(over):.3f}")


if __name__ == "__main__":
    main()
