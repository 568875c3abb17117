"""The command ``farsteer sweep``."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from localization.cli.terminal import Progress, fitted, say, say_json
from localization.extras import require
from teleop.errors import SettingError

if TYPE_CHECKING:
    from teleop.scenario.files.scenario import Scenario
    from teleop.scenario.sweeps.cells import Run
    from teleop.scenario.sweeps.dask_workers import Workers
    from teleop.scenario.sweeps.running import RunResult
    from teleop.scenario.sweeps.sweep import Compute, Swept


@dataclass(frozen=True)
class Sweep:
    """Run a scenario over ranges of its fields and over seeds, on all cores or on a Dask cluster.

    Each combination of the values is a cell; it is run with as many seeds as --seeds says, in lockstep, each a
    hash of the cell and its number. The results are in one folder: sweep.parquet with a row for each run, the
    same to the bit from any number of workers; sweep.html with the share that passed and the quantiles of error
    and stopping way over each field; failed/ with a scenario file for each cell that failed. After Ctrl-C the same
    command goes on where it was; with more values or seeds it runs only those that are new.

    Examples: `farsteer sweep link-lost-on-the-way --over operator.speed=0.3:1.2:0.3 --seeds 20`, or
    `farsteer sweep my.toml --over link.delay=0:2:0.25 --stale on --over world.alive=false,true`.

    The exit status is 0 if every run could be judged, whatever its verdict, 2 if one could not, and 130 if
    interrupted.
    """

    file: Annotated[str, tyro.conf.Positional]
    """A scenario file, or the name of a scenario of the project (`farsteer scenario list`)."""
    over: Annotated[
        tyro.conf.UseAppendAction[tuple[str, ...]], tyro.conf.arg(metavar="FIELD=VALUES")
    ] = ()
    """A field (`farsteer scenario explain` lists them) and its values: a range 0:2:0.25, a list 1,2,5, or words;
    link.delay and its like mean the link of the whole run. Can be given several times."""
    seeds: int = 10
    """Number of runs of each cell."""
    stale: Literal["on", "off"] | None = None
    """Whether the robot slows down for commands that are older than 0.5 s, and refuses those older than 1 s; must
    be given where the link is swept."""
    workers: int | None = None
    """Processes on this machine; one for each core unless given."""
    dask: str = ""
    """Address of a Dask scheduler whose workers have farsteer installed: tls://HOST:PORT, or tcp:// on this
    machine."""
    tls_ca_file: Path | None = None
    """Certificate of the authority of --dask tls://; that of Dask's own configuration unless given."""
    tls_cert: Path | None = None
    """Own certificate for --dask tls://."""
    tls_key: Path | None = None
    """Own key for --dask tls://."""
    out: Path | None = None
    """Folder for the files; one in runs/ that the same command finds again, unless given."""
    overwrite: bool = False
    """Begin anew in a folder that holds a sweep already."""
    json: bool = False
    """Print the results as JSON."""

    def __call__(self) -> int:
        """Run what is missing, and report."""
        for library in ("mujoco", "pydantic", "websockets", "distributed", "pyarrow"):
            require(library, "a sweep")

        from localization.cli.run_folder import check_folder, writing_to
        from teleop.scenario.files.reading import read_scenario
        from teleop.scenario.files.shipped import scenario_files
        from teleop.scenario.sweeps.axes import axis_of
        from teleop.scenario.sweeps.cells import cells_of
        from teleop.scenario.sweeps.sweep import default_folder, sweep
        from teleop.scenario.sweeps.sweep_folder import FILES, SweepFolder

        workers = self._workers()
        (file,) = self._one(scenario_files([self.file]))
        axes = [axis_of(text) for text in self.over]
        if not axes:
            raise SettingError(
                "nothing is swept: give --over FIELD=VALUES, such as link.delay=0:2:1"
            )
        names = [axis.name for axis in axes]
        scenario = self._with_stale(read_scenario(file), names)
        cells = cells_of(scenario, axes)
        path = self.out or default_folder(scenario, names)
        check_folder(path, ())
        if self.overwrite:
            for name in FILES:
                (path / name).unlink(missing_ok=True)
        bar = Progress()
        with writing_to(path):
            folder = SweepFolder(path, scenario, names)
            try:
                compute = _compute(workers, file.parent)
                swept = sweep(cells, self.seeds, folder, compute, bar)
            finally:
                folder.close()
            bar.end()
            return self._report(scenario, swept, path, names)

    @staticmethod
    def _one(files: Sequence[Path]) -> tuple[Path]:
        if len(files) != 1:
            raise SettingError(f"a sweep is of one scenario; {len(files)} files are given")
        return (files[0],)

    def _workers(self) -> Workers:
        from teleop.scenario.sweeps.dask_workers import Workers

        given = [file for file in (self.tls_ca_file, self.tls_cert, self.tls_key) if file]
        if given and len(given) < 3:
            raise SettingError("--tls-ca-file, --tls-cert and --tls-key are given together")
        tls = (given[0], given[1], given[2]) if given else None
        return Workers(self.workers, self.dask, tls)

    def _with_stale(self, scenario: Scenario, names: Sequence[str]) -> Scenario:
        """Return the scenario with the limits on old commands as the user has said."""
        is_swept = "world.stale_limits" in names
        links = [name for name in names if name.rpartition(".")[2] in ("delay", "jitter", "rate")]
        if self.stale is None and links and not is_swept:
            raise SettingError(
                f"--over {links[0]}: say --stale on or --stale off: above a delay of 0.5 s it decides what the robot"
                " does (on: it slows down, and stops at 1 s; off: it obeys commands of any age)"
            )
        if self.stale is not None and is_swept:
            raise SettingError(
                "--stale and --over world.stale_limits say the same; give one of them"
            )
        if self.stale is None:
            return scenario
        world = replace(scenario.world, stale_limits=self.stale == "on")
        return replace(scenario, world=world)

    def _report(self, scenario: Scenario, swept: Swept, path: Path, names: Sequence[str]) -> int:
        from localization.report.plain_text import plain_text
        from teleop.scenario.sweeps.failed_files import write_failed
        from teleop.scenario.sweeps.sweep_folder import PAGE
        from teleop.scenario.sweeps.sweep_page import groups, page

        (path / PAGE).write_text(page(scenario, swept, self._command(path)), encoding="utf-8")
        write_failed(swept.rows, path)
        unrunnable = swept.unrunnable
        if self.json:
            say_json(_plain(swept, path))
        else:
            say(*groups(swept.rows, names), "")
            say(*fitted(*swept.costs.lines()))
            if swept.earlier:
                say(f"{swept.earlier} of {swept.total} runs were known before")
            if unrunnable:
                say(*fitted(f"{len(unrunnable)} could not be run; the first:"))
                say(*fitted(f"  {plain_text(unrunnable[0][1].ending)}"))
            say(f"files in {path}/")
        if swept.is_interrupted:
            if not self.json:
                done = f"{len(swept.rows)} of {swept.total} runs"
                say(f"interrupted: {done} are kept; the same command goes on")
            return 130
        return 2 if unrunnable else 0

    def _command(self, path: Path) -> str:
        words = ["farsteer", "sweep", self.file]
        for text in self.over:
            words += ["--over", text]
        words += ["--seeds", str(self.seeds)]
        if self.stale:
            words += ["--stale", self.stale]
        return shlex.join([*words, "--out", str(path)])


def _compute(workers: Workers, beside: Path) -> Compute:
    from teleop.scenario.sweeps.dask_runs import results_of

    def compute(runs: Sequence[Run]) -> Iterator[tuple[Run, RunResult]]:
        return results_of(runs, workers, beside=beside)

    return compute


def _plain(swept: Swept, path: Path) -> dict[str, object]:
    from teleop.scenario.sweeps.sweep_statistics import share_passed

    share = share_passed(swept.rows)
    return {
        "runs": len(swept.rows),
        "total": swept.total,
        "passed": share.passed,
        "interval": share.interval,
        "unrunnable": len(swept.unrunnable),
        "interrupted": swept.is_interrupted,
        "costs": swept.costs,
        "folder": path,
    }
