#!/usr/bin/env python3
"""Renders results/*.csv into results/*.md and splices tables and sentences from them into the documents.

    tools/results.py            # writes
    tools/results.py --check    # compares; for CI

A document has blocks between `<!--NAME-->` and `<!--/NAME-->`; a number of a measurement stands nowhere else. Captions
come from results/provenance.csv. `tools/results.sh` measures. Needs Python 3.8 only.
"""

import collections
import csv
import hashlib
import json
import pathlib
import re
import statistics
import sys

sys.dont_write_bytecode = True
import bars  # noqa: E402
from cells import digits, geometric_mean, size, table  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parent.parent
RESULTS = ROOT / "results"
H200 = "NVIDIA H200"


def rows(name):
    with open(RESULTS / name, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def caption(name, link=""):
    """Machine, date, commit, number of samples and command of a file."""
    known = next(row for row in rows("provenance.csv") if row["file"] == name)
    file = f"[{name}]({link}results/{name})" if link is not None else f"[{name}]({name})"
    command = f"`{known['command']}`; " if known["command"] else ""
    return f"{known['machine']}; {known['date']}; commit {known['commit']}; {known['samples']}; {command}{file}."


def short_caption(name, page):
    known = next(row for row in rows("provenance.csv") if row["file"] == name)
    return f"{known['machine']}; {known['date']} ([commit, samples, command](results/{page}))."


# --- Peers


def peers():
    """Each cell on one thread: rows by contestant, and the ratio to the fastest peer."""
    cells = {}
    for row in rows("peers.csv"):
        if row["threads"] == "1":
            cell = cells.setdefault((row["scenario"], int(row["objects"])), {"ratio": None})
            cell[row["contestant"]] = row
            if row["peer_over_adaptive"]:
                cell["ratio"] = float(row["peer_over_adaptive"])
    return cells


def least(cell, family):
    times = [float(row["median_ms"]) for name, row in cell.items() if name != "ratio" and name.startswith(family)]
    return digits(min(times)) if times else "-"


SCENES = ("uniform", "fast", "clustered", "tower")


def readme_peers():
    cells = peers()
    body = []
    for scenario in SCENES:
        cell = cells[scenario, 10_000]
        times = [least(cell, family) for family in ("adaptive", "parry3d", "obvhs", "rstar")]
        body.append([f"`{scenario}`", *times, digits(cell["ratio"], 2)])
    text = table(["scene", "Sapwise", "parry3d", "obvhs", "rstar", "× fastest peer"], body)
    ratios = {key: cell["ratio"] for key, cell in cells.items() if cell["ratio"]}
    many = [ratio for (_, n), ratio in ratios.items() if n >= 1000]
    few = [ratio for (_, n), ratio in ratios.items() if n == 100]
    behind = sorted({f"`{scene}`" for (scene, n), ratio in ratios.items() if n >= 1000 and ratio < 1})
    worst = min((ratio, scene) for (scene, n), ratio in ratios.items() if n == 100)
    ahead = [sum(ratio > 1 for ratio in ratios) for ratios in (many, few)]
    return text + (
        f"\nFrom 1000 boxes on, it is {geometric_mean(many):.1f}× as fast as the fastest peer (geometric mean) "
        f"and ahead in {ahead[0]} of {len(many)} cases; the rest: {', '.join(behind)}. "
        f"At 100 boxes it is {geometric_mean(few):.1f}× as fast and ahead in {ahead[1]} of {len(few)}; "
        f"worst is `{worst[1]}` ({digits(worst[0], 2)}).\n"
    )


def picture_of_peers():
    cells = peers()
    families = {"Sapwise": "adaptive", "parry3d": "parry3d", "obvhs": "obvhs", "rstar": "rstar"}
    groups = {
        scenario: {name: least(cells[scenario, 10_000], family) for name, family in families.items()}
        for scenario in SCENES
    }
    return bars.picture("Milliseconds a frame, 10 000 boxes, one thread; the best mode of each crate", groups)


def page_of_peers():
    cells = peers()
    sizes = [100, 1000, 10_000, 100_000]
    body = []
    for scenario in dict.fromkeys(scenario for scenario, _ in cells):
        ratios = [cells.get((scenario, n), {}).get("ratio") for n in sizes]
        kept = cells.get((scenario, 10_000), {}).get("pair-cache@cpu1", {})
        p50, p99 = kept.get("tail_p50_ms"), kept.get("tail_p99_ms")
        body.append(
            [scenario, *(digits(r) if r else "-" for r in ratios), digits(float(p99) / float(p50)) if p99 else "-"]
        )
    return (
        "# Beside peers\n\nTime of the fastest peer over that of `adaptive`, one thread, by boxes; "
        "median over frames. "
        "p99: over median of `pair-cache`, 10 000.\n\n"
        + table(["scenario", *map(size, sizes), "p99"], body)
        + "\n"
        + few_frames(cells)
        + "\n"
        + caption("peers.csv", None)
        + "\n"
    )


def few_frames(cells):
    """How many frames the large cells have, and which cells are missing."""
    least_of = lambda cell: min(int(row["frames"]) for name, row in cell.items() if name != "ratio")
    counts = collections.Counter(least_of(cell) for (_, n), cell in cells.items() if n >= 100_000)
    frames, most = counts.most_common(1)[0]
    missing = [f"`{scene}` at {size(n)}" for (scene, n), cell in cells.items() if not cell["ratio"]]
    return (
        f"From 100 000 boxes on, {most} of {sum(counts.values())} cells have {frames} frames. "
        f"No ratio: {', '.join(missing)}.\n"
    )


# --- GPUs


def gpu_rows():
    """The rows of today's card by objects, algorithm and memory."""
    return {(int(r["objects"]), r["algorithm"], r["memory"]): r for r in rows("gpu.csv") if r["card"] == H200}


def gpu_times():
    """Their medians."""
    return {at: float(row["median_ms"]) for at, row in gpu_rows().items()}


GPU_COLUMNS = [
    ("grid-sap@cpu16", "host"),
    ("grid-sap@gpu0", "host"),
    ("grid-sap@gpu0", "device"),
    ("bvh@gpu0", "device"),
]


def gpu_table():
    times = gpu_times()
    sizes = sorted({n for n, _, _ in times})
    body = [
        [
            size(n),
            *(digits(times[(n, *column)]) if (n, *column) in times else "-" for column in GPU_COLUMNS),
            frames_of_gpu(n),
        ]
        for n in sizes
    ]
    head = ["objects", "`grid-sap`, 16 cores", "GPU, from host", "GPU, resident", "`bvh` on the GPU, resident", "n"]
    over = [[times[(n, *GPU_COLUMNS[0])] / times[(n, *GPU_COLUMNS[k])] for n in sizes if n >= 100_000] for k in (1, 2)]
    speed = [f"{digits(min(o), 2)} to {digits(max(o), 2)}×" for o in over]
    return (
        table(head, body)
        + f"\nFrom 100 000 objects on, the GPU is {speed[0]} as fast from host memory; resident, {speed[1]}.\n\n"
        + caption("gpu.csv")
        + "\n"
    )


def frames_of_gpu(objects):
    """The frames behind a row of the table: of the CPU, and of the GPU if that has others."""
    known = gpu_rows()
    counts = [known[(objects, *column)]["frames"] for column in GPU_COLUMNS]
    return "; ".join(dict.fromkeys(counts))


def gpu_sentence():
    times = gpu_times()
    million = [digits(times[(1_000_000, *column)], 2) for column in GPU_COLUMNS[:3]]
    return (
        f"A million boxes of `uniform` take `grid-sap` {million[0]} ms on 16 cores, {million[1]} ms on an H200, "
        f"and {million[2]} ms there "
        "[without transfers](BENCHMARKS.md#on-a-gpu).\n"
    )


PARTS = {
    "search (`count`)": ["count"],
    "pairs (`positions`, `write`)": ["positions", "write"],
    "copies and clears": ["copies before, clears", "copies after"],
    "recording and submitting": ["CPU: recording", "CPU: submitting"],
    "resident frame without timestamps": ["wall without timestamps"],
}
# Sums, and waits that overlap with the GPU.
NO_PARTS = ["GPU", "wall", "CPU: preparing", "CPU: waiting", "CPU: the rest"]


def gpu_dispatches():
    times = {}
    for row in rows("gpu-dispatches.csv"):
        if row["method"] == "grid-sap":
            times.setdefault((int(row["objects"]), row["memory"]), {})[row["part"]] = float(row["us"])
    sizes = sorted({n for n, _ in times})
    named = [part for parts in PARTS.values() for part in parts]
    keys = [sum(us for part, us in times[n, "device"].items() if part not in named + NO_PARTS) for n in sizes]
    body = [["keys and sort", *(size(round(us)) for us in keys)]]
    body += [
        [label, *(size(round(sum(times[n, "device"][part] for part in parts))) for n in sizes)]
        for label, parts in PARTS.items()
    ]
    body.append(
        [
            "from host memory, without timestamps",
            *(size(round(times[n, "host"]["wall without timestamps"])) for n in sizes),
        ]
    )
    return table(["part, µs", *map(size, sizes)], body) + "\n" + caption("gpu-dispatches.csv", "../") + "\n"


def gpu_peers():
    names = {
        "grid-sap@gpu0": "`grid-sap`",
        "bvh@gpu0": "`bvh`",
        "kitten-pool": "KittenGpuLBVH",
        "cubql": "cuBQL",
        "cupy-grid": "grid in CuPy",
    }
    times = {(int(r["objects"]), r["contestant"]): r["median_ms"] for r in rows("gpu-peers.csv")}
    sizes = sorted({n for n, _ in times})
    body = [[size(n), *(digits(times[n, name]) if (n, name) in times else "-" for name in names)] for n in sizes]
    ours = {n: float(times[n, "grid-sap@gpu0"]) for n in sizes}
    over = [min(float(times[n, name]) for name in names if "gpu0" not in name) / ours[n] for n in sizes]
    sentence = (
        f"The fastest of the others takes {digits(min(over), 2)} to {digits(max(over), 2)}× the time of `grid-sap`.\n"
    )
    return table(["boxes", *names.values()], body) + "\n" + sentence + "\n" + caption("gpu-peers.csv", "../") + "\n"


def page_of_gpu():
    return "# On a GPU\n\nMedian ms of a frame of `uniform`.\n\n" + gpu_table().replace("(results/", "(")


# --- Running programs


def inline_table():
    groups = {}
    for row in rows("inline.csv"):
        groups.setdefault((row["host"], row["tuning"]), []).append(row)
    body = []
    for (host, tuning), runs in groups.items():
        single, oracle = ([float(r[key]) for r in runs] for key in ("over_single", "over_windows"))
        worst = max(runs, key=lambda r: float(r["over_single"]))
        body.append(
            [
                f"{host}, {runs[0]['date']}, {runs[0]['commit']}",
                tuning,
                len(runs),
                f"{geometric_mean(single):.3f}",
                f"{float(worst['over_single']):.2f} (`{worst['scene']}`)",
                f"{geometric_mean(oracle):.3f}",
            ]
        )
    return table(["host", "tuning", "runs", "× single", "worst", "× oracle"], body) + on_the_same_scenes(groups)


def on_the_same_scenes(groups):
    """The predicted tuning on the scenes of each other tuning: the rows have different scenes."""
    told = []
    for (host, tuning), runs in groups.items():
        scenes = {r["scene"] for r in runs}
        same = [float(r["over_single"]) for r in groups[host, "predicted"] if r["scene"] in scenes]
        if tuning != "predicted":
            told.append(f"{host}, `{tuning}`: {geometric_mean(same):.3f}")
    return f"\n`predicted` over the same scenes: {'; '.join(told)}.\n"


def inline_sentence():
    hosts = {}
    for row in rows("inline.csv"):
        if row["tuning"] == "predicted":
            hosts.setdefault(row["host"], {})[row["scene"]] = float(row["over_single"])
    means = sorted(geometric_mean(list(runs.values())) for runs in hosts.values())
    ratio, worst = max((ratio, scene) for runs in hosts.values() for scene, ratio in runs.items())
    return (
        f"- A running program takes {means[0]:.2f} to {means[-1]:.2f}× the time of the best single algorithm in "
        f"hindsight ({len(hosts)} machines; at worst {ratio:.2f}×, `{worst}`; "
        "[details](docs/methodology.md#in-a-running-program)).\n"
    )


def page_of_inline():
    return "# In a running program\n\n" + inline_table() + "\n" + caption("inline.csv", None) + "\n"


# --- Machines held out


def strategies():
    """The table of strategies: those of earlier models as they are stored, and those of the built-in model."""
    model = json.loads((ROOT / "models/default.json").read_text(encoding="utf-8"))
    validation = model["training"]["validation"]
    kept = [row for row in rows("strategies.csv") if row["model"] != model["name"]]
    percent = lambda value: "" if value is None else f"{100 * value:.1f}"
    for method in validation["methods"]:
        unseen = (method.get("unseen_scenario") or {}).get("all") or {}
        kept.append(
            {
                "model": model["name"],
                "commit": "this one",
                "hosts": str(validation["physical_machines"]),
                "strategy": method["name"],
                "unseen_percent": percent(unseen.get("all")),
                "unseen_games_percent": percent(unseen.get("in_games")),
                "seen_percent": percent(method["mean_regret"]),
                "seen_games_percent": percent(method["mean_regret_in_games"]),
            }
        )
    noise = validation["floor"]
    for strategy, of in (("floor", noise["cells"]["all"]), ("another run's full sweep", noise["full_sweep"]["all"])):
        row = dict.fromkeys(kept[0], "")
        row.update(
            model=model["name"],
            commit="this one",
            hosts=str(validation["physical_machines"]),
            strategy=strategy,
            seen_percent=percent(of["all"]),
            seen_games_percent=percent(of["in_games"]),
        )
        kept.append(row)
    return kept, model["name"]


def ranges_of_hosts():
    """The least and the largest regret of a host in an unseen scenario, by strategy, in percent."""
    hosts = {}
    for row in rows("regrets.csv"):
        if row["unseen_share"]:
            hosts.setdefault(row["strategy"], []).append(100 * float(row["unseen_share"]))
    own = {row["strategy"]: row["unseen_percent"] for row in strategies()[0]}
    for strategy, regrets in hosts.items():
        mean = f"{statistics.mean(regrets):.1f}"
        assert mean == own[strategy], f"regrets.csv is of another model: {strategy} {mean}, not {own[strategy]}"
    return {strategy: (f"{min(regrets):.1f}", f"{max(regrets):.1f}") for strategy, regrets in hosts.items()}


def map_sentence():
    known = next(row for row in rows("provenance.csv") if row["file"] == "field-map.svg")
    return f"{known['machine']}, held out; {known['date']}.\n"


def stale_map():
    """Why the map of the README is older than the model, if it is."""
    known = next(row for row in rows("provenance.csv") if row["file"] == "field-map.svg")
    model = hashlib.sha256((ROOT / "models/default.json").read_bytes()).hexdigest()[:8]
    if not known["samples"].endswith(f"model {model}"):
        return "pictures/field-map.svg is older than models/default.json; `tools/results.sh influence` draws it"
    return None


SHOWN = {
    "single best": "one fixed algorithm",
    "physics + load": "Sapwise's prediction",
    "physics + load (running)": "in programs, before learning",
}


# The host whose reports time every method; the others lack `pair-cache` above SSE2.
COMPLETE = "amd-epyc-zen5-2c"


def readme_strategies():
    ranges_of_hosts()
    kinds = ("unseen_share", "unseen_in_games_share")

    def lost(strategy, complete):
        own = [r for r in rows("regrets.csv") if r["strategy"] == strategy and (r["folder"] == COMPLETE) == complete]
        return "{:.1f} % ({:.1f})".format(*(100 * statistics.mean(float(r[kind]) for r in own) for kind in kinds))

    body = [[words, lost(strategy, True), lost(strategy, False)] for strategy, words in SHOWN.items()]
    return (
        "Time lost against the best choice (around 800 boxes), unseen machine and scene "
        "([all](results/heldout.md)):\n\n"
        + table(["strategy", "Zen 5", "[three hosts without `pair-cache`](docs/limitations.md#machines)"], body)
    )


def blind(whole):
    """Blind tests with today's algorithms and with older ones: of whole machines, or of profiles with less."""
    less = re.compile(r"\d+t.*|avx2.*|portable.*")
    chosen = [row for row in rows("heldout.csv") if whole != bool(less.fullmatch(row["profile"]))]
    today = [row for row in chosen if "today" in row["model_trained_on"]]
    return today, [row for row in chosen if row not in today]


def regret_of(row):
    return f"{row['regret_all_percent']} ({row['regret_games_percent']})"


def blind_table():
    today, older = blind(whole=True)
    body = [[row[k] for k in ("host", "date", "model_trained_on", "model_commit")] + [regret_of(row)] for row in today]
    ranges = [sorted(float(row[k]) for row in older) for k in ("regret_all_percent", "regret_games_percent")]
    told = "{} earlier whole-machine tests, with the algorithms and models of their day: {} to {} ({} to {}) %.".format(
        len(older), *(end for values in ranges for end in (values[0], values[-1]))
    )
    return table(["host", "date", "model trained on", "its commit", "regret, %"], body) + "\n" + told + "\n"


def page_of_heldout():
    kept, name = strategies()
    ranges = ranges_of_hosts()
    body = []
    for row in kept:
        if row["unseen_percent"] or (row["model"], row["strategy"]) == (name, "floor"):
            cells = [row[k] or "-" for k in ("unseen_percent", "unseen_games_percent", "seen_percent")]
            if row["model"] == name and row["strategy"] in ranges:
                cells[0] += " ({}–{})".format(*ranges[row["strategy"]])
            body.append([row["model"], row["strategy"], *cells])
    judged = [[r["host"], r["profile"], regret_of(r)] for r in blind(whole=False)[0]]
    return (
        "# Machines held out\n\n"
        "[Regret](../docs/methodology.md#regret-and-what-is-held-out) in percent (least–largest "
        "[host](regrets.csv)). `six-hosts`: commit 22f9246. "
        "Three hosts lack [`pair-cache` above SSE2](../docs/limitations.md#machines).\n\n"
        + table(["model", "strategy", "unseen scenario", "~800 boxes", "seen scenario"], body)
        + "\nMeasured after the model:\n\n"
        + table(["host", "profile", "regret (in games)"], judged)
        + "\n"
        + caption("heldout.csv", None)
        + "\n"
    )


# --- What moves a crossover


# How a cell of the column `decided` begins, and what it means.
UNDECIDED = {
    "varies": "the parameter is about the same on all hosts",
    "goes with": "the parameter goes with another one",
    "sign": "the sign rests on one host",
    "1 host": "too few hosts have the crossover",
    "2 hosts": "too few hosts have the crossover",
    "not": "the parameter was not measured everywhere",
}


def influence():
    found = rows("influence.csv")
    body = [
        [
            row["crossover"],
            f"`{row['parameter']}`",
            row["model_octaves"],
            "{data_octaves} ({data_least} to {data_most})".format(**row),
        ]
        for row in found
        if row["decided"] == "yes"
    ]
    why = [row["decided"][len("no: ") :] for row in found if row["decided"] != "yes"]
    reasons = collections.Counter(next(UNDECIDED[k] for k in UNDECIDED if text.startswith(k)) for text in why)
    body += [[f"{count} more", "", "", f"undecided: {reason}"] for reason, count in reasons.most_common()]
    by_model = {}
    for row in found:
        if row["crossover"].endswith("on a GPU"):
            by_model.setdefault(row["parameter"], []).append(float(row["model_octaves"]))
    largest = sorted(by_model, key=lambda name: -abs(statistics.median(by_model[name])))[:3]
    named = ", ".join(f"`{name}` {statistics.median(by_model[name]):+.2f}" for name in largest)
    return (
        table(["crossover", "parameter", "model", "data"], body)
        + f"\nOn crossovers from the CPU to a GPU, which one host has, the model's largest medians are {named}.\n\n"
        + caption("influence.csv", "../")
        + "\n"
    )


# --- Python and other bindings


# In the file only.
LONG = ("sapwise.pairs of float64", "rtree intersection_v")


def python_sentence():
    of = [row for row in rows("python.csv") if (row["what"], row["boxes"]) == ("all pairs", "10000")]
    times = {row["contestant"]: float(row["median_ns"]) / 1e6 for row in of if row["contestant"] not in LONG}
    named = ", ".join(f"{contestant} {time:.3g} ms" for contestant, time in times.items())
    return f"10 000 `uniform` boxes, medians: {named}. {caption('python.csv', '../')}\n"


# Columns that the caption has, or that only the file has.
NOT_SHOWN = (
    "machine", "date", "frames", "steps", "samples", "avian3d", "bullet", "trees_median_ms", "trees_p99_ms",
    "quartile_1_ms", "quartile_3_ms",
)


def shown(name):
    """The rows of a file that compare like with like, without the columns that are not shown, deciles in one cell,
    quartiles behind the median."""
    for row in rows(name):
        # The bodies fall asleep at other steps with each broad phase: medians of awake and of sleeping steps.
        if row.get("scene") == "pile":
            continue
        if "quartile_3_ms" in row:
            row["median_ms"] += " ({quartile_1_ms}–{quartile_3_ms})".format(**row)
        if "p90" in row:
            row["p10"] += f"–{row.pop('p90')}"
        yield {"p10–p90" if k == "p10" else k: v for k, v in row.items() if k not in NOT_SHOWN}


# Pages of several files with the same columns.
TOGETHER = {"web": ("web.csv", "web-probes.csv")}


def small_pages():
    """A table of each small file that was measured."""
    for name in ("sizes", "builds", "memory", "c", "avian", "web"):
        files = [file for file in TOGETHER.get(name, (f"{name}.csv",)) if (RESULTS / file).exists()]
        if files:
            kept = [row for file in files for row in shown(file)]
            captions = "\n".join(caption(file, None) + "\n" for file in files)
            body = table(list(kept[0]), [row.values() for row in kept])
            if name == "avian":
                body += "\n`pile` (file only) sleeps at other steps with each broad phase.\n"
            yield f"{name}.md", f"# {name.capitalize()}\n\n{body}\n{captions}"


def sample():
    return "```text\n" + (RESULTS / "predict.txt").read_text(encoding="utf-8") + "```\n"


def spliced():
    """The blocks of each document."""
    blocks = {
        "README.md": {
            "peers": readme_peers() + "\n" + short_caption("peers.csv", "peers.md") + "\n",
            "gpu": gpu_sentence(),
            "strategies": readme_strategies(),
            "field-map": map_sentence(),
            "predict": sample(),
            "inline": inline_sentence(),
        },
        "BENCHMARKS.md": {"gpu": gpu_table()},
        "docs/gpu.md": {"gpu-dispatches": gpu_dispatches(), "gpu-peers": gpu_peers()},
        "docs/methodology.md": {
            "inline": inline_table() + "\n" + caption("inline.csv", "../") + "\n",
            "blind": blind_table() + "\n" + caption("heldout.csv", "../") + "\n",
            "influence": influence(),
        },
        "docs/python.md": {"python": python_sentence()},
    }
    return blocks


def pages():
    return {
        "peers.md": page_of_peers(),
        "gpu.md": page_of_gpu(),
        "inline.md": page_of_inline(),
        "heldout.md": page_of_heldout(),
        **dict(small_pages()),
    }


def with_blocks(name, text, blocks):
    for block, content in blocks.items():
        pattern = re.compile(rf"(<!--{block}-->\n).*?(<!--/{block}-->)", re.S)
        text, count = pattern.subn(lambda m: m[1] + content + m[2], text)
        assert count == 1, f"{name} has {count} blocks {block}"
    return text


def written():
    """Every generated text by its path."""
    texts = {RESULTS / name: text for name, text in pages().items()}
    texts[ROOT / "pictures/peers.svg"] = picture_of_peers()
    for name, blocks in spliced().items():
        texts[ROOT / name] = with_blocks(name, (ROOT / name).read_text(encoding="utf-8"), blocks)
    kept, _ = strategies()
    lines = [",".join(kept[0])] + [",".join(row.values()) for row in kept]
    texts[RESULTS / "strategies.csv"] = "\n".join(lines) + "\n"
    return texts


def check():
    stale = [path for path, text in written().items() if not path.exists() or path.read_text(encoding="utf-8") != text]
    for path in stale:
        print(f"{path.relative_to(ROOT)} differs from results/*.csv", file=sys.stderr)
    old = stale_map()
    if old:
        sys.exit(old)
    if stale:
        sys.exit("`tools/results.py` writes results/*.md and the blocks of the documents anew")


def main():
    if sys.argv[1:] == ["--check"]:
        check()
    else:
        for path, text in written().items():
            path.write_text(text, encoding="utf-8")


main()
