"""The folder of a sweep: a line for each run as it ends, and the table of all of them as Parquet."""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TextIO

from localization.extras import require
from teleop.errors import SettingError
from teleop.scenario.files.scenario import SCHEMA, Scenario
from teleop.scenario.sweeps.axes import Value
from teleop.scenario.sweeps.cells import Run, seed_of
from teleop.scenario.sweeps.running import RunResult, deciding_versions

if TYPE_CHECKING:
    import pyarrow as pa

DEFINITION: Final = "sweep.json"
"""What is swept, and by which versions."""
JOURNAL: Final = "runs.jsonl"
"""What each run has shown, in the order in which they ended."""
TABLE: Final = "sweep.parquet"
"""A row for each run, in the order of cells and seeds."""
PAGE: Final = "sweep.html"
"""The report."""
FILES: Final = (DEFINITION, JOURNAL, TABLE, PAGE)


class SweepFolder:
    """Owns the files of a sweep; what has ended once is not run again."""

    def __init__(self, path: Path, scenario: Scenario, fields: Sequence[str]) -> None:
        """Open a folder, new or of the same sweep, which may have had other values and fewer seeds.

        Args:
            path: The folder.
            scenario: The scenario that is swept.
            fields: The fields that are swept.

        Raises:
            SettingError: If it holds a sweep of another scenario, of other fields, or by another version; or if
                another process is at work in it.
        """
        self.path = path
        definition = {
            "scenario": SCHEMA.dump_python(scenario, mode="json"),
            "over": sorted(fields),
            "versions": deciding_versions(),
        }
        path.mkdir(parents=True, exist_ok=True)
        _check_same(path / DEFINITION, definition)
        self._journal: TextIO = (path / JOURNAL).open("a", encoding="utf-8")
        try:
            fcntl.flock(self._journal, fcntl.LOCK_EX | fcntl.LOCK_NB)
            (path / DEFINITION).write_text(
                json.dumps(definition, indent=2) + "\n", encoding="utf-8"
            )
            self.results: dict[str, RunResult] = _read(path / JOURNAL)
            """What is known, by the key of the run."""
        except BlockingIOError:
            self._journal.close()
            raise SettingError(f"{path}: another sweep is at work in this folder") from None
        except BaseException:
            self._journal.close()
            raise

    def keep(self, run: Run, result: RunResult) -> None:
        """Keep what a run has shown; it is in the file when this returns, whatever happens to the process."""
        self.results[run.key] = result
        line = {"key": run.key, **asdict(result)}
        self._journal.write(json.dumps(line, separators=(",", ":")) + "\n")
        self._journal.flush()

    def close(self) -> None:
        """Close the journal."""
        self._journal.close()

    def write_table(self, rows: Sequence[tuple[Run, RunResult]]) -> None:
        """Write the Parquet file, in the place of an earlier one."""
        require("pyarrow", "the table of a sweep")
        import pyarrow.parquet as pq

        part = self.path / f".{TABLE}.part"
        pq.write_table(table_of(rows), part, compression="zstd")
        part.replace(self.path / TABLE)


def _check_same(file: Path, definition: Mapping[str, Any]) -> None:
    if not file.exists():
        return
    try:
        held = json.loads(file.read_text(encoding="utf-8"))
        scenario, over, versions = held["scenario"], held["over"], held["versions"]
    except (ValueError, KeyError, TypeError):
        raise SettingError(f"{file} is damaged; give another --out, or --overwrite") from None
    if scenario != definition["scenario"]:
        raise SettingError(
            f"{file.parent} holds a sweep of another scenario ({scenario.get('name')!r}, perhaps before it was"
            " edited, or with another --stale): give another --out, or --overwrite"
        )
    if over != definition["over"]:
        raise SettingError(
            f"{file.parent} holds a sweep over {', '.join(over)}: give another --out, or --overwrite"
        )
    if versions != definition["versions"]:
        different = [n for n, v in definition["versions"].items() if versions.get(n) != v]
        raise SettingError(
            f"{file.parent} was begun by another version of {', '.join(different)}, which may give other"
            " bits: give another --out, or --overwrite"
        )


def _read(file: Path) -> dict[str, RunResult]:
    """Return what a journal holds; its last line may be cut off, where the process was killed as it wrote."""
    if not file.exists():
        return {}
    lines = file.read_bytes().split(b"\n")
    if lines[-1]:
        with file.open("r+b") as opened:
            opened.truncate(sum(len(line) + 1 for line in lines[:-1]))
            os.fsync(opened.fileno())
    results = {}
    for number, line in enumerate(lines[:-1], 1):
        try:
            fields = json.loads(line)
            key = fields.pop("key")
            result = RunResult(**fields)
            # What could not begin may have been mended since: a scene that was missing, say.
            if result.verdict != "bad input":
                results[key] = result
        except (ValueError, KeyError, TypeError) as error:
            raise SettingError(f"{file}:{number}: is damaged: {error}") from None
    return results


def table_of(rows: Sequence[tuple[Run, RunResult]]) -> pa.Table:
    """Return one row for each run, by cell and number of the seed: the same bits from any number of workers."""
    import pyarrow as pa

    rows = sorted(rows, key=lambda row: (row[0].cell.number, row[0].number))
    names = dict.fromkeys(name for _, result in rows for name in result.figures)
    fields = [name for name, _ in rows[0][0].cell.values] if rows else []
    columns: dict[str, pa.Array] = {}
    for i, name in enumerate(fields):
        columns[name] = pa.array(_plain([run.cell.values[i][1] for run, _ in rows]))
    columns["run"] = pa.array([run.number for run, _ in rows], pa.int32())
    columns["seed"] = pa.array([seed_of(run.cell, run.number) for run, _ in rows], pa.int64())
    for text in ("verdict", "ending", "missed"):
        columns[text] = pa.array([getattr(result, text) for _, result in rows], pa.string())
    for name in names:
        values = [result.figures.get(name) for _, result in rows]
        columns[_free(name, columns)] = pa.array(values, pa.float64())
    columns["sha256"] = pa.array([result.sha256 for _, result in rows], pa.string())
    return pa.table(columns)


def _plain(values: list[Value]) -> list[Any]:
    """Return values of one type; places, which may be names or coordinates, as text."""
    if any(isinstance(value, list) for value in values):
        return [value if isinstance(value, str) else json.dumps(value) for value in values]
    return list(values)


def _free(name: str, columns: Mapping[str, object]) -> str:
    return f"figure.{name}" if name in columns else name
