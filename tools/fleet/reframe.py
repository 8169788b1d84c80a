"""ReFrame test that probes every node of a cluster, each alone, into one shared folder.

    reframe -C site.py -c tools/fleet/reframe.py -r --distribute=idle -S reports=/shared/reports
    sapwise check /shared/reports

`--distribute=idle` makes one job for each idle node; without it, as with ReFrame's own generic system, the test runs on
this machine. `-S reports=FOLDER` names the shared folder, which the test creates if it is missing; `-S sapwise=PATH`
the command if it is not on the PATH; `-S options=--quick,--no-gpus` further options of `sapwise probe`. A node whose report
is complete is not measured again.

ReFrame keeps hardware parameters of each run, which compares a node with itself a month ago; `sapwise check` compares
the nodes with each other. Tried with ReFrame 4.10.
"""

import json
import os

import reframe as rfm
import reframe.utility.sanity as sn
import reframe.utility.typecheck as typ
from reframe.core.builtins import performance_function, run_after, run_before, sanity_function, variable
from reframe.core.exceptions import SanityError


@rfm.simple_test
class SapwiseProbe(rfm.RunOnlyRegressionTest):
    """`sapwise probe` on one node. Fails if the report was cut short or lacks a parameter that the test names."""

    descr = "Sapwise: hardware parameters and broad-phase timings of a node"
    maintainers = ["sapwise"]
    valid_systems = ["*"]
    valid_prog_environs = ["*"]
    reports = variable(str)
    sapwise = variable(str, value="sapwise")
    options = variable(typ.List[str], value=[])
    num_tasks = 1
    num_tasks_per_node = 1
    exclusive_access = True
    time_limit = "15m"

    @run_after("init")
    def share(self):
        # Before the job changes to its stage folder.
        self.reports = os.path.abspath(self.reports)

    @run_before("run")
    def command(self):
        os.makedirs(self.reports, exist_ok=True)
        self.executable = self.sapwise
        self.executable_opts = ["probe", "--json", "--out", self.reports, *self.options]
        # Two nodes may share a host name, but not the name that Slurm has for them. Without Slurm it is empty: not set.
        self.prerun_cmds = ['export SAPWISE_NODE="${SLURMD_NODENAME:-}"']

    def report(self):
        """The report, an object as `schemas/report-3.schema.json` has it."""
        printed = self.printed(self.stdout)
        if not printed.strip():
            told = self.printed(self.stderr).strip().splitlines() or ["nothing"]
            raise SanityError(f"sapwise probe printed no report; the last line of its standard error: {told[-1]}")
        return json.loads(printed)

    def printed(self, stream):
        with open(os.path.join(self.stagedir, sn.evaluate(stream)), encoding="utf-8") as text:
            return text.read()

    def hardware(self, name):
        """The value of a hardware parameter, in the unit in its name."""
        values = [p["value"] for p in self.report()["hardware"]["parameters"] if p["name"] == name]
        if not values or values[0] is None:
            raise ValueError(f"{name} was not measured; the report's remarks say why")
        return values[0]

    @sanity_function
    def whole(self):
        cut_short = [remark for remark in self.report()["remarks"] if remark.startswith(("interrupted", "unfinished"))]
        points = len(self.report()["points"])
        return sn.all([
            sn.assert_eq(self.job.exitcode or 0, 0, msg="sapwise probe failed; its standard error says why"),
            sn.assert_eq(cut_short, []),
            sn.assert_gt(points, 0, msg="the report has no timings"),
        ])

    @performance_function("GHz")
    def clock(self):
        return self.hardware("clock_measured_ghz")

    @performance_function("GB/s")
    def bandwidth_one_thread(self):
        return self.hardware("bandwidth_one_thread_gb_per_s")

    @performance_function("GB/s")
    def bandwidth_all_threads(self):
        return self.hardware("bandwidth_all_threads_gb_per_s")

    @performance_function("ns")
    def latency_65536_kib(self):
        return self.hardware("latency_65536_kib_ns")

    @performance_function("ns")
    def core_to_core(self):
        return self.hardware("core_to_core_ns")
