"""A copy of a commit in which mutants are tried, with a record of which tests run which lines."""

from __future__ import annotations

import contextlib
import fcntl
import os
import re
import shutil
import signal
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from importlib.util import cache_from_source
from pathlib import Path, PurePosixPath
from typing import Final

import pytest
from coverage import CoverageData

from benchmarks.common.figures import Figure
from tools.code_mutants.mutations import Mutant

PATIENCE = 60.0
"""Time that tests may take besides five times what they took when they were recorded [s]."""
_PAGE: Final = "teleop/console/page/dist"
"""What git ignores and tests need."""
_RECORDED: Final = ("-m", "not long and not process")
"""Without tests that start programs, for what these run leaves no record."""
_SETTINGS: Final = "[run]\nsource_pkgs = {}\nrelative_files = true\n"
_TIME: Final = re.compile(r"^(\d+\.\d+)s (?:setup|call|teardown) +(.+)$", re.MULTILINE)
_FAILURE: Final = re.compile(r"^(?:FAILED|ERROR) .*$", re.MULTILINE)


class Trial:
    """The copy of a commit, and its tests."""

    def __init__(self, clone: Path, commit: str, folder: Path, packages: Sequence[str]) -> None:
        """Make a copy, or take the one that an earlier run has left and undo what is changed in it.

        Args:
            clone: the clone that the commit is taken from.
            commit: the commit, by any of its names.
            folder: where copies and records are kept.
            packages: the packages that mutants are made of.

        Raises:
            ValueError: if another run is using the copy.
        """
        self.commit = _git(clone, "rev-parse", "--short", "--verify", commit)
        self._folder = folder / self.commit
        self._packages = packages
        self._lines = self._folder / "lines.coverage"
        self.tree = self._folder / "tree"
        self._folder.mkdir(parents=True, exist_ok=True)
        self._lock = (self._folder / "lock").open("w")
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            self.close()
            raise ValueError(f"another run is using {self._folder}: wait for its end") from None
        if not self.tree.is_dir():
            _git(clone, "clone", "--quiet", "--shared", str(clone), str(self.tree))
            if (clone / _PAGE).is_dir():
                shutil.copytree(clone / _PAGE, self.tree / _PAGE)
        _git(self.tree, "reset", "--quiet", "--hard", self.commit)
        names = _git(self.tree, "ls-files", "--", *(f"{name}/*.py" for name in packages))
        self.sources: Mapping[str, str] = {
            name: (self.tree / name).read_text("utf-8") for name in names.splitlines()
        }
        self._contexts = CoverageData(str(self._lines))
        self._seconds: dict[str, float] = defaultdict(float)
        self._unreliable = set[str]()

    def close(self) -> None:
        """Let another run use the copy."""
        self._lock.close()

    def read_record(self, processes: int) -> None:
        """Read which tests run which lines and how long they take; run them all first, in processes, if no run did.

        Raises:
            ValueError: if they cannot be run.
        """
        log = self._folder / "record.txt"
        if not self._lines.is_file():
            settings, part = self._folder / "coveragerc", self._folder / "part.coverage"
            settings.write_text(_SETTINGS.format(", ".join(self._packages)), "utf-8")
            words = ["--cov", f"--cov-config={settings}", "--cov-context=test", "--cov-report="]
            words += [f"--numprocesses={processes}", "--dist=worksteal", "--durations=0"]
            words += ["--durations-min=0"]
            status = self._pytest(words, log, None, {"COVERAGE_FILE": str(part)})
            if status not in (pytest.ExitCode.OK, pytest.ExitCode.TESTS_FAILED):
                raise ValueError(f"pytest could not run the tests: {log} says why")
            part.replace(self._lines)
        self._contexts.read()
        text = log.read_text("utf-8")
        for seconds, name in _TIME.findall(text):
            self._seconds[name] += float(seconds)
        self._unreliable.update(self._test_in(line) for line in _FAILURE.findall(text))

    def _pytest(
        self, words: Sequence[str], log: Path, seconds: float | None, added: Mapping[str, str]
    ) -> int | None:
        """Return the status of pytest in the copy, None if it took longer; all that it has started is ended as well."""
        environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", **added}
        # Tracing and what is set up for a single test take time, of which a test without a mark has little.
        environment["FARSTEER_TEST_CPU_FACTOR"] = "10"
        # The copy comes before an editable installation of the clone.
        environment["PYTHONPATH"] = str(self.tree)
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *_RECORDED]
        with log.open("w") as output:
            process = subprocess.Popen(
                [*command, *words],
                cwd=self.tree,
                env=environment,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
            try:
                return process.wait(seconds)
            except subprocess.TimeoutExpired:
                return None
            finally:
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(process.pid, signal.SIGKILL)
                process.wait()

    def _run(self, tests: Sequence[str], seconds: float) -> tuple[int | None, str]:
        """Run tests until one fails; return pytest's status, None if it took longer, and what it says of the failure."""
        chosen, log = self._folder / "chosen.txt", self._folder / "log.txt"
        left_out = (f"--deselect={name}" for name in self._unreliable)
        chosen.write_text("\n".join((*left_out, *tests)), "utf-8")
        status = self._pytest(["-x", f"@{chosen}"], log, seconds, {})
        if status is None:
            return None, f"no end in {seconds:.0f} s"
        text = log.read_text("utf-8", errors="replace").strip()
        said = _FAILURE.findall(text) or text.splitlines() or ["pytest ended without a word"]
        return status, said[-1]

    def _test_in(self, line: str) -> str:
        """Return the recorded test that a line of pytest's is about, or nothing."""
        words = f"{line.partition(' ')[2]} - "
        return max((n for n in self._seconds if words.startswith(f"{n} - ")), key=len, default="")

    def _that_run(self, mutant: Mutant) -> tuple[list[str], list[str]]:
        """Return the tests that run a mutant, those of its folder and the others, the fastest first.

        What runs while its file is imported can change whatever runs in that file.
        """
        contexts = self._contexts.contexts_by_lineno(mutant.path)
        lines = contexts.keys() if mutant.imported else mutant.lines
        found = {name.rpartition("|")[0] for line in lines for name in contexts.get(line, ())}
        tests = found & self._seconds.keys()
        folder = f"tests/{PurePosixPath(mutant.path).parent}"
        near, far = list[str](), list[str]()
        for name in sorted(tests - self._unreliable, key=lambda name: (self._seconds[name], name)):
            (near if _file(name).rpartition("/")[0] == folder else far).append(name)
        return near, far

    def outcome(self, mutant: Mutant, limit: float) -> Figure:
        """Try whether a mutant is caught: a test fails that passes without it, or its tests do not end.

        Args:
            mutant: to try.
            limit: tests are run that took so long together, and at least one [s].

        Returns:
            1 if it was caught, else 0, with what caught it, and the number of tests that were to be run.
        """
        how, spent, chosen, left = "", 0.0, 0, 0
        for tests in self._that_run(mutant):
            batch = list[str]()
            for name in tests:
                spent += self._seconds[name]
                if spent <= limit or not chosen + len(batch):
                    batch.append(name)
            chosen, left = chosen + len(batch), left + len(tests) - len(batch)
            how = how or self._caught_by(batch, mutant)
        if not how:
            how = f"survived: {left} slower tests not run" if left else "survived"
            how = how if chosen else "survived: no recorded test runs it"
        return Figure(mutant.case, mutant.change, how, float(how.startswith("caught")), n=chosen)

    def _caught_by(self, tests: Sequence[str], mutant: Mutant) -> str:
        while tests:
            seconds = PATIENCE + 5.0 * sum(self._seconds[name] for name in tests)
            with self._changed(mutant):
                status, said = self._run(tests, seconds)
                if status == pytest.ExitCode.USAGE_ERROR:
                    # Names of parameters depend on the code, so that a test is not found: take whole files.
                    status, said = self._run(sorted({_file(name) for name in tests}), seconds)
            if status == pytest.ExitCode.OK:
                break
            failed = self._test_in(said)
            if status is None or not failed:
                return f"caught: {said[:160]}"
            if self._run([failed], seconds)[0] == pytest.ExitCode.OK:
                return f"caught by {failed}"
            self._unreliable.add(failed)
            tests = [name for name in tests if name != failed]
        return ""

    @contextlib.contextmanager
    def _changed(self, mutant: Mutant) -> Iterator[None]:
        path = self.tree / mutant.path
        compiled = Path(cache_from_source(str(path)))
        try:
            path.write_text(mutant.applied_to(self.sources[mutant.path]), "utf-8")
            # Compiled code is taken for current if second and size of the source are the same.
            compiled.unlink(missing_ok=True)
            yield
        finally:
            path.write_text(self.sources[mutant.path], "utf-8")
            compiled.unlink(missing_ok=True)


def _file(test: str) -> str:
    return test.partition("::")[0]


def _git(folder: Path, *words: str) -> str:
    command = ["git", "-C", str(folder), *words]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()
