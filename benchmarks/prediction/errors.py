"""``python -m benchmarks path``: how well the predicted path says where the robot will be, beside what else a display can do.

Each drive is 60 s of a scene's tour through the whole robot in lockstep: physics, scanners, localiser, guard. At each fifth
tick a display that is a round trip behind says where the robot will be when a command sent then takes effect; the error is
the distance to the true pose then. *dead* shows the newest estimate, *constant* carries it on with its own speeds. *late* is
the model where the link takes 50 ms longer than was measured.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from benchmarks.common.figures import OURS, Figure
from benchmarks.common.progress import with_progress
from benchmarks.common.sheet import measure
from benchmarks.prediction.drives import SCENES, Moment, drive
from robot_sim import DriveConfig
from teleop.prediction.command_history import CommandHistory, Followed
from teleop.prediction.predicted_motion import TICK, Command, DriveLimits, Motion, predicted
from teleop.robot.topics.control_messages import drive_limits

SEEDS: Final = range(2)
TRIPS: Final = {0.3: (0.05, 2.0), 1.0: (0.15, 5.0)}
"""Round trips [s], each with what the 95th percentile is to be at most [m, degrees]."""
_LOOK, _STATE = 5, 5
"""Ticks between two predictions, and between two of ``/teleop/state``."""
_BEGIN = 150
"""The tick of the first prediction: by then the robot knows its place."""

Errors = dict[str, list[tuple[float, float]]]
"""Distances [m] and angles [degrees] of each way to predict."""


def main(names: list[str] | None = None, *, out: Path | None = None) -> None:
    """Measure the parts, one for each way to drive."""
    parts = {name: PARTS[name] for name in names or PARTS}
    measure(parts, out, whole=names is None)


def _part(name: str, *, keys: bool) -> Iterator[Figure]:
    found: dict[float, Errors] = {trip: {} for trip in TRIPS}
    plan = [(scene, seed) for scene in SCENES for seed in SEEDS]
    for scene, seed in with_progress(plan, len(plan), "drives"):
        moments = drive(scene, seed, keys=keys)
        for trip, errors in found.items():
            for way, error in _errors(moments, round(trip / TICK)):
                errors.setdefault(way, []).append(error)
    for trip, errors in found.items():
        for way, pairs in errors.items():
            yield from _figures(f"{name}, {1000 * trip:g} ms", way, np.array(pairs), TRIPS[trip])


def _figures(
    case: str, way: str, errors: np.ndarray, goals: tuple[float, float]
) -> Iterator[Figure]:
    for column, (unit, scale) in enumerate((("cm", 100.0), ("degrees", 1.0))):
        for percent in (50, 95):
            value = scale * float(np.percentile(errors[:, column], percent))
            most = scale * goals[column] if way == OURS and percent == 95 else None
            what = f"{'position' if column == 0 else 'heading'} p{percent}"
            yield Figure(case, way, what, value, unit, len(errors), most=most)


def _errors(moments: list[Moment], trip: int) -> Iterator[tuple[str, tuple[float, float]]]:
    """Yield the errors of each way to predict over a round trip of so many ticks."""
    limits = DriveLimits(**drive_limits(DriveConfig()))
    for i in range(_BEGIN, len(moments) - trip, _LOOK):
        known, at = moments[i].known, moments[i].known_at
        assert known is not None
        now = moments[i].sent.at + TICK
        until, truth = now + trip * TICK, moments[i + trip].truth
        for way, late in ((OURS, 0), ("late", round(0.05 / TICK))):
            history = _history(moments, i, trip, late)
            *_, last = predicted(known, at, history.commands(), until, limits)
            yield way, _apart(last, truth)
        yield "dead", _apart(known, truth)
        yield "constant", _apart(_carried_on(known, until - at), truth)


def _history(moments: list[Moment], now: int, trip: int, late: int) -> CommandHistory:
    """Return what a display knows: the robot's own word ten times a second, and what is on its way."""
    history = CommandHistory()
    for moment in moments[max(0, now - 100) : now + trip + 1]:
        known = moment.sent.at <= moments[now].sent.at
        if known and round(moment.sent.at / TICK) % _STATE == 0:
            c, share = moment.sent, moment.share
            in_force = Command(c.at, share * c.forward, share * c.turn)
            history.followed(Followed(in_force, guard=share))
        history.sent(Command(moment.sent.at - late * TICK, moment.sent.forward, moment.sent.turn))
    return history


def _carried_on(known: Motion, lasts: float) -> Motion:
    heading, way = known.yaw + 0.5 * known.turn * lasts, known.forward * lasts
    x, y = known.x + way * math.cos(heading), known.y + way * math.sin(heading)
    return Motion(x, y, known.yaw + known.turn * lasts)


def _apart(found: Motion, truth: Motion) -> tuple[float, float]:
    turned = math.remainder(found.yaw - truth.yaw, math.tau)
    return math.hypot(found.x - truth.x, found.y - truth.y), abs(math.degrees(turned))


PARTS: dict[str, Callable[[], Iterator[Figure]]] = {
    "stick": partial(_part, "stick", keys=False),
    "keys": partial(_part, "keys", keys=True),
}
"""A stick that is moved at each tick, and keys: all or nothing, ten times a second."""
