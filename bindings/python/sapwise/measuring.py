"""Measures the machine: its hardware in this process, or a whole report with the command."""

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
    """Measure the hardware of this machine, in this process. Nothing is timed but the hardware, and nothing is kept.

    Parameters
    ----------
    quick : bool, default True
        Whether to take about two seconds; latencies of loads are left out then. Otherwise it takes as long as a report needs: some ten seconds.
    progress : callable, optional
        Called as ``progress(done, of, what)`` before each family of parameters, and once when all are done. What it raises ends the
        measurement.

    Returns
    -------
    Hardware
        ``machine``, a dict: what the machine says of itself, without a name of a host or a user. ``parameters``, a
        pandas.DataFrame or numpy.recarray: ``name``, ``value``, ``unit``, ``dispersion`` (interquartile range over median), ``samples``,
        ``spoiled``, ``foreign_load`` (0 to 1), ``how``, ``source``.

    Raises
    ------
    KeyboardInterrupt
        Ctrl-C is seen between families, each of which takes up to a second or two.

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
        Called with each line of progress that the command writes. What it raises ends the command.
    command : str, default "sapwise"
        The command, on the PATH or as a path. This package does not contain it: ``cargo install --path probes`` in the repository.
    arguments : sequence of str, optional
        More arguments, for instance ``["--threads", "1"]``.

    Returns
    -------
    pandas.DataFrame or numpy.recarray
        The report, as ``read_report`` returns it.

    Raises
    ------
    SapwiseError
        There is no such command, or it failed; the text has the last lines that it wrote.
    KeyboardInterrupt
        On Ctrl-C, once the command has ended; it keeps what was measured until then.
    """
    program = shutil.which(command)
    if program is None:
        raise SapwiseError(
            f"there is no command {command!r}; `cargo install --path probes` in the repository installs it, or give its path as command="
        )
    call = [program, "probe", "--out", str(path), *(["--quick"] if quick else []), *arguments]
    last = collections.deque(maxlen=20)
    # Apart from the terminal's group: it hears of Ctrl-C from here, and just once.
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
    """Ask the command to end, and make it where it does not."""
    if running.poll() is None:
        running.send_signal(signal.SIGINT)
        # Someone must take what it still writes, or it would wait for that.
        threading.Thread(target=running.stderr.read, daemon=True).start()
        try:
            running.wait(30)
        except subprocess.TimeoutExpired:
            running.kill()
            running.wait()
