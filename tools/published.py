#!/usr/bin/env python3
"""Writes parameters of real machines that others published, as one CSV on standard output.

    git clone https://github.com/krrishnarraj/clpeak CLPEAK
    git clone https://github.com/SpareCores/sc-data-dumps SPARECORES
    tools/published.py CLPEAK SPARECORES > datasets/published/machines.csv

Reads the commits below, whatever is checked out; bare repositories will do. GPUs come from logs of clpeak: one row a
GPU, by its OpenCL driver. CPUs come from the cloud servers of Spare Cores: one row for each CPU model and number of
virtual CPUs, with the median over its servers. Cells of unknown or implausible values are empty.

Needs Python 3.9 and git only.
"""

import csv
import json
import re
import statistics
import subprocess
import sys
import xml.etree.ElementTree

# The last commit with the logs of version 1.
CLPEAK = "18c668f1c940663e62eed5bcc3e460ac541ea4b1"
SPARECORES = "e8749bef991dfd1c531e84f09c2882945064a18d"
CPU = ["usable_cores", "cache_llc_bytes", "simd_lanes"]
GPU = ["gpu/read_gb_per_s", "gpu/upload_gb_per_s", "gpu/download_gb_per_s", "gpu/arithmetic_gflop_per_s"]
HEADINGS, TESTS = ["Global memory", "Single-precision"], ["global_memory_bandwidth", "single_precision_compute"]
LABELS = ["enqueueWriteBuffer", "enqueueReadBuffer"]
METRICS = ["enqueuewritebuffer", "enqueuereadbuffer"]
NO_GPU = re.compile("Processor|CPU|APU|XEON|Ryzen|pthread|cpu-|llvmpipe|Many Integrated Core")
# Layers over the driver of the vendor: their files count only if a GPU has no other.
LAYERS = re.compile("Portable_Computing_Language|Mesa|clvk")
# What follows the name of the GPU in the name of a file.
VARIANT = re.compile("-PCIe.*|-cl[0-9].*|_Mesa.*|_clvk")


def files(git, commit, folder):
    """Yields path and text of each file, through one process for all."""
    listed = subprocess.run(
        ["git", "-C", git, "ls-tree", "-r", "-z", commit, folder], capture_output=True, check=True, text=True
    ).stdout
    entries = [entry.split("\t") for entry in listed.split("\0") if entry]
    asked = "\n".join(about.split()[2] for about, _ in entries)
    batch = subprocess.run(
        ["git", "-C", git, "cat-file", "--batch"], input=asked.encode(), capture_output=True, check=True
    ).stdout
    at = 0
    for _, path in entries:
        start = batch.index(b"\n", at) + 1
        at = start + int(batch[at:start].split()[2])
        yield path, batch[start:at].decode(errors="replace")
        at += 1


def of_log(text):
    """Returns the numbers of the first GPU in a log of version 1: of each wanted label, or below each heading."""
    for part in re.split(r"^ *Device *: *", text, flags=re.M)[1:]:
        if NO_GPU.search(part.splitlines()[0]):
            continue
        below = (re.search(f"{heading}.*\n((?: *float.*\n)+)", part) for heading in HEADINGS)
        read, arithmetic = (re.findall(r": ([0-9.]+)", found[1]) if found else [] for found in below)
        return [read, *(re.findall(f"{label} *: ([0-9.]+)", part) for label in LABELS), arithmetic]
    return [[]] * 4


def of_xml(text):
    """Returns the same of the first run by OpenCL on a GPU, in the files of version 2."""
    for run in xml.etree.ElementTree.fromstring(text).iter("run"):
        if run.get("backend") == "OpenCL" and not NO_GPU.search(run.get("device")):
            metrics = [(m.get("name"), m.text) for m in run.iter("metric") if m.text]
            tests = (run.iterfind(f".//test[@name='{name}']/metric") for name in TESTS)
            read, arithmetic = ([m.text for m in metrics if m.text] for metrics in tests)
            return [read, *([text for name, text in metrics if name == label] for label in METRICS), arithmetic]
    return [[]] * 4


def gpus(git):
    rows = {}
    for path, text in sorted(files(git, CLPEAK, "results/"), key=lambda file: bool(LAYERS.search(file[0]))):
        found = of_xml(text) if path.endswith(".xml") else of_log(text)
        values = [max(map(float, numbers), default=0) for numbers in found]
        name = VARIANT.sub("", path.rsplit("/", 1)[1].rsplit(".", 1)[0]).replace("_", " ").strip()
        if any(values):
            known = {key: value for key, value in zip(GPU, values) if value > 0}
            rows.setdefault(name.lower(), {"source": "clpeak", "machine": name, **known})
    return rows.values()


def cpus(git):
    servers = {}
    for path, text in files(git, SPARECORES, "data/server/"):
        s = json.loads(text)
        if s.get("cpu_model") and not path.endswith("_schema.json"):
            name = " ".join(s[key] for key in ("cpu_manufacturer", "cpu_family", "cpu_model") if s[key])
            name, flags = " ".join(name.split()), s["cpu_flags"]
            # As Sapwise, which has no kernels for AVX without AVX2, and none for SVE.
            lanes = 16 if "avx512f" in flags else 8 if "avx2" in flags else 4
            known = [s["vcpus"], s["cpu_l3_cache"], lanes if flags else None]
            servers.setdefault((name, s["vcpus"]), []).append(known)
    for (name, vcpus), all_known in sorted(servers.items()):
        columns = [[value for value in column if value] for column in zip(*all_known)]
        medians = [statistics.median_low(column) if column else "" for column in columns]
        yield {"source": "spare-cores", "machine": f"{name} ({vcpus} vCPU)", **dict(zip(CPU, medians))}


if len(sys.argv) != 3:
    sys.exit(__doc__)
out = csv.DictWriter(sys.stdout, ["source", "machine", *CPU, *GPU], restval="", lineterminator="\n")
out.writeheader()
out.writerows(gpus(sys.argv[1]))
out.writerows(cpus(sys.argv[2]))
