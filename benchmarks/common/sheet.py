"""A sheet of figures: a JSON file that keeps them part by part, each figure on a line.

A part that is measured anew takes the place of what was there of it, so that a long table can be made in
pieces; each names the commit that it was measured at. Once all parts have been measured in one run, those of other
commits are dropped: the sheet is renewed whole. ``python -m benchmarks.common.sheet FILE ...`` writes sheets anew as this module does.
"""

from __future__ import annotations

import datetime
import json
import math
import os
import platform
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import fields
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.common.figures import Figure, say


class Sheet:
    """Figures by part; owns the file they are kept in, if there is one."""

    def __init__(self, path: Path | None = None) -> None:
        """Read what the file holds; it need not exist.

        Raises:
            ValueError: if it is there and is no sheet.
        """
        self.path = path
        self.commit = commit()
        self.parts: dict[str, tuple[Figure, ...]] = {}
        self.facts: dict[str, dict[str, str | float]] = {}
        if path is not None and path.is_file():
            self._read(path)

    def _read(self, path: Path) -> None:
        try:
            held = json.loads(path.read_text(encoding="utf-8"))
            for name, part in held.items():
                self.parts[name] = tuple(_figure(f) for f in part["figures"])
                self.facts[name] = dict(part["facts"])
        except (AttributeError, KeyError, TypeError, json.JSONDecodeError) as wrong:
            raise ValueError(f"{path} is no sheet of figures: move it away ({wrong})") from None

    def put(self, part: str, figures: Iterable[Figure], *, seconds: float) -> None:
        """Take a part's figures, which took so much CPU time [s], and write the file.

        What somebody else has put into the file meanwhile stays.
        """
        if self.path is not None and self.path.is_file():
            self._read(self.path)
        self.parts[part] = tuple(figures)
        self.facts[part] = {
            "date": f"{datetime.datetime.now():%Y-%m-%d %H:%M}",
            "commit": self.commit,
            "machine": processor(),
            "python": platform.python_version(),
            "load": round(os.getloadavg()[0], 1),
            "cpu_seconds": round(seconds, 1),
        }
        self.write()

    def drop_other_commits(self) -> list[str]:
        """Drop the parts that were not measured at this commit, and return their names."""
        others = [name for name, told in self.facts.items() if told.get("commit") != self.commit]
        for name in others:
            del self.parts[name], self.facts[name]
        self.write()
        return others

    def write(self) -> None:
        """Write the file, if there is one."""
        if self.path is None:
            return
        self.path.parent.mkdir(parents=True, exist_ok=True)
        # Written beside and moved, so that a run that is ended leaves the sheet whole.
        beside = self.path.with_suffix(".part")
        beside.write_text(self.text, encoding="utf-8")
        beside.replace(self.path)

    @property
    def text(self) -> str:
        """The sheet as it is in its file."""
        parts = []
        for name, figures in self.parts.items():
            facts = f'  "facts": {_json(self.facts[name])},\n  "figures": ['
            lines = ",".join(f"\n   {_json(_plain(figure))}" for figure in figures)
            parts.append(f" {_json(name)}: {{\n{facts}{lines}\n  ]\n }}")
        return "{\n" + ",\n".join(parts) + "\n}\n"


def _json(value: object) -> str:
    return json.dumps(value, default=_native)


def _native(value: np.generic) -> object:
    """Return a number of numpy's as one of Python's."""
    return value.item()


def _figure(held: dict[str, Any]) -> Figure:
    return Figure(**{**held, "value": math.nan if held["value"] is None else held["value"]})


def _plain(figure: Figure) -> dict[str, str | float | int | None]:
    """Return a figure's fields that say something; a value that is no number becomes None, for JSON has no NaN."""
    kept: dict[str, str | float | int | None] = {}
    for field in fields(figure):
        value = getattr(figure, field.name)
        if isinstance(value, float):
            value = round(value, 6) if math.isfinite(value) else None
        if field.name == "value" or (value is not None and value != field.default):
            kept[field.name] = value
    return kept


def cpu_seconds() -> float:
    """Return the processor time of this process, and of those that have driven for it [s]."""
    return sum(os.times()[:4])


def processor() -> str:
    """Return what the machine calls its processor."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.is_file() else []
    named = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(named, platform.machine())


@cache
def commit() -> str:
    """Return the short hash of the commit that runs, with ``-dirty`` if files differ from it; nothing outside of a clone.

    Only what the process loaded counts: results and the sheets made of them may differ. A process asks once,
    before it measures.
    """
    git = ("git", "-C", str(Path(__file__).resolve().parents[2]))
    kept = (":!benchmarks/results", ":!docs/sheets")
    try:
        told = [
            subprocess.run([*git, *words], check=True, capture_output=True, text=True).stdout
            for words in (
                ("rev-parse", "--short", "HEAD"),
                ("status", "--porcelain", "--untracked-files=no", "--", ".", *kept),
            )
        ]
    except (OSError, subprocess.CalledProcessError):
        return ""
    return told[0].strip() + ("-dirty" if told[1] else "")


def measure(
    parts: Mapping[str, Callable[[], Iterator[Figure]]], out: Path | None, *, whole: bool
) -> None:
    """Measure parts one after the other, print their figures, and keep them in a sheet if one is named.

    Args:
        parts: by name.
        out: the sheet.
        whole: whether these are all parts of a benchmark but long ones: then the sheet is renewed whole.
    """
    sheet = Sheet(out)
    for name, part in parts.items():
        begun, figures = cpu_seconds(), list[Figure]()
        say(f" {name}")
        for figure in part():
            _show(figure, figures[-1] if figures else None)
            figures.append(figure)
        seconds = cpu_seconds() - begun
        sheet.put(name, figures, seconds=seconds)
        say(f"   ({seconds:.0f} s of CPU)")
    if whole:
        renew(sheet)


def renew(sheet: Sheet) -> None:
    """Drop what a sheet holds of other commits, and say so."""
    dropped = sheet.drop_other_commits()
    if dropped:
        say(f" dropped, as they are of other commits: {', '.join(dropped)}")


def _show(figure: Figure, before: Figure | None) -> None:
    """Print a figure beneath its case and method, which are printed when they change."""
    if before is None or (before.case, before.method) != (figure.case, figure.method):
        say(f"  {figure.case}: {figure.method}")
    count = f"n {figure.n}" if figure.n else ""
    goal = f"goal {figure.goal}: {figure.verdict}" if figure.verdict else ""
    say(f"    {figure.quantity:38s} {figure.text:28s} {count:8s} {goal}".rstrip())


if __name__ == "__main__":
    for named in sys.argv[1:]:
        Sheet(Path(named)).write()
