# %% [markdown]
# A study of the reports in `datasets/`: how long each algorithm takes over the number of boxes on each host, and what
# it costs to choose on one host by the timings of the others.
#
#     python bindings/python/examples/study.py [FOLDER [PICTURE]]

# %%
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import sapwise

folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parents[3] / "datasets"
picture = Path(sys.argv[2]) if len(sys.argv) > 2 else Path("study.png")

# %% Time over the number of boxes, for each algorithm, on all hosts: three lines.
table = sapwise.read_reports(folder)
full = table[(table.profile == "full") & (table.samples > 0)]
times = full[full.scenario == "uniform"].pivot_table(index="objects", columns=["host", "algorithm"], values="median_ns")

# %% A panel for each host, with its parameters as titles.
hosts = full.groupby("host").first()
figure, panels = plt.subplots(1, len(hosts), figsize=(5 * len(hosts), 4.5), sharex=True, sharey=True, squeeze=False)
for panel, (host, parameters) in zip(panels[0], hosts.iterrows()):
    for algorithm, column in times[host].items():
        known = column.dropna()
        style = "--" if algorithm.endswith("@cpu2") else "-"
        colour = f"C{sorted(full.method.unique()).index(algorithm.split('@')[0])}"
        panel.plot(known.index, known / 1e6, style, color=colour, marker=".", markersize=3, label=algorithm)
    speed = f"{parameters.clock_measured_ghz:.2f} GHz, {parameters.bandwidth_all_threads_gb_per_s:.0f} GB/s"
    panel.set(xscale="log", yscale="log", xlabel="boxes", title=f"{parameters.cpu}, {parameters.simd}\n{speed}")
    panel.grid(alpha=0.3)
panels[0][0].set_ylabel("time of a frame of `uniform` (ms)")
panels[0][-1].legend(fontsize=7)
figure.tight_layout()
figure.savefig(picture, dpi=120)
print(f"{len(table)} timings on {table.host.nunique()} hosts; picture: {picture}")

# %% One host left out: for each scenario and number of boxes, take the algorithm that is fastest on the others.
points = full[full.backend.str.startswith("cpu")].assign(ln=lambda t: np.log(t.median_ns))
points = points.pivot_table(index=["scenario", "objects", "algorithm"], columns="host", values="ln")
for host in points.columns:
    others = points.drop(columns=host).mean(axis=1, skipna=False).dropna()
    here = points[host].dropna()
    both = others.index.intersection(here.index)
    others, here = others[both], here[both]
    choice = others.groupby(["scenario", "objects"]).idxmin()
    best = here.groupby(["scenario", "objects"]).min()
    regret = np.exp(here[choice].to_numpy() - best[choice.index].to_numpy()) - 1
    print(
        f"{host} by the others: {len(regret)} points, mean regret {100 * regret.mean():.1f} %, "
        f"0.9 quantile {100 * np.quantile(regret, 0.9):.1f} %"
    )

# %% [markdown]
# `sapwise train datasets` does this with a model of hardware parameters, with all profiles, sizes between the measured
# ones, and noise floors; its figures are in `docs/methodology.md`. Those printed here are of the points that all hosts
# have measured only.
