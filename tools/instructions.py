#!/usr/bin/env python3
"""Counts the instructions of each CPU method on six scenes under callgrind and compares them with tests/instructions.csv.

    tools/instructions.py            # exit status 1, with the names, if a count rose by more than 3 %
    tools/instructions.py --write    # stores today's counts

Counts do not depend on the load or the clock of the machine. Callgrind knows AVX2, not AVX-512. Needs valgrind and x86-64.
"""

import csv
import os
import re
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
STORED = ROOT / "tests" / "instructions.csv"
SCENES = ["uniform", "fast", "clustered", "mixed", "resting", "plates"]
SIMD_LEVELS = ["portable", "avx2"]
MOST_RISE = 0.03


def build():
    subprocess.run(
        ["cargo", "build", "--quiet", "--release", "--locked", "-p", "sapwise", "--example", "instructions"],
        cwd=ROOT, check=True,
    )
    return Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "release/examples/instructions"


def count(program, scene, simd):
    """Returns {method: instructions} of one scene."""
    with tempfile.TemporaryDirectory() as folder:
        run = subprocess.run(
            ["valgrind", "--tool=callgrind", f"--callgrind-out-file={folder}/out",
             "--zero-before=instructions::measured_frames", "--dump-after=instructions::measured_frames", program, scene, simd],
            check=True, capture_output=True, text=True,
        )
        methods = [line.split()[0] for line in run.stdout.splitlines()]
        dumps = [Path(f"{folder}/out.{k}").read_text() for k in range(1, len(methods) + 1)]
        return {m: int(re.search(r"^(?:totals|summary): (\d+)", d, re.M)[1]) for m, d in zip(methods, dumps)}


def main():
    program = build()
    cells = [(simd, scene) for simd in SIMD_LEVELS for scene in SCENES]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        counts = list(pool.map(lambda cell: count(program, cell[1], cell[0]), cells))
    now = {(m, simd, scene): n for (simd, scene), by_method in zip(cells, counts) for m, n in by_method.items()}
    if sys.argv[1:] == ["--write"]:
        with STORED.open("w", newline="") as file:
            rows = csv.writer(file, lineterminator="\n")
            rows.writerow(["method", "simd", "scene", "instructions"])
            rows.writerows([*key, now[key]] for key in sorted(now))
        return 0
    with STORED.open() as file:
        stored = {(r["method"], r["simd"], r["scene"]): int(r["instructions"]) for r in csv.DictReader(file)}
    missing = stored.keys() ^ now.keys()
    if missing:
        print(f"{STORED.name} and this build name other cells, such as {sorted(missing)[0]}; run tools/instructions.py --write")
        return 1
    ratios = {key: now[key] / stored[key] for key in stored}
    risen = {key: ratio for key, ratio in ratios.items() if ratio > 1 + MOST_RISE}
    for key, ratio in sorted(risen.items()):
        print(f"{' '.join(key)}: {now[key]} instructions, {ratio - 1:+.1%}")
    low, high = min(ratios, key=ratios.get), max(ratios, key=ratios.get)
    print(f"{len(ratios)} counts: {ratios[low] - 1:+.2%} ({' '.join(low)}) to {ratios[high] - 1:+.2%} ({' '.join(high)})")
    return 1 if risen else 0


sys.exit(main())
