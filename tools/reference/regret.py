#!/usr/bin/env python3
"""Regret on reports: a second implementation of `crates/lab/src/evaluate/`, for blind tests of a model.

    sapwise predict --report datasets/HOST/full.json --json > tunings/HOST/full.json     # for each report
    tools/reference/regret.py tunings datasets/HOST/full.json ...
    tools/reference/regret.py --fixed datasets/*/*.json

The first form prints for each report the mean regret over all cells and, in parentheses, weighted as in games, in
percent: of the tuning of the same name, of that among the algorithms that a program runs, of its physical terms without
the residual, and, for a report whose name ends in `-again`, of the best choice in the report that it repeats: the noise
floor. Algorithms on GPUs are left out. A tuning may be that of another machine: all threads stand for all threads.

The second form holds out each host in turn and prints the regret of the role that loses least on the others: a method
on one thread, or on all of them. First on seen scenarios, then with each scenario held out too. Without GPUs if no
other host has a real one. Needs Python 3.8 only.
"""

import json
import math
import pathlib
import re
import statistics
import sys

NOT_TIMED = 10.0
FEWEST_SAMPLES = 3
# Fits without a host and a scenario, at most: of many hosts each is held out in some scenarios only.
MOST_UNSEEN = 80
REPLACED = ("sap", "grid-sap", "bvh")


def read(path):
    """Returns a report and its points: scenario, load, median of each algorithm."""
    report = json.loads(pathlib.Path(path).read_text(encoding="utf-8"))
    points = []
    for point in report["points"]:
        sound = [t for t in point["timings"] if t.get("error") is None and len(t["samples_ns"]) >= FEWEST_SAMPLES]
        medians = {t["algorithm"]: statistics.median(t["samples_ns"]) for t in sound}
        if medians:
            points.append((point["scenario"], point["load"], medians))
    return report, points


def is_judged(report):
    """Whether its timings on the CPU count. A software adapter between two frames takes the CPU's caches and cores."""
    return bool(report["points"]) and report["label"] not in ("published", "real_software_gpu", "real_contended")


def without_gpus(points):
    on_cpu = [(scenario, load, {a: ns for a, ns in m.items() if "@cpu" in a}) for scenario, load, m in points]
    return [point for point in on_cpu if point[2]]


def host(report):
    """What tells hosts apart: the CPU with its caches and, in a guest, the clock that the hypervisor reports."""
    machine = report["hardware"]["machine"]
    clocks = [p for p in report["hardware"]["parameters"] if p["name"] == "clock_reported_ghz"]
    guest = machine["hypervisor"] not in ("", "none") and clocks and clocks[0]["value"] is not None
    return machine["physical_id"] + (f"-{1000 * clocks[0]['value']:.0f}" if guest else "")


def table(points):
    """Returns the loads of each cell, a scenario and a quarter of a decade, and the ratio of each algorithm to the best."""
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
    return mean_of(regrets(cells, choose))


def regrets(cells, choose):
    """Returns the regret of each cell with its weight in games."""
    pairs = []
    for (scenario, quarter), (loads, over_best) in cells.items():
        chosen = [over_best.get(choose(scenario, quarter, load), NOT_TIMED) - 1 for load in loads]
        pairs.append((statistics.fmean(chosen), math.exp(-(((quarter / 4 - 2.9) / 0.55) ** 2) / 2)))
    return pairs


def mean_of(pairs):
    weighted = sum(r * w for r, w in pairs) / sum(w for _, w in pairs)
    return 100 * statistics.fmean(r for r, _ in pairs), 100 * weighted


def cells_of(cells, wanted):
    return {at: cell for at, cell in cells.items() if wanted(at[0])}


def parts(algorithm):
    """Returns the method, the class of processor, and the number of threads or GPUs."""
    method, kind, width = re.fullmatch(r"(.*)@(cpu|gpu)(.*)", algorithm).groups()
    return method, kind, int(width) if kind == "cpu" else len(width.split("+"))


def of_role(role, algorithms):
    """Returns the algorithm that is a method on one thread, or on all, among those of a machine."""
    method, kind, on_all = role
    alike = [a for a in algorithms if parts(a)[:2] == (method, kind)]
    if not on_all:
        return next((a for a in alike if parts(a)[2] == 1), None)
    return max(alike, key=lambda a: parts(a)[2], default=None)


def of_another(costs, algorithms):
    """Returns the costs of a machine by the algorithms of another: all threads for all, fewer for the same number."""
    theirs, found = {c["algorithm"]: c for c in costs}, {}
    for algorithm in theirs:
        method, kind, width = parts(algorithm)
        own = of_role((method, kind, True), algorithms)
        if width > 1 and algorithm == of_role((method, kind, True), theirs) and own and parts(own)[2] > 1:
            found[own] = theirs[algorithm]
    taken = {c["algorithm"] for c in found.values()}
    for algorithm, cost_of_it in theirs.items():
        if algorithm in algorithms and algorithm not in taken:
            found.setdefault(algorithm, cost_of_it)
    return found


