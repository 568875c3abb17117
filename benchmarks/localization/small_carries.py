"""A robot that is carried by less than a room: as by somebody who shoves it aside, or sets it straight again."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from benchmarks.common.figures import OURS, Figure, share
from benchmarks.localization.alarms import FLAGGED as LOST
from benchmarks.localization.drives import PEERS, Method, ours
from benchmarks.localization.faults import AFTER, CARRIED_SCENES, carry
from benchmarks.replay.recordings import Recording, map_of, record, world_of
from benchmarks.replay.replaying import Run
from localization.types import SECOND, Health

REACH: Final = (0.3, 1.5)
"""It is carried by so much [m]."""
TRIALS, PEER_TRIALS = 16, 4
"""In each scene; a peer gets the first ones of ours."""
RIGHT, WRONG = 0.1, 0.25
"""Nearer than the first it is right, farther off than the second wrong [m]."""
HELD = 2 * SECOND
"""It is found once it has been sure and right for so long [ns]."""


@dataclass(frozen=True, slots=True)
class Shoved:
    """What became of a robot that was carried a little; times since then [s]."""

    said: float
    """Until it said that something was wrong; infinite if it never did."""
    found: float
    """Until it was sure and right, and stayed so."""
    trusted: float
    """That it was sure of a pose that was wrong."""


def carried_a_little() -> Iterator[Figure]:
    """Robots that are lifted in mid-drive and set down up to 1.5 m away."""
    fates: dict[str, list[Shoved]] = {}
    for seed, scene in enumerate(CARRIED_SCENES, start=91):
        rng, world = np.random.default_rng(seed), map_of(scene)
        drive = record(world_of(scene), name=scene, seed=seed, seconds=140.0)
        for i in range(TRIALS):
            recording, moved = carry(drive, rng, reach=REACH)
            methods: dict[str, Method] = {OURS: ours, **(PEERS if i < PEER_TRIALS else {})}
            for name, method in methods.items():
                fate = shoved(method(recording, world), recording, moved)
                fates.setdefault(name, []).append(fate)
    for name, some in fates.items():
        yield from _figures(name, some)


def shoved(run: Run, recording: Recording, moved: int) -> Shoved:
    """Return what became of a robot that was elsewhere from the stamp ``moved`` on [ns]."""
    said, trusted, since, last = np.inf, 0.0, None, moved
    for word in run.words:
        truth = recording.truth.get(word.stamp)
        if word.stamp <= moved or truth is None or word.estimate is None:
            continue
        sure = word.health not in (*LOST, Health.SUSPECT)
        off = float(np.hypot(*(truth.position - word.estimate.position)[:2]))
        if not sure:
            said = min(said, (word.stamp - moved) / SECOND)
        elif off > WRONG:
            trusted += (word.stamp - last) / SECOND
        if not (sure and off < RIGHT):
            since = None
        elif since is None:
            since = word.stamp
        last = word.stamp
    held = since is not None and last - since >= HELD
    return Shoved(said, (since - moved) / SECOND if since and held else np.inf, trusted)


def _figures(method: str, fates: list[Shoved]) -> Iterator[Figure]:
    case, n, mine = f"carried by {REACH[0]:g} to {REACH[1]:g} m", len(fates), method == OURS
    found = [f.found for f in fates if f.found < np.inf]
    least = 98.0 if mine else None
    seconds = AFTER // SECOND
    yield share(case, method, f"sure and right within {seconds} s", len(found), n, least=least)
    if found:
        p50, p95 = np.percentile(found, [50, 95])
        yield Figure(case, method, "sure and right after, p50", float(p50), "s", len(found))
        yield Figure(case, method, "sure and right after, p95", float(p95), "s", len(found))
    unsaid = sum(f.said > 2.0 and f.trusted > 2.0 for f in fates)
    yield share(case, method, "wrong and sure for the first 2 s", unsaid, n)
    trusted = [f.trusted for f in fates]
    yield Figure(case, method, "wrong and sure, in the mean", float(np.mean(trusted)), "s", n)
    yield Figure(case, method, "wrong and sure, longest", max(trusted), "s", n)
