"""Hours among people: false alarms an hour, and what becomes of that when it takes more or less to be sure.

Parts: ``hours-1`` to ``hours-12``, each fifty minutes in the living office and warehouse, other people and another
robot in each ten of them; ``carried``, a hundred robots that are carried off there; and, for each of some other
probabilities at which a pose is believed, ``sure-P``, the same hundred and one hour. ``--out`` keeps them; ``python -m benchmarks.pictures.people``
draws one against the other.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.common.figures import OURS, Figure, share
from benchmarks.common.sheet import measure
from benchmarks.localization.alarms import LongDrive, counts
from benchmarks.localization.faults import carry, fate_of
from benchmarks.replay.recordings import map_of, record, world_of
from benchmarks.replay.replaying import Laps, replay
from localization.config import LocalizerConfig
from localization.pipeline.localizer import Localizer
from localization.types import SECOND

SCENES = ("office", "warehouse")
CHUNKS, DRIVES = 12, 5
"""Parts, and drives of ten minutes in each."""
SURE = (0.9, 0.999)
"""Other values of ``belief.sure`` than that which ships."""
CARRIED = 25
"""Robots carried off in each of four drives."""
NOTICED = 4 * SECOND
"""For how long a robot is watched that was carried off [ns]."""


def _drives(chunk: int) -> Sequence[LongDrive]:
    """Return the drives of a part: no seed is in two of them."""
    seeds = range(1000 + chunk * DRIVES, 1000 + (chunk + 1) * DRIVES)
    return tuple(LongDrive(SCENES[seed % 2], seed, alive=True) for seed in seeds)


def _config(sure: float | None) -> LocalizerConfig:
    config = LocalizerConfig()
    if sure is None:
        return config
    return replace(config, belief=replace(config.belief, sure=sure))


def carried(sure: float | None = None) -> Iterator[Figure]:
    """Carry robots off among people and yield what share was noticed in time."""
    flagged: list[float] = []
    doubted: list[float] = []
    for seed in range(1201, 1205):
        scene = SCENES[seed % 2]
        world, rng = map_of(scene), np.random.default_rng(seed)
        lively = world_of(scene, alive=True, timing=seed)
        drive = record(lively, name=scene, seed=seed, seconds=140.0)
        for _ in range(CARRIED):
            recording, moved = carry(drive, rng, after=NOTICED)
            laps = Laps()
            localizer = Localizer(world, drive.mounts, _config(sure), stage=laps.stage)
            fate = fate_of(replay(recording, localizer, laps), recording, moved)
            flagged.append(fate.flagged)
            doubted.append(fate.doubted)
    case, n = "carried off among people", len(flagged)
    yield share(case, OURS, "said to be lost within 2 s", sum(f <= 2.0 for f in flagged), n)
    noticed = sum(f <= 2.0 for f in doubted)
    yield share(case, OURS, "said to be suspect or lost within 2 s", noticed, n, least=99.0)


def _sure(sure: float) -> Iterator[Figure]:
    yield from carried(sure)
    yield from counts((*_drives(0), _drives(1)[0]), _config(sure))


PARTS: dict[str, Callable[[], Iterator[Figure]]] = {
    "carried": carried,
    **{f"hours-{i + 1}": partial(lambda i: counts(_drives(i)), i) for i in range(CHUNKS)},
    **{f"sure-{sure}": partial(_sure, sure) for sure in SURE},
}


def main(parts: Sequence[str] = (), *, out: Path | None = None) -> None:
    """Measure some parts, or all, and print their figures.

    Args:
        parts: by name.
        out: a sheet of figures; parts that are named take their places in it, the others stay.
    """
    measure({name: PARTS[name] for name in parts or PARTS}, out, whole=not parts)
