"""Motions of a hand that does not look where the tip is: circles, reaches to anywhere, a lost track."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from localization.geometry import FloatArray
from teleop.scenario.files.arm_tasks import Lose, Roam, Sweep

HandPlace: TypeAlias = tuple[FloatArray, FloatArray, bool]
"""Way from where it began (3,) [m], turn since then as a vector (3,) [rad], and whether it is tracked."""
Motion: TypeAlias = Callable[[float], HandPlace]
"""Returns where a hand is at a time from its beginning [s]."""

_STILL = np.zeros(3)
_STEADY = 1.0
"""Time for which a hand keeps still before its track is lost, and after it is found [s]."""


def sweeping(task: Sweep) -> Motion:
    """Return a motion in circles that begins and ends slowly."""

    def at(time: float) -> HandPlace:
        angle = 2.0 * math.pi * time / task.period
        # The radius grows within the first second, so that the hand starts from rest.
        share = min(1.0, time) ** 2 * (3.0 - 2.0 * min(1.0, time))
        circle = share * np.array([0.0, math.sin(angle), math.cos(angle)])
        turn = math.radians(task.cone) * circle + share * np.radians(task.turn)
        return task.radius * circle, turn, True

    return at


def roaming(task: Roam, chance: np.random.Generator) -> Motion:
    """Return reaches of minimum jerk to places that are drawn, with turns of up to 50 degrees."""
    legs: list[tuple[float, float, FloatArray, FloatArray]] = []
    begin, here = 0.0, np.zeros(6)
    while begin < task.lasting:
        there = chance.uniform(-1.0, 1.0, 6) * np.repeat((task.far, 0.9), 3)
        time = max(0.3, float(np.linalg.norm(there[:3] - here[:3])) / task.speed)
        legs.append((begin, time, here, there))
        begin, here = begin + time, there

    def at(time: float) -> HandPlace:
        begin, lasting, here, there = next(
            (leg for leg in reversed(legs) if leg[0] <= time), legs[0]
        )
        share = min(1.0, (time - begin) / lasting)
        done = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
        place = here + done * (there - here)
        return place[:3], place[3:], True

    return at


def losing(task: Lose) -> tuple[Motion, float]:
    """Return a motion whose track is lost and found elsewhere, and how long it takes [s]."""
    guessed = task.lasting if task.said else 0.0
    way = np.array(task.by)
    aside = way / max(float(np.linalg.norm(way)), 1e-9)

    def at(time: float) -> HandPlace:
        if time < _STEADY:
            return _STILL, _STILL, True
        if time < _STEADY + guessed:
            return (time - _STEADY) / guessed * task.drift * aside, _STILL, False
        return way, _STILL, True

    return at, 2 * _STEADY + guessed
