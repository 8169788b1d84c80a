"""Threads, forks and Ctrl-C. Each in a process of its own, so that a deadlock fails instead of lasting."""

import sys

import pytest
from conftest import HERE, forks, run

HEAD = """
import os, signal, sys, threading, time
import numpy as np, sapwise
sys.path.insert(0, %r)
from conftest import cubes, naive
# Python takes no part in signals that its parent ignores, as that of a job in the background does.
signal.signal(signal.SIGINT, signal.default_int_handler)
""" % HERE


def test_many_threads_at_once_get_their_own_answers():
    script = """
scenes = [cubes(500 + 300 * k, seed=k) for k in range(6)]
known = [naive(s) for s in scenes]
wrong = []
shared = sapwise.BroadPhase(cache=False, measure=False)
def work(k):
    for _ in range(30):
        if not np.array_equal(sapwise.pairs(scenes[k]), known[k]): wrong.append(k)
        if not np.array_equal(shared.find(scenes[k]), known[k]): wrong.append(-k)
        shared.begun(), shared.ended(), shared.last_decision, repr(shared)
threads = [threading.Thread(target=work, args=(k,)) for k in range(6)]
[t.start() for t in threads]; [t.join() for t in threads]
print(wrong)
"""
    assert run(HEAD + script).strip() == "[]"


def test_python_runs_while_a_frame_does():
    script = """
boxes = cubes(1_000_000, seed=1)
sapwise.pairs(boxes)
steps, done = 0, threading.Event()
def work():
    for _ in range(10): sapwise.pairs(boxes)
    done.set()
thread = threading.Thread(target=work); thread.start()
while not done.is_set():
    steps += 1; time.sleep(0.001)
thread.join(); print(steps)
"""
    # If a frame kept the interpreter, there would be about one step between two frames.
    assert int(run(HEAD + script)) > 20


def test_python_runs_while_measurements_of_unclosed_objects_end():
    script = """
steps, done = 0, threading.Event()
def work():
    global steps
    while not done.is_set(): steps += 1; time.sleep(0.001)
thread = threading.Thread(target=work); thread.start()
for _ in range(20):
    measuring = [sapwise.BroadPhase(cache=False) for _ in range(5)] + [sapwise.Space(cache=False) for _ in range(5)]
    time.sleep(0.1)
    before, began = steps, time.monotonic()
    del measuring
    during, seconds = steps - before, time.monotonic() - began
    if seconds > 0.1: break
done.set(); thread.join()
print('fine' if during > 5 or seconds < 0.1 else (during, seconds))
"""
    assert run(HEAD + script).strip() == "fine"


def test_it_is_closed_while_a_frame_runs():
    script = """
boxes = cubes(300_000, seed=1); known = len(sapwise.pairs(boxes))
for _ in range(5):
    broad_phase = sapwise.BroadPhase(cache=False, measure=False)
    found = []
    def work():
        try: found.append(len(broad_phase.find(boxes)))
        except sapwise.SapwiseError as why: found.append(str(why))
    thread = threading.Thread(target=work); thread.start()
    time.sleep(0.002); broad_phase.close(); thread.join()
    assert found[0] == known or 'closed' in found[0], found
print('fine')
"""
    assert run(HEAD + script).strip() == "fine"


def test_boxes_that_another_thread_writes_to_crash_nothing():
    script = """
boxes = cubes(50_000, seed=1); stop = threading.Event(); rng = np.random.default_rng(1)
original = boxes.copy()
def write():
    while not stop.is_set():
        boxes[:] = original[rng.permutation(50_000)]
        boxes[rng.integers(50_000, size=5), 0] = np.nan
thread = threading.Thread(target=write); thread.start()
answers = 0
with sapwise.BroadPhase(cache=False, measure=False) as broad_phase:
    for k in range(60):
        try: broad_phase.find(boxes) if k % 2 else sapwise.pairs(boxes)
        except Exception: pass
        except BaseException as why:
            assert 'Panic' in type(why).__name__, why
        answers += 1
stop.set(); thread.join(); print(answers)
"""
    assert run(HEAD + script).strip() == "60"


@forks
def test_threads_that_meet_a_space_of_the_parent_at_once_make_one_of_it():
    script = """
import warnings; warnings.simplefilter('ignore')
for _ in range(5):
    space = sapwise.Space(cache=False, measure=False)
    space.insert(cubes(10))
    space.update()
    child = os.fork()
    if child == 0:
        start = threading.Barrier(4)
        def insert(): start.wait(); space.insert(cubes(10))
        threads = [threading.Thread(target=insert) for _ in range(4)]
        for t in threads: t.start()
        for t in threads: t.join()
        os._exit(0 if len(space) == 50 else 1)
    assert os.waitpid(child, 0)[1] == 0
print('fine')
"""
    assert run(HEAD + script).strip() == "fine"


