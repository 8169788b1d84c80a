"""The index of docs/python.md, from the docstrings: `tools/python.sh index` writes it, a test holds it against them."""

import inspect
import sys
from pathlib import Path

import sapwise

#: The heads of the columns.
HEAD = "| name | what it does | members |\n|---|---|---|\n"


def first(of):
    """The first sentence of a docstring, as Markdown."""
    return inspect.getdoc(of).split("\n\n")[0].replace("\n", " ").replace("``", "`").split(". ")[0].rstrip(".")


def index():
    """The table: what is public, exceptions aside, which have a table of their own, and the members of the classes that do something."""
    rows = []
    for name in sapwise.__all__:
        of = getattr(sapwise, name)
        if name == "__version__" or inspect.isclass(of) and issubclass(of, BaseException):
            continue
        # What the attributes of a decision and a tuning are stands in their own docstrings.
        members = sorted(m for m in vars(of) if not m.startswith("_") and getattr(of, m).__doc__) if inspect.isclass(of) else []
        rows.append(f"| `{name}` | {first(of)} | {', '.join(f'`{m}`' for m in members)} |\n")
    return HEAD + "".join(rows)


if __name__ == "__main__":
    document = Path(sys.argv[1])
    text = document.read_text(encoding="utf-8")
    document.write_text(text[: text.index(HEAD)] + index(), encoding="utf-8")
