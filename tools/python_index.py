"""The index of docs/python.md, from the docstrings: `tools/python.sh index` writes it, a test holds it against them."""

import inspect
import sys
from pathlib import Path

import sapwise

#: The heads of the two columns.
HEAD = "| name | what it does |\n|---|---|\n"


def first(of):
    """The first paragraph of a docstring, as Markdown."""
    return inspect.getdoc(of).split("\n\n")[0].replace("\n", " ").replace("``", "`")


def index():
    """The table: what is public, exceptions aside, which have a table of their own, and the members of the classes that do something."""
    rows = {}
    for name in sapwise.__all__:
        of = getattr(sapwise, name)
        if name != "__version__" and not (inspect.isclass(of) and issubclass(of, BaseException)):
            rows[name] = of
    for name in ("BroadPhase", "Tuning"):
        of = getattr(sapwise, name)
        # What the attributes of a tuning are stands in its own docstring.
        members = (m for m in sorted(vars(of)) if not m.startswith("_") and getattr(of, m).__doc__)
        rows |= {f"{name}.{member}": getattr(of, member) for member in members}
    return HEAD + "".join(f"| `{name}` | {first(of)} |\n" for name, of in rows.items())


if __name__ == "__main__":
    document = Path(sys.argv[1])
    text = document.read_text(encoding="utf-8")
    document.write_text(text[: text.index(HEAD)] + index(), encoding="utf-8")
