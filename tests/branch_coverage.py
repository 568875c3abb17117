"""Pytest plugin: which lines and branches of the packages the tests run, also of tests that run side by side.

`-p tests.branch_coverage` loads it, as CI does, before anything of ours is imported. SlipCover puts probes
into functions, and removes those that have served: tests take a quarter longer, under coverage's tracer two thirds. Its own
plugin does not work with pytest 9.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from importlib.machinery import ModuleSpec, PathFinder
from types import ModuleType
from typing import Any

import pytest
import slipcover
from slipcover.importer import SlipcoverLoader

PACKAGES = ["localization", "robot_sim", "teleop"]
# The first two run in the processes that tests start; the last is compiled by numba, and bears no probes.
OMITTED = ["*/__main__.py", "*/client_warden.py", "*/node_modules/*", "localization/compiled/*"]
EXCLUDED = ["@overload", r"\.\.\.$", "raise NotImplementedError"]
LISTED = 10
"""So many of the least covered files are named."""


class Finder:
    """Finds our modules before pytest does, which would rewrite those of the package that has a plugin."""

    def __init__(self, probes: slipcover.Slipcover) -> None:
        """Build one for a measurement."""
        self._probes = probes
        self._matcher = slipcover.FileMatcher(sources=PACKAGES, omit=OMITTED)

    def find_spec(
        self, name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return where a module of ours is, to be instrumented; None of others."""
        if name.partition(".")[0] not in PACKAGES:
            return None
        spec = PathFinder.find_spec(name, path, target)
        if spec is not None and spec.loader is not None and self._matcher.matches(spec.origin):
            spec.loader = SlipcoverLoader(self._probes, spec.loader, str(spec.origin))
        return spec


class BranchCoverage:
    """Measures one process, and in the one that was started adds those of its workers."""

    def __init__(self) -> None:
        """Instrument what is imported from now on."""
        self._probes = slipcover.Slipcover(
            branch=True, source=PACKAGES, omit=OMITTED, exclude_also=EXCLUDED
        )
        sys.meta_path.insert(0, Finder(self._probes))
        self._merged: dict[str, Any] | None = None

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """Send what a worker has measured, or fail if there is too little of it all."""
        output: dict[str, str] | None = getattr(session.config, "workeroutput", None)
        if output is not None:
            output["branch_coverage"] = json.dumps(self._probes.get_coverage())
            return
        least = session.config.getoption("branch_coverage")
        if self._merged is None:
            self._add(self._probes.get_coverage())
        if self._percent() < least and not session.exitstatus:
            session.exitstatus = pytest.ExitCode.TESTS_FAILED

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodedown(self, node: Any) -> None:
        """Add what a worker has measured; one that was killed sends nothing."""
        sent = getattr(node, "workeroutput", {}).get("branch_coverage")
        if sent is not None:
            self._add(json.loads(sent))

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Print the whole, and the files that are covered least."""
        report, least = terminalreporter, terminalreporter.config.getoption("branch_coverage")
        files = (self._merged or {}).get("files", {})
        percent = {name: file["summary"]["percent_covered"] for name, file in files.items()}
        report.section("branch coverage")
        for name in sorted(percent, key=lambda name: percent[name])[:LISTED]:
            report.line(f"{percent[name]:6.1f} %  {name}")
        whole = self._percent()
        report.line(f"{whole:6.1f} %  in all, of at least {least:g} %", red=whole < least)

    def _percent(self) -> float:
        summary = (self._merged or {}).get("summary", {})
        return float(summary.get("percent_covered", 0.0))

    def _add(self, measured: dict[str, Any]) -> None:
        merged = self._merged
        self._merged = measured if merged is None else slipcover.merge_coverage(merged, measured)


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the least share that the tests must run."""
    parser.addoption(
        "--branch-coverage",
        type=float,
        default=0.0,
        metavar="PERCENT",
        help="fail if the tests run less of the packages' lines and branches",
    )


_measured = BranchCoverage()


def pytest_configure(config: pytest.Config) -> None:
    """Register what measures, for sessions and workers."""
    config.pluginmanager.register(_measured)
