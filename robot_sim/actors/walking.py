"""Walks: where something that follows a path is at any time, in closed form.

A walk is a cycle of stages. On a *go* it follows a rounded polyline from one stop to the next; at a
*stop* it stands, and turns towards the next go before it leaves. Each stage lasts whole nanoseconds,
so the cycle never drifts however long a simulation runs.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from localization.types import IntArray
from robot_sim.actors.rounded_paths import RoundedPath, rounded_path, wrap_to_pi
from robot_sim.array_types import FloatArray
from robot_sim.errors import WorldError

ACCELERATION: Final = 1.0
"""From and to standing [m/s^2]; chosen so that walking speed is reached in about two steps."""
TURN_TIME: Final = 1.5
"""Turning on the spot takes this long, or the whole stop if that is shorter [s]; chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class WalkerState:
    """What a walk answers: one row per time asked for."""

    positions: FloatArray
    """(N, 2) in ``map`` [m]."""
    headings: FloatArray
    """(N,) [rad]."""
    strides: FloatArray
    """(N,) phase of the gait [rad]: a step is half a turn; whole steps between stops."""


@dataclass(frozen=True, slots=True, eq=False)
class _Go:
    """From stop to stop: from rest to rest, or round and round without one."""

    curve: RoundedPath
    speed: float
    steps: int
    endless: bool

    @property
    def peak(self) -> float:
        """Greatest speed [m/s]: a short go never reaches the walking speed."""
        return min(self.speed, math.sqrt(ACCELERATION * self.curve.length))

    @property
    def duration(self) -> float:
        if self.endless:
            return self.curve.length / self.speed
        return self.curve.length / self.peak + self.peak / ACCELERATION

    def at(self, times: FloatArray) -> WalkerState:
        length = self.curve.length
        if self.endless:
            distances = self.speed * times
        else:
            ramp = self.peak / ACCELERATION
            speeding = np.minimum(times, ramp)
            steady = np.maximum(times - ramp, 0.0)
            slowing = np.maximum(times - (self.duration - ramp), 0.0)
            distances = 0.5 * ACCELERATION * (speeding**2 - slowing**2) + self.peak * steady
        distances = np.clip(distances, 0.0, length)
        positions, headings = self.curve.at(distances)
        return WalkerState(positions, headings, math.pi * self.steps * distances / length)


@dataclass(frozen=True, slots=True, eq=False)
class _Stop:
    """Standing somewhere, then turning on the spot."""

    point: FloatArray
    heading: float
    turn: float
    duration: float

    def at(self, times: FloatArray) -> WalkerState:
        turning = min(TURN_TIME, self.duration)
        share = smooth((times - (self.duration - turning)) / turning)
        positions = np.broadcast_to(self.point, (len(times), 2))
        return WalkerState(positions, self.heading + self.turn * share, np.zeros(len(times)))


def smooth(share: FloatArray) -> FloatArray:
    """Return the minimum-jerk blend from 0 to 1 over ``share`` (N,) in [0, 1], held outside.

    The quintic with zero velocity and acceleration at both ends (Flash and Hogan, 1985).
    """
    u = np.clip(share, 0.0, 1.0)
    blend: FloatArray = u**3 * (10.0 + u * (6.0 * u - 15.0))
    return blend


class Walk:
    """A cycle of goes and stops, walked over and over."""

    def __init__(
        self,
        path: Sequence[Sequence[float]],
        *,
        speed: float,
        step_length: float,
        pause: float = 2.0,
        loop: bool = False,
    ) -> None:
        """Plan the cycle.

        Args:
            path: Two or more way-points ``[x, y]`` or ``[x, y, stop]`` [m, m, s].
            speed: Of walking, between the ramps [m/s].
            step_length: Wanted length of a step [m]; stretched so that steps between stops are whole.
            pause: Least stop at both ends of a path that is walked out and back [s].
            loop: Go on from the last way-point to the first, instead of back.

        Raises:
            WorldError: something in it cannot be walked; the message says what.
        """
        least = 3 if loop else 2
        if len(path) < least:
            raise WorldError(f"path must have {least} way-points or more, got {len(path)}")
        if any(len(p) not in (2, 3) for p in path):
            raise WorldError("path must have way-points [x, y] or [x, y, stop]")
        if not (speed > 0.0 and step_length > 0.0 and pause > 0.0):
            raise WorldError(f"speed and pause must be > 0, got {speed} and {pause}")
        corners = np.array([p[:2] for p in path], dtype=float)
        stops = np.array([p[2] if len(p) == 3 else 0.0 for p in path], dtype=float)
        if not (np.isfinite(corners).all() and np.isfinite(stops).all() and (stops >= 0.0).all()):
            raise WorldError("path must have finite way-points and stops >= 0")
        if not loop:
            stops[[0, -1]] = np.maximum(stops[[0, -1]], pause)
            # Out and back: the inner way-points come twice.
            corners = np.concatenate([corners, corners[-2:0:-1]])
            stops = np.concatenate([stops, stops[-2:0:-1]])
        self._stages = tuple(_stages(corners, stops, speed=speed, step_length=step_length))
        lengths = [max(1, round(1e9 * stage.duration)) for stage in self._stages]
        self._ends: IntArray = np.cumsum(np.array(lengths, dtype=np.int64))

    @property
    def cycle(self) -> int:
        """Time after which everything repeats [ns]."""
        return int(self._ends[-1])

    def at(self, times: IntArray) -> WalkerState:
        """Return where the walker is at ``times`` (N,) [ns]; at zero it leaves the first stop."""
        within = np.mod(times, self.cycle)
        stages = np.searchsorted(self._ends, within, "right")
        positions = np.empty((len(times), 2))
        headings, strides = np.empty(len(times)), np.empty(len(times))
        # Beams of one sweep fall into one stage or two, whatever the number of stages.
        for stage in np.unique(stages):
            rows = stages == stage
            begun = self._ends[stage - 1] if stage > 0 else 0
            motion = self._stages[stage].at(1e-9 * (within[rows] - begun))
            positions[rows], headings[rows] = motion.positions, motion.headings
            strides[rows] = motion.strides
        return WalkerState(positions, headings, strides)


def _stages(
    corners: FloatArray, stops: FloatArray, *, speed: float, step_length: float
) -> list[_Go | _Stop]:
    """Return the stages of the closed polyline through ``corners``, which stands at ``stops`` [s]."""
    where = np.flatnonzero(stops > 0.0)
    if len(where) == 0:
        curve = rounded_path(corners, closed=True)
        # A cycle of the gait is two steps; the last must hand over to the first.
        steps = 2 * max(1, round(0.5 * curve.length / step_length))
        return [_Go(curve, speed, steps, endless=True)]
    around = np.roll(corners, -where[0], axis=0)
    ring = np.concatenate([around, around[:1]])
    marks = [int(w - where[0]) for w in where] + [len(corners)]
    curves = [rounded_path(ring[a : b + 1]) for a, b in pairwise(marks)]
    stages: list[_Go | _Stop] = []
    for i, curve in enumerate(curves):
        steps = max(1, round(curve.length / step_length))
        end, heading = curve.at(np.array([curve.length]))
        following = curves[(i + 1) % len(curves)]
        turn = float(wrap_to_pi(following.headings[:1] - heading)[0])
        stop = float(stops[where[(i + 1) % len(where)]])
        stages.append(_Go(curve, speed, steps, endless=False))
        stages.append(_Stop(end[0], float(heading[0]), turn, stop))
    return stages
