#!/usr/bin/env python3
"""Regret of tunings on reports: a second implementation of `crates/lab/src/evaluate/regret_table.rs`, for blind tests of a model.

    sapwise predict --report datasets/HOST/full.json --json > tunings/HOST/full.json     # for each report
    tools/reference/regret.py tunings datasets/HOST/full.json ...

Prints for each report the mean regret over all cells and, in parentheses, weighted as in games, in percent: of the tuning of the same
name, of its physical terms without the residual, and, for a report whose name ends in `-again`, of the best choice in the report that it
repeats: the noise floor. Skips reports with algorithms on GPUs. Needs Python 3.8 only.
"""

import json
import math
import pathlib
import statistics
import sys

NOT_TIMED = 10.0
FEWEST_SAMPLES = 3


def read(path):
    """Returns the points of a report: scenario, load, median of each algorithm; none if an algorithm is on a GPU."""
    report = json.loads(pathlib.Path(path).read_text())
    if any("@gpu" in a["id"] for a in report["algorithms"]):
        return None
    points = []
    for point in report["points"]:
        sound = [t for t in point["timings"] if t.get("error") is None and len(t["samples_ns"]) >= FEWEST_SAMPLES]
        medians = {t["algorithm"]: statistics.median(t["samples_ns"]) for t in sound}
        points.append((point["scenario"], point["load"], medians))
    return points


def table(points):
    """Returns for each cell, a scenario and a quarter of a decade, its loads and the cost of each algorithm over the least."""
    cells = {}
    for scenario, load, medians in points:
        cells.setdefault((scenario, round(4 * math.log10(max(load["objects"], 1)))), []).append((load, medians))
    costs = {at: ln_costs(of_cell) for at, of_cell in cells.items()}
    algorithms = {a for _, _, medians in points for a in medians}

    def over_best(scenario, quarter, algorithm):
        for near in (quarter, quarter - 1, quarter + 1):
            known = costs.get((scenario, near), {})
            if algorithm in known:
                return math.exp(known[algorithm] - min(known.values()))
        return NOT_TIMED

    return {
        at: ([load for load, _ in of_cell], {a: over_best(*at, a) for a in algorithms}) for at, of_cell in cells.items()
    }


def ln_costs(of_cell):
    """Splits the logarithms of times into a part of the algorithm and one of the point, and returns the former."""
    shared, costs = [0.0] * len(of_cell), {}
    for _ in range(8):
        lists = {}
        for (_, medians), of_point in zip(of_cell, shared):
            for algorithm, ns in medians.items():
                lists.setdefault(algorithm, []).append(math.log(ns) - of_point)
        costs = {a: statistics.fmean(values) for a, values in lists.items()}
        shared = [statistics.fmean(math.log(ns) - costs[a] for a, ns in m.items()) if m else 0.0 for _, m in of_cell]
    return costs


def regret(cells, choose):
    """Returns the mean over the cells, and the same weighted as in games, in percent."""
    pairs = []
    for (scenario, quarter), (loads, over_best) in cells.items():
        chosen = [over_best.get(choose(scenario, quarter, load), NOT_TIMED) - 1 for load in loads]
        pairs.append((statistics.fmean(chosen), math.exp(-(((quarter / 4 - 2.9) / 0.55) ** 2) / 2)))
    weighted = sum(r * w for r, w in pairs) / sum(w for _, w in pairs)
    return 100 * statistics.fmean(r for r, _ in pairs), 100 * weighted


def coordinates(load, octaves):
    n = max(load["objects"], 1)
    return (
        min(max(math.log2(n), octaves[0]), octaves[1]) / 3,
        math.log2(load["pairs"] / n + 0.05) / 3,
        math.log2(load["strip_candidates"] / n + 1) / 4,
        math.log2(load["axis_candidates"] / n + 1) / 6,
        math.log2(load["moved"] + 0.005) / 2.5,
    )


def residual(weights, by_motion, places, load):
    """Returns the logarithm of the residual, as `src/cost/residual.rs` does."""
    if not weights:
        return 0.0
    sizes = [math.log2(max(p["objects"], 1)) for p in places]
    octaves = (min(sizes), max(sizes))
    count = 5 if by_motion else 4
    at = coordinates(load, octaves)[:count]
    distances = (sum((a - b) ** 2 for a, b in zip(at, coordinates(p, octaves))) for p in places)
    return sum(w * (1 + d / 32) ** -16 for w, d in zip(weights, distances))


def work_ns(tuning, k, load, corrected):
    """Returns nanoseconds on one thread, or on GPUs."""
    work = tuning["works"][k]
    n = load["objects"]
    counts = dict(load, call=1, all_pairs=n * (n - 1) / 2, sort=n * math.log2(max(n, 1)))
    counts.update(moved=n * load["moved"], moved_share=n * load["moved_share"])
    counts["cold_objects"] = n * max(0.0, 1 - work["cache_bytes"] / max(64 * n, 1))
    ns = sum(t["unit_ns"] * counts[t["term"]] for t in work["terms"])
    if work["fallback"]:
        ns = min(ns, work["fallback"]["factor"] * work_ns(tuning, work["fallback"]["work"], load, corrected))
    weights = work.get("residual", []) if corrected else []
    return ns * math.exp(residual(weights, work["residual_by_motion"], tuning.get("places", []), load))


def cost(tuning, algorithm, load, corrected):
    """Returns nanoseconds of an algorithm, as `src/cost.rs` does."""
    ns = work_ns(tuning, algorithm["work"], load, corrected)
    helpers = algorithm["helpers"]
    if helpers:
        called, most = helpers["threads"] - 1, helpers["threads"] - 1
        if helpers["boxes_per_thread"]:
            called = min(max(load["objects"] // helpers["boxes_per_thread"], 1), helpers["threads"]) - 1
        if called > 0:
            speed_up = 1 + called / most * (helpers["speed_up"] - 1)
            ns = called / most * helpers["call_ns"] + min(ns, (ns + helpers["late_ns"]) / speed_up)
    correction = algorithm["residual"] if corrected else None
    if correction:
        places = tuning.get("places", [])
        ns *= math.exp(correction["constant"] + residual(correction["weights"], correction["by_motion"], places, load))
    return ns


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    tunings = pathlib.Path(sys.argv[1])
    print(f"{'report':<48} {'tuning':>15} {'terms alone':>15} {'floor':>15}")
    for path in map(pathlib.Path, sys.argv[2:]):
        points = read(path)
        if points is None:
            continue
        cells, columns = table(points), ["-"] * 3
        name = f"{path.parent.name}/{path.name}"
        tuning = tunings / name
        if tuning.is_file():
            held = json.loads(tuning.read_text())
            for column, corrected in enumerate((True, False)):

                def cheapest(_scenario, _quarter, load):
                    return min(held["costs"], key=lambda a: cost(held, a, load, corrected))["algorithm"]

                columns[column] = "%.1f (%.1f)" % regret(cells, cheapest)
        first = path.with_name(path.name.replace("-again", ""))
        if first != path and first.is_file():
            known = table(read(first))

            def known_best(scenario, quarter, _load):
                over_best = known[scenario, quarter][1]
                return min(over_best, key=over_best.get)

            shared = {at: cell for at, cell in cells.items() if at in known}
            columns[2] = "%.2f (%.2f)" % regret(shared, known_best)
        print(f"{name:<48} {columns[0]:>15} {columns[1]:>15} {columns[2]:>15}")


if __name__ == "__main__":
    main()