@forks
@pytest.mark.parametrize("delay", [0.002, 0.02, 0.05])
def test_a_fork_while_another_thread_looks_for_gpus(delay):
    # Without GPUs in the wheel there is no such algorithm.
    script = """
import warnings; warnings.simplefilter('ignore')
boxes = cubes(30)
def search():
    try: sapwise.pairs(boxes, algorithm='brute@gpu0')
    except sapwise.SapwiseError: pass
thread = threading.Thread(target=search); thread.start(); time.sleep(%s)
child = os.fork()
if child == 0:
    sapwise.pairs(boxes)
    os._exit(0)
for _ in range(300):
    ended, status = os.waitpid(child, os.WNOHANG)
    if ended: break
    time.sleep(0.1)
else: os.kill(child, 9); sys.exit('the child waits for ever')
assert status == 0, status
thread.join(); print('fine')
""" % delay
    assert run(HEAD + script).strip() == "fine"


@pytest.mark.skipif(sys.platform != "linux", reason="threads are counted by what Linux tells")
@pytest.mark.parametrize("busy", [False, True])
def test_a_fork_after_use_works_in_the_child_and_in_the_parent(busy):
    # Enough boxes for all cores, so that the threads that are not in the child would be waited for.
    script = """
import warnings; warnings.simplefilter('ignore')
def threads(): return len(os.listdir('/proc/self/task'))
boxes = cubes(60_000, seed=2); known = sapwise.pairs(boxes)
broad_phase = sapwise.BroadPhase(cache=False, measure=False, algorithm='grid-sap@cpu' + str(min(2, len(os.sched_getaffinity(0)))))
broad_phase.set_filter(fixed=np.zeros(60_000, bool))
other = sapwise.BroadPhase(cache=False, measure=False)
other.find(boxes)
assert np.array_equal(broad_phase.find(boxes), known)
stop = threading.Event()
def work():
    while not stop.is_set(): broad_phase.find(boxes); sapwise.pairs(boxes)
thread = threading.Thread(target=work)
if %s: thread.start(); time.sleep(0.05)
for _ in range(3):
    child = os.fork()
    if child == 0:
        status = 1
        try:
            counts = [threads()]
            assert np.array_equal(sapwise.pairs(boxes), known)
            counts.append(threads())
            assert np.array_equal(broad_phase.find(boxes), known) and len(broad_phase.begun()) == len(known)
            counts.append(threads())
            # Threads of its own for both.
            if len(os.sched_getaffinity(0)) > 1: assert counts[0] < counts[1] < counts[2], counts
            del other
            broad_phase.close()
            assert np.array_equal(sapwise.pairs_between(boxes[:9], boxes)[:9], sapwise.pairs_between(boxes[:9], boxes)[:9])
            status = 0
        except BaseException as why: print('child', repr(why), flush=True)
        finally: os._exit(status)
    for _ in range(600):
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended: break
        time.sleep(0.1)
    else: os.kill(child, 9); sys.exit('the child waits for ever')
    assert status == 0, status
    assert np.array_equal(sapwise.pairs(boxes), known)
stop.set()
if %s: thread.join()
print('fine')
""" % (busy, busy)
    assert run(HEAD + script).strip() == "fine"


@pytest.mark.parametrize("method", ["fork", "spawn", "forkserver"])
def test_multiprocessing(method, tmp_path):
    program = tmp_path / "program.py"
    program.write_text(
        HEAD
        + """
import multiprocessing, warnings
warnings.simplefilter('ignore')
def count(seed): return len(sapwise.pairs(cubes(20_000, seed=seed)))
if __name__ == '__main__':
    known = [count(seed) for seed in range(4)]
    with multiprocessing.get_context(sys.argv[1]).Pool(2) as pool:
        assert pool.map_async(count, range(4)).get(60) == known
    print('fine')
"""
    )
    if sys.platform == "win32" and method != "spawn":
        pytest.skip("there is no fork here")
    assert run(program, method).strip() == "fine"


def test_ctrl_c_in_a_long_frame_is_an_exception_after_it():
    script = """
boxes = np.zeros((6000, 6), np.float32)   # 18 million pairs
broad_phase = sapwise.BroadPhase(cache=False, measure=False)
broad_phase.find(boxes[:100])
raised = []
for find in (broad_phase.find, sapwise.pairs):
    timer = threading.Timer(0.01, signal.raise_signal, (signal.SIGINT,)); timer.start()
    try:
        while True: find(boxes)
    except KeyboardInterrupt: raised.append(find.__name__)
    timer.join()
    assert len(find(boxes[:100])) == 4950
print(raised)
"""
    assert run(HEAD + script).strip() == "['find', 'pairs']"


def test_ctrl_c_ends_a_measurement(tmp_path):
    script = """
for what in ('predict', 'probe'):
    threading.Timer(0.3, signal.raise_signal, (signal.SIGINT,)).start()
    began = time.monotonic()
    try:
        if what == 'predict': sapwise.predict(cache=False, seconds=20.0)
        else: sapwise.probe(quick=False)
        print('not interrupted', flush=True)
    except KeyboardInterrupt: print(what, time.monotonic() - began < 5, flush=True)
os._exit(0)
"""
    assert run(HEAD + script).split("\n")[:2] == ["predict True", "probe True"]
