"""Localisation error, relations, time wrong and states on real CARMEN logs.

``python -m benchmarks real FOLDER [--logs NAME ...] [--begin S] [--end S] [--yaw FACTOR ...] [--stamps HOW ...]
[--set KEY=VALUE ...] [--keep FOLDER]``: the folder holds ``NAME.clf.bz2``, ``NAME-corrected.log.gz`` and
``NAME.relations``; all its logs are run unless some are named. The map of a log is made of every second
corrected scan, and the others are what the error is measured against.
"""

from __future__ import annotations

import argparse
import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks._figures import say
from benchmarks._real_logs import STAMPS, Excerpt, real_drive
from benchmarks._real_scores import RealScore, errors_of, run_real
from localization.geometry import FloatArray
from localization.pipeline.localizer import LocalizerConfig
from localization.types import Pose

TAKES_WORDS = True
"""Whether all words after the benchmark's name are its own arguments."""
_HEAD = (
    f"{'log':<34}{'scans':>6}{'mean m':>8}{'p95 m':>7}{'max m':>7}{'wrong':>8}{'times':>6}{'trusted':>8}"
    f"{'relations m':>15}{'in 95 %':>8}{'NEES(3)':>9}{'tracking':>9}{'CPU ms p50/p99/max':>20}"
)


def main(words: Sequence[str] = ()) -> None:
    """Run the named excerpts and print a table; nothing without a folder."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks real")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--logs", nargs="+")
    parser.add_argument("--begin", type=float, default=0.0, help="after the first scan [s]")
    parser.add_argument("--end", type=float, default=1e9, help="after the first scan [s]")
    parser.add_argument(
        "--yaw", type=float, nargs="+", default=[1.0], help="odometry's turns are multiplied by"
    )
    parser.add_argument("--stamps", nargs="+", choices=STAMPS, default=["logged"])
    parser.add_argument(
        "--set", nargs="+", default=[], metavar="KEY=VALUE", help="such as registration.sigma=0.03"
    )
    parser.add_argument(
        "--keep", type=Path, help="folder for the poses and errors at each scan, as .npz"
    )
    if not words:
        say("no folder of logs was given: skipped")
        return
    a = parser.parse_args(list(words))
    names = a.logs or sorted(p.name.removesuffix(".clf.bz2") for p in a.folder.glob("*.clf.bz2"))
    say(_HEAD)
    for name in names:
        for yaw in a.yaw:
            for stamps in a.stamps:
                _run(a, Excerpt(name, a.begin, a.end, yaw, stamps))


def _run(a: argparse.Namespace, excerpt: Excerpt) -> None:
    drive = real_drive(a.folder, excerpt)
    config = changed(LocalizerConfig.of(drive.log.sensors), a.set)
    score, found = run_real(drive, config)
    say(row(excerpt.case, score))
    if a.keep is not None:
        a.keep.mkdir(parents=True, exist_ok=True)
        np.savez(
            a.keep / f"{excerpt.case.replace(',', '').replace(' ', '_')}.npz",
            pose=np.array([_planar(f.map_from_scanner) for f in found]),
            covariance=np.array([f.covariance for f in found]),
            health=np.array([str(f.health) for f in found]),
            seconds=np.array([f.seconds for f in found]),
            error=errors_of(drive, found),
            track=drive.track,
        )


def _planar(pose: Pose | None) -> FloatArray:
    """Return x, y [m] and yaw [rad]; NaN without a pose."""
    if pose is None:
        return np.full(3, np.nan)
    return np.array([pose.position[0], pose.position[1], pose.yaw])


def row(case: str, s: RealScore) -> str:
    """Return two lines of the table: figures, and the share of each state."""
    states = " ".join(f"{k} {100 * v:.1f} %" for k, v in s.states.items() if v >= 0.0005)
    relation = f"{s.relation:.3f}±{s.relation_std:.3f}"
    cpu = "/".join(f"{v:.0f}" for v in s.cpu)
    return (
        f"{case:<34}{s.n:>6}{s.mean:>8.3f}{s.p95:>7.3f}{s.max:>7.2f}{s.wrong:>8.2%}{s.excursions:>6}"
        f"{s.trusted:>8.2%}{relation:>15}{s.covered:>8.0%}{s.nees:>9.1f}{s.tracking:>9.0%}{cpu:>20}\n{'':<8}{states}"
    )


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
