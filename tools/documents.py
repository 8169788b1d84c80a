#!/usr/bin/env python3
"""Checks the documents: words against their budgets, and local links with their anchors.

    tools/documents.py

Needs Python 3.8 only.
"""

import os
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
WORDS = {
    "README.md": 700,
    "BENCHMARKS.md": 900,
    "CONTRIBUTING.md": 1000,
    "SECURITY.md": 350,
    "CHANGELOG.md": 500,
    "docs/guide.md": 2200,
    "docs/how-it-chooses.md": 1000,
    "docs/gpu.md": 500,
    "docs/c.md": 500,
    "docs/web.md": 500,
    "docs/python.md": 900,
    "bindings/python/README.md": 150,
    "bindings/web/npm/README.md": 150,
    "docs/mpi.md": 700,
    "docs/fleet.md": 350,
    "docs/measuring.md": 1800,
    "docs/methodology.md": 2200,
    "docs/limitations.md": 800,
    "docs/decisions.md": 1200,
    "datasets/README.md": 900,
    "models/README.md": 1400,
}
WORDS_OF_RESULTS = 1500
WORDS_IN_ALL = 21500


def documents():
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard", "*.md"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    return sorted(name for name in set(listed.stdout.split()) if (ROOT / name).exists())


def faults_of_words(names):
    count = {name: len((ROOT / name).read_text(encoding="utf-8").split()) for name in names}
    limits = dict(WORDS, **{name: 120 for name in names if name.endswith("/host.md")})
    for name, limit in limits.items():
        if count.get(name, 0) > limit:
            yield f"{name}: {count[name]} words, at most {limit}"
    of_results = sum(n for name, n in count.items() if name.startswith("results/"))
    if of_results > WORDS_OF_RESULTS:
        yield f"results/*.md: {of_results} words, at most {WORDS_OF_RESULTS}"
    if sum(count.values()) > WORDS_IN_ALL:
        yield f"all documents: {sum(count.values())} words, at most {WORDS_IN_ALL}"


def anchors(text):
    """The anchors of the headings, as GitHub and mdBook make them."""
    outside = re.sub(r"```.*?```", "", text, flags=re.S)
    heads = [
        re.sub(r"[`*]|\[([^\]]*)\]\([^)]*\)", r"\1", line.lstrip("#").strip())
        for line in outside.splitlines()
        if re.match("#+ ", line)
    ]
    return {re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads}


def faults_of_links(names):
    texts = {name: (ROOT / name).read_text(encoding="utf-8") for name in names}
    for name, text in texts.items():
        for target in re.findall(r"\]\(([^)\s]+)\)", re.sub(r"```.*?```|`[^`]*`", "", text, flags=re.S)):
            if re.match(r"[a-z]+:", target):
                continue
            path, _, anchor = target.partition("#")
            whole = os.path.normpath(pathlib.PurePosixPath(name).parent / path) if path else name
            if not (ROOT / whole).exists():
                yield f"{name}: {target} does not exist"
            elif anchor and whole in texts and anchor not in anchors(texts[whole]):
                yield f"{name}: {target} has no such heading"


def main():
    names = documents()
    faults = [*faults_of_words(names), *faults_of_links(names)]
    sys.exit("\n".join(faults) or None)


main()
