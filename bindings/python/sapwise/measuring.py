"""Measures the hardware in this process, or a whole report with the command."""

import collections
import shutil
import signal
import subprocess
import threading

from . import _sapwise
from ._errors import SapwiseError
from .reports import _table, read_report

Hardware = collections.namedtuple("Hardware", ["machine", "parameters"])


def probe(quick=True, progress=None):
    """Measure the hardware of this machine, in this process. Saves nothing and times no algorithm.

    Parameters
    ----------
    quick : bool, default True
        Whether to take about two seconds, without latencies of loads. Otherwise it takes about ten seconds, as for a
        report.
    progress : callable, optional
        Called as ``progress(done, of, what)`` before each family of parameters, and once at the end. An exception in it
        ends the measurement.

    Returns
    -------
    Hardware
        ``machine``, a dict: the machine's description, without names of hosts or users. ``parameters``, a
        pandas.DataFrame or numpy.recarray: ``name``, ``value``, ``unit``, ``dispersion`` (interquartile range over
        median), ``samples``, ``spoiled``, ``foreign_load`` (0 to 1), ``how``, ``source``.

    Raises
    ------
    KeyboardInterrupt
        Ctrl-C works between families, each of which takes up to a second or two.

    Notes
    -----
    Measure on a quiet machine. Timings of algorithms take a process for each scenario: see ``probe_report``.
    """
    machine, parameters = _sapwise.measure_hardware(quick, progress)
    return Hardware(machine, _table(parameters))


def probe_report(path, quick=True, progress=None, command="sapwise", arguments=()):
    """Measure the hardware and time every algorithm, with the command ``sapwise probe``, which writes a report.

    Parameters
    ----------
    path : path
        The report to write.
    quick : bool, default True
        Whether to take about half a minute; a full report takes some minutes.
    progress : callable, optional
        Called with each line of progress of the command. An exception in it ends the command.
    command : str, default "sapwise"
        The command, on the PATH or as a path. It is not in this package: ``cargo install --path probes`` in the
        repository.
    arguments : sequence of str, optional
        More arguments, for instance ``["--threads", "1"]``.

    Returns
    -------
    pandas.DataFrame or numpy.recarray
        The report, as ``read_report`` returns it.

    Raises
    ------
    SapwiseError
        There is no such command, or it failed; the text has its last lines.
    KeyboardInterrupt
        On Ctrl-C, once the command has ended; it keeps what was measured until then.
    """
    program = shutil.which(command)
    if program is None:
        raise SapwiseError(
            f"there is no command {command!r}; "
            "run `cargo install --path probes` in the repository, or give its path as command="
        )
    call = [program, "probe", "--out", str(path), *(["--quick"] if quick else []), *arguments]
    last = collections.deque(maxlen=20)
    # In its own process group: it gets Ctrl-C from here only, once.
    with subprocess.Popen(
        call, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, errors="replace", start_new_session=True
    ) as running:
        try:
            for line in running.stderr:
                last.append(line.rstrip())
                if progress is not None:
                    progress(last[-1])
            status = running.wait()
        except BaseException:
            _end(running)
            raise
    if status != 0:
        told = "\n".join(last)
        raise SapwiseError(f"`{' '.join(call)}` ended with status {status}:\n{told}")
    return read_report(path)


def _end(running):
    """Ask the command to end, and kill it if it does not."""
    if running.poll() is None:
        running.send_signal(signal.SIGINT)
        # Without a reader of its output it would block.
        threading.Thread(target=running.stderr.read, daemon=True).start()
        try:
            running.wait(30)
        except subprocess.TimeoutExpired:
            running.kill()
            running.wait()
