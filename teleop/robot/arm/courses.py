"""Courses of the arm: planned ways, which stop at their corners, and timed motions of clients, which are checked first."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from localization.geometry import FloatArray
from robot_sim.arm.arm_table import JOINTS, ArmTable
from teleop.robot.arm.pieces import Piece, Straight
from teleop.robot.arm.timed_curve import TimedCurve

MOST_POINTS: Final = 1000
"""Points of a motion, at most."""
_LONGEST: Final = 600.0
"""Duration of a motion, at most [s]."""
_START: Final = math.radians(3.0)
"""Distance of a joint from the start of a motion, at most: twice what a servo's dead band and play leave open."""
_BEYOND: Final = 1e-6
"""By so much angles may pass a limit [rad]: messages of 32-bit numbers do."""
_NOTICED: Final = 1.01
"""Stretch of a motion that is worth a word."""


class CourseError(ValueError):
    """A motion that the arm does not make; the message names joint and value."""


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """What the joints shall do, from standing to standing."""

    pieces: tuple[Piece, ...]
    """One after the other; at the end of each the joints stand."""
    begin: FloatArray
    """(5,) where it begins [rad]."""
    end: FloatArray
    """(5,) where it ends [rad]."""
    note: str = ""
    """In what it differs from what was asked for, for people."""


def planned(way: FloatArray, table: ArmTable) -> Course:
    """Return the course along a way that a plan has found, straight from corner to corner.

    Args:
        way: (N, 5) corners [rad].
        table: The arm.
    """
    corners = [way[0], *(b for a, b in pairwise(way) if not np.array_equal(a, b))]
    pieces = tuple(Straight(a, b, table.motion) for a, b in pairwise(corners))
    return Course(pieces, way[0], way[-1])


def timed(
    times: Sequence[float], points: FloatArray, standing: FloatArray, table: ArmTable
) -> Course:
    """Return the course of a timed motion, smoothed, and slower where it asks for more than the bounds.

    Args:
        times: (N,) of the points, rising from 0 or more [s]. A first one later than 0 is reached from where the arm stands.
        points: (N, 5) [rad].
        standing: Where the arm stands (5,) [rad].
        table: The arm.

    Raises:
        CourseError: It is empty, too long, begins elsewhere, leaves the limits, or its times do not rise.
    """
    instants, points = np.asarray(times, dtype=float), np.array(points, dtype=float)
    _check(instants, points, table)
    if instants[0] > 0.0:
        instants = np.concatenate(([0.0], instants))
        points = np.vstack((standing, points))
    else:
        _check_start(points[0], standing, table)
        points[0] = standing
    if len(instants) == 1:
        return Course((), standing, standing)
    curve = TimedCurve(instants, points, table.motion)
    note = ""
    if curve.stretch > _NOTICED:
        note = f"stretched to {curve.stretch:.2f} times its duration to stay within the bounds of the joints' motion"
    return Course((curve,), standing, points[-1], note)


def _check(times: FloatArray, points: FloatArray, table: ArmTable) -> None:
    if not 1 <= len(times) <= MOST_POINTS or points.shape != (len(times), JOINTS):
        raise CourseError(
            f"points must be 1 to {MOST_POINTS} of {JOINTS} angles, each with its time; got {len(times)}"
            f" times and points of shape {points.shape}"
        )
    if not (np.isfinite(times).all() and np.isfinite(points).all()):
        raise CourseError("points must be finite numbers")
    if times[0] < 0.0 or (np.diff(times) <= 0.0).any():
        late = int(np.argmax(np.diff(times, prepend=-1e-9) <= 0.0))
        raise CourseError(f"points[{late}]: times must rise from 0 on, got {times[late]:g} s")
    if times[-1] > _LONGEST:
        raise CourseError(f"it must take at most {_LONGEST:g} s, got {times[-1]:g} s")
    beyond = np.maximum(points - table.upper, np.array(table.lower) - points)
    if beyond.max() > _BEYOND:
        number, joint = (int(i) for i in np.unravel_index(beyond.argmax(), beyond.shape))
        limits = table.joints[joint]
        raise CourseError(
            f"points[{number}]: {limits.name} must be {math.degrees(limits.lower):.1f} to"
            f" {math.degrees(limits.upper):.1f} degrees, got {math.degrees(points[number, joint]):.1f}"
        )


def _check_start(first: FloatArray, standing: FloatArray, table: ArmTable) -> None:
    apart = np.abs(first - standing)
    if apart.max() > _START:
        joint = int(apart.argmax())
        raise CourseError(
            f"points[0]: {table.joints[joint].name} must begin within {math.degrees(_START):.0f} degrees"
            f" of where it stands, {math.degrees(standing[joint]):.1f}, got"
            f" {math.degrees(first[joint]):.1f}; or give it a time later than 0"
        )
