"""The package itself: examples in docstrings, stubs, the index in the documents."""

import doctest
import importlib.util
import inspect
import re
import subprocess
import sys
from importlib import resources

import pytest
from conftest import CACHE, ROOT, run

import sapwise

PUBLIC = [name for name in sapwise.__all__ if name != "__version__"]


@pytest.mark.parametrize("name", PUBLIC)
def test_everything_is_documented_and_examples_hold(name):
    of = getattr(sapwise, name)
    assert inspect.getdoc(of)
    finder = doctest.DocTestFinder(recurse=False)
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE)
    for example in finder.find(of, name, module=False, globs={"sapwise": sapwise}):
        runner.run(example)
    assert runner.failures == 0
    if name in ("pairs", "pairs_between", "BroadPhase"):
        assert runner.tries > 0


def test_the_stubs_tell_what_there_is():
    pytest.importorskip("mypy.stubtest")
    command = [sys.executable, "-m", "mypy.stubtest", "sapwise"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert resources.files("sapwise").joinpath("py.typed").is_file()


def test_the_index_in_the_documents_is_that_of_the_docstrings():
    specification = importlib.util.spec_from_file_location("index", ROOT / "tools/python_index.py")
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    document = (ROOT / "docs/python.md").read_text(encoding="utf-8")
    assert module.index() in document, "write it again: tools/python.sh index"
    for name in PUBLIC:
        assert f"`{name}`" in document


def test_the_code_of_the_guide_runs_from_top_to_bottom(tmp_path):
    guide = (ROOT / "docs/python.md").read_text(encoding="utf-8")
    code = "\n".join(re.findall(r"```python\n(.*?)```", guide, re.DOTALL))
    # Takes a minute, and needs the command.
    probe = "sapwise.probe_report"
    assert probe in code
    lines = [line for line in code.splitlines() if not line.startswith(probe)]
    ends = "print(begun.tolist(), len(ended), len(pairs), len(hits), len(handles), tuning.fields[0][0])"
    printed = run("\n".join([*lines, ends]), **{CACHE: str(tmp_path)})
    assert printed.splitlines()[-1] == "[] 0 0 2 2 0"


def test_nothing_heavy_comes_with_the_import():
    script = (
        "import sys, numpy; before = set(sys.modules); import sapwise; "
        "print(sorted(m.split('.')[0] for m in set(sys.modules) - before))"
    )
    assert not {"pandas", "scipy", "matplotlib"} & set(eval(run(script)))


def test_the_version_is_that_of_the_library():
    manifest = (ROOT / "Cargo.toml").read_text(encoding="utf-8")
    assert f'version = "{sapwise.__version__}"' in manifest
