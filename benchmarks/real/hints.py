"""Starts on real logs: how well a localiser finds its place from a rough hint, or from none."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from benchmarks.real.logs import RealDrive
from benchmarks.real.scores import answered
from benchmarks.real.trials import Scans, place_at, right, spread
from localization.pipeline.localizer import Localizer, LocalizerConfig
from localization.types import Pose

STRETCH = 60.0
"""Length of the log after the start [s]."""
WAY = 3.0
"""The robot drives at least so far in it [m]: standing still does not distinguish places."""


@dataclass(frozen=True, slots=True)
class HintKind:
    """How wrong a hint is."""

    name: str
    """In tables."""
    far: float = 0.0
    """Distance from the true pose [m], in a direction drawn by chance."""
    turned: float = 0.0
    """Difference of heading [rad], to a side drawn by chance."""
    given: bool = True
    """Whether there is a hint; otherwise the whole map is searched."""


KINDS = (
    HintKind("0.5 m, 15°", 0.5, float(np.deg2rad(15.0))),
    HintKind("2 m, 45°", 2.0, float(np.deg2rad(45.0))),
    HintKind("no hint", given=False),
)


@dataclass(frozen=True, slots=True)
class Start:
    """What became of one start."""

    placed: bool
    """Whether the localiser ever had a pose."""
    right_when_placed: bool
    """Whether the first pose was right."""
    right_at_end: bool
    """Whether the last pose was."""
    way: float
    """Way until it was placed [m]; infinite if it was not."""


def beginnings(
    drive: RealDrive, *, count: int, seed: int, seconds: float = STRETCH, way: float = WAY
) -> Iterator[int]:
    """Yield scans to start at, spread over the excerpt; fewer than ``count`` where it is too short."""
    yield from spread(Scans.of(drive).beginnings(seconds, way), count, np.random.default_rng(seed))


def start_at(
    drive: RealDrive,
    config: LocalizerConfig,
    scan: int,
    kind: HintKind,
    *,
    seed: int,
    seconds: float = STRETCH,
) -> Start:
    """Start a localiser at a scan with a hint of a kind, whose error is drawn by the seed."""
    scans, localizer = Scans.of(drive), Localizer(drive.world, drive.log.mounts, config)
    hint: Pose | None = None
    if kind.given:
        rng = np.random.default_rng([seed, scan])
        bearing, side = rng.uniform(-np.pi, np.pi), rng.choice([-1.0, 1.0])
        off = kind.far * np.array([np.cos(bearing), np.sin(bearing)])
        true = place_at(drive, scan)
        x, y = (true.position[:2] + off).tolist()
        hint = Pose.planar(x, y, true.yaw + float(side) * kind.turned)
    else:
        localizer.relocalize()
    readings = scans.between(scan, scans.until(scan, seconds))
    found = list(answered(readings, localizer, start=hint, mount=drive.mount))
    first = next((i for i, a in enumerate(found) if a.map_from_scanner is not None), None)
    if first is None:
        return Start(False, False, False, np.inf)
    last = len(found) - 1
    return Start(
        True,
        right(drive, found[first], scan + first),
        right(drive, found[last], scan + last),
        float(scans.driven[scan + first] - scans.driven[scan]),
    )
