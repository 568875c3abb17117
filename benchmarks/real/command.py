"""Localisation on real CARMEN logs beside other methods: error, relations, states, kidnaps, starts.

``python -m benchmarks real FOLDER [--logs NAME ...] [--begin S] [--end S] [--yaw FACTOR ...] [--stamps HOW ...]
[--peers] [--runs N] [--yardstick SCRIPT] [--submission FILE] [--kidnaps N] [--hints N] [--seed S] [--all]
[--set KEY=VALUE ...] [--keep FOLDER] [--out FOLDER]``: the folder holds ``NAME-corrected.log.gz``, and ``NAME.clf.bz2``
and ``NAME.relations`` if there are any; all its logs are run unless some are named. The map of a log is made of every second
corrected scan, and the others are what the error is measured against. Each is replayed three times, with ranges that differ by a
millionth, and the figures are means. ``--all`` runs the peers, 50 kidnaps
and 30 starts of each kind a log; ``--out`` keeps the figures in ``real.json``, and the tables in ``real.md``;
``--all`` without ``--logs`` renews it whole, so changed odometry and stamps come after it.
"""

from __future__ import annotations

import argparse
import dataclasses
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.common.figures import say
from benchmarks.common.progress import minutes, note
from benchmarks.common.sheet import Sheet, renew
from benchmarks.real.logs import STAMPS, Excerpt, real_drive
from benchmarks.real.runs import HEAD, Wanted, keep, parts
from benchmarks.real.submissions import read_submission
from benchmarks.real.yardstick import YardstickError
from localization.errors import LocalizationError
from localization.pipeline.localizer import LocalizerConfig

TAKES_WORDS = True
"""Whether all words after the benchmark's name are its own arguments."""
_ALL_KIDNAPS, _ALL_HINTS = 50, 30
_CORRECTED = "-corrected.log.gz"
"""End of the names of files with corrected poses."""


def main(words: Sequence[str] = (), *, out: Path | None = None) -> None:
    """Run the named excerpts and print a table; nothing without a folder.

    Args:
        words: of the command line, after the benchmark's name.
        out: the sheet that keeps the figures; the tables go beside it.
    """
    if not words:
        say("no folder of logs was given: skipped")
        return
    a = _arguments(words)
    try:
        _run(a, Sheet(out))
    except (LocalizationError, YardstickError) as error:
        sys.exit(f"real: {error}")
    if out is not None:
        say("", f"figures: {out}; tables: {out.with_suffix('.md').name}")


def _run(a: argparse.Namespace, sheet: Sheet) -> None:
    wanted = Wanted(
        a.folder,
        peers=a.peers,
        yardstick=a.yardstick,
        submissions=tuple(read_submission(path) for path in a.submission),
        kidnaps=a.kidnaps,
        hints=a.hints,
        runs=a.runs,
        seed=a.seed,
        keep=a.keep,
    )
    names = a.logs or _logs(a.folder)
    cases = [Excerpt(n, a.begin, a.end, y, s) for n in names for y in a.yaw for s in a.stamps]
    begun = time.monotonic()
    say(HEAD)
    for i, excerpt in enumerate(cases):
        if i:
            each = (time.monotonic() - begun) / i
            note(f"{i} of {len(cases)} excerpts, about {minutes(each * (len(cases) - i))} left")
        drive = real_drive(a.folder, excerpt)
        config = changed(LocalizerConfig.of(drive.log.sensors), a.set)
        for part, figures in parts(wanted, excerpt, drive, config):
            keep(sheet, part, figures)
    if a.all and not a.logs:
        renew(sheet)


def _logs(folder: Path) -> list[str]:
    """Return the names of the logs in a folder."""
    return sorted(path.name.removesuffix(_CORRECTED) for path in folder.glob(f"*{_CORRECTED}"))


def _arguments(words: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks real")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--logs", nargs="+")
    parser.add_argument("--begin", type=float, default=0.0, help="after the first scan [s]")
    parser.add_argument("--end", type=float, default=1e9, help="after the first scan [s]")
    parser.add_argument(
        "--yaw", type=float, nargs="+", default=[1.0], help="odometry's turns are multiplied by"
    )
    parser.add_argument("--stamps", nargs="+", choices=STAMPS, default=["logged"])
    parser.add_argument("--peers", action="store_true", help="other methods on the same excerpts")
    parser.add_argument(
        "--yardstick", type=Path, metavar="SCRIPT", help="that writes PREFIX_est.tum, see the docs"
    )
    parser.add_argument(
        "--submission",
        type=Path,
        nargs="+",
        default=[],
        metavar="FILE",
        help="poses of others, TUM",
    )
    parser.add_argument("--kidnaps", type=int, default=0, metavar="N", help="on each excerpt")
    parser.add_argument("--hints", type=int, default=0, metavar="N", help="starts of each kind")
    parser.add_argument(
        "--runs", type=int, default=3, metavar="N", help="of each, ranges changed by a millionth"
    )
    parser.add_argument("--seed", type=int, default=0, help="of places and of the hints' errors")
    parser.add_argument(
        "--all",
        action="store_true",
        help=f"--peers --kidnaps {_ALL_KIDNAPS} --hints {_ALL_HINTS}",
    )
    parser.add_argument(
        "--set", nargs="+", default=[], metavar="KEY=VALUE", help="such as registration.sigma=0.03"
    )
    parser.add_argument(
        "--keep", type=Path, help="folder for the poses and errors at each scan, as .npz"
    )
    a = parser.parse_args(list(words))
    if a.all:
        a.peers = True
        a.kidnaps, a.hints = a.kidnaps or _ALL_KIDNAPS, a.hints or _ALL_HINTS
    if a.runs < 1:
        parser.error(f"--runs must be at least 1, got {a.runs}")
    if a.yardstick is not None and not a.yardstick.is_file():
        parser.error(f"--yardstick {a.yardstick}: no such file")
    if not (a.logs or _logs(a.folder)):
        parser.error(f"{a.folder} holds no log NAME{_CORRECTED}")
    if len(a.submission) and len(a.logs or ()) != 1:
        parser.error("--submission holds poses of one log: name it with --logs NAME")
    return a


def changed(config: LocalizerConfig, settings: Sequence[str]) -> LocalizerConfig:
    """Return a configuration with settings such as ``registration.sigma=0.03`` changed.

    Raises:
        ValueError: if a setting has no such form.
    """
    for setting in settings:
        key, _, value = setting.partition("=")
        config = _with(config, key.split("."), value)
    return config


def _with(config: Any, path: Sequence[str], value: str) -> Any:
    name, *rest = path
    old = getattr(config, name)
    new: Any
    if rest:
        new = _with(old, rest, value)
    elif isinstance(old, bool):
        new = value.lower() in ("1", "true", "yes")
    elif isinstance(old, tuple):
        new = tuple(float(v) for v in value.split(","))
    else:
        new = type(old)(float(value)) if isinstance(old, int | float) else type(old)(value)
    return dataclasses.replace(config, **{name: new})
