#!/usr/bin/env python3
"""Gathers the documents as the source of a book, and checks the links of the pages that mdBook makes of it.

    tools/book.py source DIR    # the documents with a table of contents; links to other files lead to the repository
    tools/book.py check DIR     # every local link and anchor of the pages

Needs Python 3.8 only. `tools/book.sh` calls it.
"""

import html.parser
import pathlib
import re
import shutil
import sys
import urllib.parse

ROOT = pathlib.Path(__file__).resolve().parent.parent
REPOSITORY = "https://github.com/sapwise/sapwise/blob/main/"
CONTENTS = {
    "Use": [
        "docs/guide.md",
        "docs/how-it-chooses.md",
        "docs/gpu.md",
        "docs/c.md",
        "docs/python.md",
        "docs/web.md",
        "docs/mpi.md",
    ],
    "Measure": [
        "docs/measuring.md",
        "docs/methodology.md",
        "docs/limitations.md",
        "docs/fleet.md",
        "datasets/README.md",
        "models/README.md",
    ],
    "Results": ["BENCHMARKS.md", "results/peers.md", "results/gpu.md", "results/inline.md", "results/heldout.md"],
    "Contribute": ["CONTRIBUTING.md", "docs/decisions.md", "SECURITY.md", "CHANGELOG.md"],
}


def source(folder):
    names = ["README.md", *(name for part in CONTENTS.values() for name in part)]
    summary = ["# Summary", "", "[Sapwise](README.md)"]
    for part, pages in CONTENTS.items():
        summary += ["", f"# {part}", ""]
        for name in pages:
            title = re.search(r"^# (.*)", (ROOT / name).read_text(encoding="utf-8"), re.M)[1]
            summary.append(f"- [{title}]({name})")
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    (folder / "SUMMARY.md").write_text("\n".join(summary) + "\n", encoding="utf-8")
    shutil.copytree(ROOT / "pictures", folder / "pictures")
    for name in names:
        to = folder / name
        to.parent.mkdir(parents=True, exist_ok=True)
        text = (ROOT / name).read_text(encoding="utf-8")
        to.write_text(
            re.sub(r"\]\(([^)\s#]+)(#[^)\s]*)?\)", lambda link: relinked(link, name, names), text), encoding="utf-8"
        )


def relinked(link, name, names):
    """Returns a link of the document `name`, led to the repository if its file is not in the book."""
    path, anchor = link[1], link[2] or ""
    if re.match(r"[a-z]+:", path):
        return link[0]
    whole = (ROOT / name).parent.joinpath(path).resolve().relative_to(ROOT).as_posix()
    if whole in names:
        # mdBook makes `index.html` of a README and leaves links to it as they are.
        return "](" + re.sub(r"README\.md$", "index.md", path) + anchor + ")"
    return link[0] if whole.startswith("pictures/") else f"]({REPOSITORY}{whole}{anchor})"


class Page(html.parser.HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.links, self.ids = [], set()
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        values = dict(attributes)
        self.ids.add(values.get("id"))
        self.links += [values[key] for key in ("href", "src") if values.get(key)]


def check(folder):
    pages = {path.resolve(): Page(path.read_text(encoding="utf-8")) for path in folder.rglob("*.html")}
    faults, count = [], 0
    for path, page in pages.items():
        if path.name in ("404.html", "toc.html", "print.html"):
            continue
        for link in page.links:
            url = urllib.parse.urlsplit(link)
            if url.scheme or url.netloc:
                continue
            count += 1
            target = (path.parent / urllib.parse.unquote(url.path)).resolve() if url.path else path
            if not target.exists():
                faults.append(f"{path.relative_to(folder.resolve())}: {link} does not exist")
            elif url.fragment and target in pages and urllib.parse.unquote(url.fragment) not in pages[target].ids:
                faults.append(f"{path.relative_to(folder.resolve())}: {link} has no such heading")
    print("\n".join(faults + [f"{len(pages)} pages, {count} local links, {len(faults)} broken"]))
    sys.exit(bool(faults))


{"source": source, "check": check}[sys.argv[1]](pathlib.Path(sys.argv[2]))
