#!/usr/bin/env python3
"""Regret of tunings on reports, by a program of its own: a check of `lab/src/evaluate/regret_table.rs`, and of a model on reports that came after it.

    sapwise predict --report R.json --samples 0 --json > tunings/R.json     # for each report
    tools/reference/regret.py tunings R.json ...

Prints for each report the mean regret over all cells and as in games, in percent, of the tuning of the same name, of its physical terms alone
(without the correction), and of the best of each cell itself where the name of the report ends in `-again`: the noise floor. Reports that hold
algorithms on GPUs are left out. Needs Python 3.8 and nothing else.
"""

import json
import math
import pathlib
import statistics
import sys

NOT_TIMED = 10.0
FEWEST_SAMPLES = 3


def read(path):
    """Points of a report: scenario, load, median of each algorithm; none where an algorithm is on a GPU."""
    report = json.loads(pathlib.Path(path).read_text())
    if any("@gpu" in a["id"] for a in report["algorithms"]):
        return None
    points = []
    for point in report["points"]:
        sound = [t for t in point["timings"] if t["error"] is None and len(t["samples_ns"]) >= FEWEST_SAMPLES]
        medians = {t["algorithm"]: statistics.median(t["samples_ns"]) for t in sound}
        points.append((point["scenario"], point["load"], medians))
    return points


def table(points):
    """For each cell, a scenario and a quarter of a decade: its loads, and for each algorithm its cost over the least."""
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
    """The algorithms' part of logarithms that are the sum of a part of the algorithm and one of the point."""
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
    """Mean over the cells, and weighted as games are assumed to have that number of objects; percent."""
    pairs = []
    for (scenario, quarter), (loads, over_best) in cells.items():
        chosen = [over_best.get(choose(scenario, quarter, load), NOT_TIMED) - 1 for load in loads]
        pairs.append((statistics.fmean(chosen), math.exp(-(((quarter / 4 - 2.9) / 0.55) ** 2) / 2)))
    weighted = sum(r * w for r, w in pairs) / sum(w for _, w in pairs)
    return 100 * statistics.fmean(r for r, _ in pairs), 100 * weighted


def cost(curve, load, corrected):
    """Nanoseconds by a curve of a tuning, as `src/cost.rs` has it."""
    n = load["objects"]
    octaves = math.log2(max(n, 1))
    counts = dict(load, call=1, all_pairs=n * (n - 1) / 2, sort=n * octaves, moved=n * load["moved"])
    counts["cold_objects"] = n * max(0.0, 1 - curve["cache_bytes"] / max(64 * n, 1))

    def total(terms):
        return sum(t["unit_ns"] * counts[t["term"]] for t in terms)

    ns = total(curve["terms"])
    if curve.get("fallback_terms"):
        ns = min(ns, total(curve["fallback_terms"]))
    knots = [(k["log2_objects"], k["ln_factor"]) for k in curve.get("correction", [])] if corrected else []
    if not knots:
        return ns
    if octaves <= knots[0][0] or octaves >= knots[-1][0]:
        return ns * math.exp(knots[0 if octaves <= knots[0][0] else -1][1])
    (x0, y0), (x1, y1) = next(pair for pair in zip(knots, knots[1:]) if octaves < pair[1][0])
    return ns * math.exp(y0 + (octaves - x0) / (x1 - x0) * (y1 - y0))


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
        tuning = tunings / path.name
        if tuning.is_file():
            costs = json.loads(tuning.read_text())["costs"]
            for column, corrected in enumerate((True, False)):

                def cheapest(_scenario, _quarter, load):
                    return min(costs, key=lambda c: cost(c["curve"], load, corrected))["algorithm"]

                columns[column] = "%.1f (%.1f)" % regret(cells, cheapest)
        first = path.with_name(path.name.replace("-again", ""))
        if first != path and first.is_file():
            known = table(read(first))

            def known_best(scenario, quarter, _load):
                over_best = known[scenario, quarter][1]
                return min(over_best, key=over_best.get)

            shared = {at: cell for at, cell in cells.items() if at in known}
            columns[2] = "%.2f (%.2f)" % regret(shared, known_best)
        print(f"{path.name:<48} {columns[0]:>15} {columns[1]:>15} {columns[2]:>15}")


if __name__ == "__main__":
    main()
