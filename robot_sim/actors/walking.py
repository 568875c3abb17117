"""Walks along a path in closed form: position, heading and gait phase at any time.

A walk is a cycle of stages. A *go* follows a rounded path from one stop to the next; at a *stop* the
walker stands, and turns towards the next go before it leaves. Each stage lasts an integer number of
nanoseconds, so that the cycle does not drift however long a simulation runs.
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
"""Acceleration from and to standing [m/s^2]; chosen so that two steps reach walking speed."""
TURN_TIME: Final = 1.5
"""Duration of a turn on the spot, or that of the stop if it is shorter [s]; chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class WalkerState:
    """State of a walker at N times."""

    positions: FloatArray
    """Positions in ``map`` [m], (N, 2)."""
    headings: FloatArray
    """Headings [rad], (N,)."""
    strides: FloatArray
    """Phase of the gait [rad], (N,): one step is half a turn; an integer number of steps between
    stops."""


@dataclass(frozen=True, slots=True, eq=False)
class _Go:
    """A stretch from one stop to the next with ramps of speed, or an endless loop without stops."""

    curve: RoundedPath
    speed: float
    steps: int
    endless: bool

    @property
    def peak(self) -> float:
        """Greatest speed [m/s]; a short go does not reach the walking speed."""
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
    """A stop at a point, with a turn on the spot at its end."""

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
    """A cycle of goes and stops that repeats forever."""

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
            speed: Walking speed between the ramps [m/s].
            step_length: Desired step length [m]; adjusted to an integer number of steps between stops.
            pause: Shortest stop at both ends of a path that is walked out and back [s].
            loop: Continue from the last way-point to the first, instead of walking back.

        Raises:
            WorldError: the path cannot be walked; the message gives the reason.
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
        """Duration of the cycle [ns]."""
        return int(self._ends[-1])

    @property
    def first_arrival(self) -> int:
        """Time from setting out until the next stop [ns]."""
        return int(self._ends[0])

    def at(self, times: IntArray) -> WalkerState:
        """Return the walker's state at ``times`` (N,) [ns]; at time zero it leaves the first stop."""
        within = np.mod(times, self.cycle)
        stages = np.searchsorted(self._ends, within, "right")
        positions = np.empty((len(times), 2))
        headings, strides = np.empty(len(times)), np.empty(len(times))
        # The beams of one sweep fall into one or two stages, so that few are evaluated.
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
    """Return the stages of the closed polyline through ``corners`` with its ``stops`` [s]."""
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