def running(costs):
    """Returns the costs of what a program runs unless it asks for others, as `Tuning::for_running` does."""
    known = {c["algorithm"] for c in costs}
    on_cpu = [a for a in known if parts(a)[1] == "cpu"]
    replaced = {a: f"pair-cache@{a.split('@')[1]}" for a in on_cpu if parts(a)[0] in REPLACED}
    replaced.update((a, "brute@cpu1") for a in on_cpu if parts(a)[0] == "brute" and a != "brute@cpu1")
    if not any(a.startswith("bvh@") for a in replaced) or not known.issuperset(replaced.values()):
        return costs
    return [c for c in costs if c["algorithm"] not in replaced]


def fixed(paths):
    """Prints the regret of always choosing one role, on each host held out."""
    hosts, real_gpu = {}, set()
    for path in paths:
        report, points = read(path)
        if not is_judged(report):
            continue
        key = host(report)
        timed = [a["id"] for a in report["algorithms"]]
        if any("@gpu" in a for a in timed):
            real_gpu.add(key)
        hosts.setdefault(key, []).append((points, table(points), timed))
    hosts = dict(sorted(hosts.items()))
    scenarios = sorted({scenario for own in hosts.values() for points, *_ in own for scenario, *_ in points})
    step = math.ceil(len(hosts) * len(scenarios) / MOST_UNSEEN)
    sums = []
    for position, (held, own) in enumerate(hosts.items()):
        others = [reports for key, reports in hosts.items() if key != held]
        # The columns: over all sizes and in games, on seen scenarios and on unseen ones.
        of_reports = []
        for points, cells, _ in own:
            if not real_gpu - {held}:
                points = without_gpus(points)
                cells = table(points)
            available = {a for _, _, medians in points for a in medians}
            of_reports.append(regret(cells, always(others, available, lambda _: True)))
            unseen = []
            for turn, scenario in enumerate(scenarios):
                if position % step == turn % step:
                    choose = always(others, available, lambda s: s != scenario)
                    unseen += regrets(cells_of(cells, lambda s: s == scenario), choose)
            of_reports[-1] += mean_of(unseen)
        sums.append([statistics.fmean(column) for column in zip(*of_reports)])
        print_row(held, sums[-1])
    print_row("single best", [statistics.fmean(column) for column in zip(*sums)])


def always(others, available, wanted):
    """Returns a choice: always the role that loses least on the other hosts."""
    means = {}
    for reports in others:
        of_host = {}
        for _, cells, timed in reports:
            kept = cells_of(cells, wanted)
            for role in {(*parts(a)[:2], on_all) for a in available for on_all in (False, True)}:
                algorithm = of_role(role, timed)
                if algorithm is not None:
                    of_host.setdefault(role, []).append(regret(kept, lambda *_: algorithm)[0])
        for role, values in of_host.items():
            means.setdefault(role, []).append(statistics.fmean(values))
    best = min(sorted(means), key=lambda role: statistics.fmean(means[role]))
    chosen = of_role(best, available)
    return lambda *_: chosen


def print_row(name, numbers):
    print(f"{name:<48} {numbers[0]:>8.3f} {numbers[1]:>8.3f} {numbers[2]:>8.3f} {numbers[3]:>8.3f}")


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
    if sys.argv[1:2] == ["--fixed"] and len(sys.argv) > 3:
        return fixed(map(pathlib.Path, sys.argv[2:]))
    if len(sys.argv) < 3 or sys.argv[1].startswith("-"):
        sys.exit(__doc__)
    tunings = pathlib.Path(sys.argv[1])
    print(f"{'report':<48} {'tuning':>15} {'running':>15} {'terms alone':>15} {'floor':>15}")
    for path in map(pathlib.Path, sys.argv[2:]):
        report, points = read(path)
        if not is_judged(report):
            continue
        points = without_gpus(points)
        cells, columns = table(points), ["-"] * 4
        name = f"{path.parent.name}/{path.name}"
        tuning = tunings / name
        if tuning.is_file():
            held = json.loads(tuning.read_text(encoding="utf-8"))
            timed = {a for _, _, medians in points for a in medians}
            shown = ((held["costs"], True), (running(held["costs"]), True), (held["costs"], False))
            for column, (costs, corrected) in enumerate(shown):
                known = of_another(costs, timed)

                def cheapest(_scenario, _quarter, load):
                    return min(known, key=lambda a: cost(held, known[a], load, corrected))

                columns[column] = "%.1f (%.1f)" % regret(cells, cheapest)
        first = path.with_name(path.name.replace("-again", ""))
        if first != path and first.is_file():
            known_cells = table(without_gpus(read(first)[1]))

            def known_best(scenario, quarter, _load):
                over_best = known_cells[scenario, quarter][1]
                return min(over_best, key=over_best.get)

            shared = {at: cell for at, cell in cells.items() if at in known_cells}
            columns[3] = "%.2f (%.2f)" % regret(shared, known_best)
        print(f"{name:<48} " + " ".join(f"{column:>15}" for column in columns))


if __name__ == "__main__":
    main()
