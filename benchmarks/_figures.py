"""Measured figures: each with its count, its 95 % bounds and its goal; kept in a file, part by part.

A sheet is a JSON file beside which the same figures lie as CSV. A part that is measured anew takes the
place of what was there of it, and nothing else changes, so that a long table can be made in pieces.
"""

from __future__ import annotations

import csv
import datetime
import json
import math
import os
import platform
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import chi2

OURS = "Farsteer"
"""What our own localiser is called beside its peers."""


def say(*lines: str) -> None:
    """Print at once, for some parts take minutes."""
    sys.stdout.write("\n".join(lines) + "\n")
    sys.stdout.flush()


@dataclass(frozen=True, slots=True)
class Figure:
    """One number, and what it rests on."""

    case: str
    method: str
    quantity: str
    value: float
    unit: str = ""
    n: int = 0
    """How many sweeps, trials or events it was counted over."""
    low: float | None = None
    """95 % bounds."""
    high: float | None = None
    least: float | None = None
    """What it should be at least ..."""
    most: float | None = None
    """... and at most."""

    @property
    def verdict(self) -> str:
        """Whether the goal is met, and whether the bounds prove it; nothing without a goal."""
        if self.least is None and self.most is None:
            return ""
        least = -math.inf if self.least is None else self.least
        most = math.inf if self.most is None else self.most
        if not least <= self.value <= most:
            return "missed"
        if self.low is None or self.high is None:
            return "met"
        return "met" if least <= self.low and self.high <= most else "met, not proved"

    @property
    def goal(self) -> str:
        """The goal in words."""
        unit = spaced(self.unit)
        if self.least is not None and self.most is not None:
            return f"{self.least:g} to {self.most:g}{unit}"
        if self.least is not None:
            return f">= {self.least:g}{unit}"
        return f"<= {self.most:g}{unit}" if self.most is not None else ""

    @property
    def text(self) -> str:
        """The number with its bounds and unit."""
        bounds = ""
        if self.low is not None and self.high is not None:
            bounds = f" ({digits(self.low)}-{digits(self.high)})"
        return f"{digits(self.value)}{bounds}{spaced(self.unit)}"


def digits(value: float) -> str:
    """Return a number with about three digits that count, and none beyond a thousandth."""
    if not math.isfinite(value):
        return "-"
    places = 3 if abs(value) < 0.1 else 2 if abs(value) < 10.0 else 1
    text = f"{value:.{places}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def spaced(unit: str) -> str:
    """Return a unit as it follows a number."""
    return f" {unit}" if unit else ""


def share(
    case: str,
    method: str,
    quantity: str,
    good: int,
    n: int,
    *,
    least: float | None = None,
    most: float | None = None,
) -> Figure:
    """Return a share of trials [%] with Wilson's bounds; its goals are in per cent too."""
    low, high = wilson(good, n)
    value = 100.0 * good / max(n, 1)
    return Figure(
        case, method, quantity, value, "%", n, 100.0 * low, 100.0 * high, least=least, most=most
    )


def wilson(good: int, count: int) -> tuple[float, float]:
    """Return Wilson's 95 % bounds of a share."""
    if not count:
        return 0.0, 1.0
    z2 = 1.96**2
    part = good / count
    middle = (part + z2 / (2 * count)) / (1 + z2 / count)
    half = np.sqrt(part * (1 - part) * z2 / count + z2**2 / (4 * count**2)) / (1 + z2 / count)
    return max(0.0, float(middle - half)), min(1.0, float(middle + half))


def poisson(events: int) -> tuple[float, float]:
    """Return Garwood's exact 95 % bounds of how many events were to be expected."""
    low = 0.5 * float(chi2.ppf(0.025, 2 * events)) if events else 0.0
    return low, 0.5 * float(chi2.ppf(0.975, 2 * events + 2))


def _native(value: np.generic) -> object:
    """Return a number of numpy's as one of Python's."""
    return value.item()


class Sheet:
    """Figures by part; owns the file they are kept in, if there is one."""

    def __init__(self, path: Path | None = None) -> None:
        """Read what the file holds; it need not exist.

        Raises:
            ValueError: if it is there and is no sheet.
        """
        self.path = path
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
        """Take a part's figures, which took so much CPU time [s], and write the files.

        What somebody else has put into the file meanwhile stays.
        """
        if self.path is not None and self.path.is_file():
            self._read(self.path)
        self.parts[part] = tuple(figures)
        self.facts[part] = {
            "date": f"{datetime.datetime.now():%Y-%m-%d %H:%M}",
            "machine": processor(),
            "python": platform.python_version(),
            "load": round(os.getloadavg()[0], 1),
            "cpu_seconds": round(seconds, 1),
        }
        if self.path is not None:
            self._write(self.path)

    def _write(self, path: Path) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        held = {
            name: {"facts": self.facts[name], "figures": [_plain(f) for f in figures]}
            for name, figures in self.parts.items()
        }
        # Written beside and moved, so that a run that is ended leaves the sheet whole.
        beside = path.with_suffix(".part")
        beside.write_text(json.dumps(held, indent=1, default=_native) + "\n", encoding="utf-8")
        beside.replace(path)
        with path.with_suffix(".csv").open("w", encoding="utf-8", newline="") as file:
            names = [f.name for f in fields(Figure)]
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(["part", *names, "verdict"])
            for part, figures in self.parts.items():
                writer.writerows([part, *_plain(f).values(), f.verdict] for f in figures)


def _figure(held: dict[str, Any]) -> Figure:
    return Figure(**{**held, "value": math.nan if held["value"] is None else held["value"]})


def _plain(figure: Figure) -> dict[str, str | float | int | None]:
    """Return a figure's fields; what is no number becomes None, for JSON has no NaN."""
    kept = asdict(figure)
    for name, value in kept.items():
        if isinstance(value, float):
            kept[name] = round(value, 6) if math.isfinite(value) else None
    return kept


def processor() -> str:
    """Return what the machine calls its processor."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.is_file() else []
    named = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(named, platform.machine())


def measure(parts: Mapping[str, Callable[[], Iterator[Figure]]], out: Path | None) -> None:
    """Measure parts one after the other, print their figures, and keep them in a sheet if one is named."""
    sheet = Sheet(out)
    for name, part in parts.items():
        begun, figures = time.process_time(), list[Figure]()
        say(f" {name}")
        for figure in part():
            _show(figure, figures[-1] if figures else None)
            figures.append(figure)
        seconds = time.process_time() - begun
        sheet.put(name, figures, seconds=seconds)
        say(f"   ({seconds:.0f} s of CPU)")


def _show(figure: Figure, before: Figure | None) -> None:
    """Print a figure beneath its case and method, which are printed when they change."""
    if before is None or (before.case, before.method) != (figure.case, figure.method):
        say(f"  {figure.case}: {figure.method}")
    count = f"n {figure.n}" if figure.n else ""
    goal = f"goal {figure.goal}: {figure.verdict}" if figure.verdict else ""
    say(f"    {figure.quantity:38s} {figure.text:28s} {count:8s} {goal}".rstrip())
