"""Oracles, scenes, and a cache folder of the tests' own."""

import atexit
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pytest

#: The variable that moves the user's cache folder.
CACHE = {"darwin": "HOME", "win32": "LOCALAPPDATA"}.get(sys.platform, "XDG_CACHE_HOME")
# Before the first use: no test reads or writes the cache of the user.
if "SAPWISE_TESTS" not in os.environ:
    # What a test starts in a process of its own shares the folder, and a fork leaves it to its parent.
    FOLDER, OWNER = tempfile.mkdtemp(prefix="sapwise-tests-"), os.getpid()
    os.environ[CACHE] = os.environ["SAPWISE_TESTS"] = FOLDER
    atexit.register(lambda: os.getpid() == OWNER and shutil.rmtree(FOLDER, ignore_errors=True))

ROOT = Path(__file__).resolve().parents[3]
#: The folder of this file, for scripts that import it.
HERE = str(Path(__file__).resolve().parent)

#: The marks of tests for what not every system has.
forks = pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork here")
limited_by_memory = pytest.mark.skipif(sys.platform != "linux", reason="only on Linux free memory limits the pairs")


def naive(boxes, others=None):
    """All overlapping pairs by the definition, sorted: shape (m, 2)."""
    b = np.asarray(boxes, np.float64).reshape(-1, 6)
    o = b if others is None else np.asarray(others, np.float64).reshape(-1, 6)
    found = []
    for i in range(len(b)):
        start = i + 1 if others is None else 0
        rest = o[start:]
        meets = ((b[i, :3] <= rest[:, 3:]) & (rest[:, :3] <= b[i, 3:])).all(axis=1)
        partners = np.flatnonzero(meets) + start
        found.append(np.column_stack([np.full(len(partners), i), partners]))
    return np.concatenate(found).astype(np.uint32) if found else np.empty((0, 2), np.uint32)


def cubes(count, seed=0, half=0.5, world=None):
    """Cubes on a lattice of 1/64, which 32-bit floats hold exactly: many of them touch."""
    rng = np.random.default_rng(seed)
    world = world if world is not None else max(2.0, count ** (1 / 3) * 2)
    centres = np.round(rng.uniform(0, world, (count, 3)) * 64) / 64
    return np.concatenate([centres - half, centres + half], axis=1).astype(np.float32)


def allowed(groups, masks, owner, fixed):
    """A matrix: which two of these boxes may be a pair."""
    groups, masks, owner, fixed = (np.asarray(of)[:, None] for of in (groups, masks, owner, fixed))
    by_group = (groups & masks.T != 0) & (groups.T & masks != 0)
    return by_group & ~(fixed & fixed.T) & ((owner != owner.T) | (owner == 0))


def mixed(count, seed=0):
    """Boxes of very different edges, some of them flat, some of them points."""
    rng = np.random.default_rng(seed)
    low = rng.normal(0, 0.5 * count ** (1 / 3), (count, 3))
    edges = 10 ** rng.uniform(-1.5, 0.7, (count, 3)) * (rng.random((count, 3)) > 0.1)
    low = low.astype(np.float32)
    return np.concatenate([low, low + edges.astype(np.float32)], axis=1)


def run(script, *arguments, timeout=120, **environment):
    """Run a script, or a file, in its own process, with a time limit, and return what it printed."""
    env = {**os.environ, **environment}
    done = subprocess.run(
        [sys.executable, *([script] if isinstance(script, Path) else ["-c", script]), *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=timeout,
        env=env,
        check=False,
    )
    assert done.returncode == 0, f"status {done.returncode}\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.fixture
def warns_again(monkeypatch):
    """The warnings that come once in a process have not come yet."""
    monkeypatch.setattr("sapwise._arrays._has_warned", set())
