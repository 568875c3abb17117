"""Ways of hands for the benchmarks of the arm: through poses that it reaches, and out of its reach."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from localization.geometry import FloatArray, quaternion_from_rotation, so3_exp
from localization.types import SECOND, Pose
from robot_sim.arm.arm_table import load_arm
from robot_sim.arm.kinematics import Kinematics
from teleop.robot.arm.arm_commands import Hand

TABLE = load_arm()
KINEMATICS = Kinematics(TABLE)
LOWER, UPPER = np.array(TABLE.lower), np.array(TABLE.upper)
TICK = 0.02
TICK_NS = SECOND // 50
_FASTEST = 2.0
"""Rate of a joint at most, on the ways that the arm reaches [rad/s]."""
_CHANGING = (0.05, 0.35)
"""Frequencies of the joints' motion [Hz]."""
_BENT, _TILTED = math.radians(18.0), math.radians(10.0)
"""Least bend of the elbow and pitch of the wrist of the ways that stay in one branch of the inverse."""


def reachable(seed: int, ticks: int = 400, *, straight_wrist: bool = False) -> FloatArray:
    """Return joint angles (N, 5) of a smooth way within the limits, whose tips a hand shall follow.

    Args:
        seed: Source of chance.
        ticks: Its length.
        straight_wrist: Whether the wrist may become straight on the way, where the branches of the inverse meet.
    """
    chance = np.random.default_rng([seed, int(straight_wrist)])
    lower, upper = LOWER.copy(), UPPER.copy()
    upper[2] = -_BENT
    if not straight_wrist:
        if chance.random() < 0.5:
            lower[4] = _TILTED
        else:
            upper[4] = -_TILTED
    times = TICK * np.arange(ticks)
    middle, half = 0.5 * (lower + upper), 0.49 * (upper - lower)
    while True:
        phases, shares = chance.uniform(0.0, 2.0 * np.pi, (5, 3)), chance.dirichlet(np.ones(3), 5)
        frequencies = chance.uniform(*_CHANGING, (5, 3))
        waves = np.sin(2.0 * np.pi * frequencies[..., None] * times + phases[..., None])
        angles: FloatArray = middle + (half[:, None] * np.einsum("jk,jkt->jt", shares, waves)).T
        if np.abs(np.diff(angles, axis=0)).max() <= _FASTEST * TICK:
            return angles


def tips(angles: FloatArray, roll: float = 0.0) -> FloatArray:
    """Return ``arm_base_from_tool0`` (N, 4, 4) of joint angles (N, 5).

    Args:
        angles: [rad].
        roll: By so much a hand rolls to and fro about its own axis, which no arm of five joints can follow [rad].
    """
    found: FloatArray = np.array([KINEMATICS.tip(row) for row in angles])
    swing = roll * np.sin(2.0 * np.pi * 0.1 * TICK * np.arange(len(found)))
    turns = np.array([so3_exp((angle, 0.0, 0.0)) for angle in swing])
    found[:, :3, :3] = found[:, :3, :3] @ turns
    return found


def samples(poses: FloatArray, noise: float = 0.0, seed: int = 0) -> Iterator[Hand]:
    """Yield a sample of a hand in each tick, which moves as tips (N, 4, 4) do.

    Args:
        poses: The tips.
        noise: Standard deviation of each coordinate [m]; of turns a third of a degree for each millimetre.
        seed: Source of the noise.
    """
    chance = np.random.default_rng([seed, 1])
    for tick, pose in enumerate(poses):
        place, turn = (
            noise * chance.normal(size=3),
            math.radians(noise / 0.003) * chance.normal(size=3),
        )
        rotation = quaternion_from_rotation(so3_exp(turn) @ pose[:3, :3])
        yield Hand(Pose(pose[:3, 3] + place, rotation), True, stamp=(tick + 1) * TICK_NS)


def minimum_jerk(share: float) -> float:
    """Return how much of a reach is done after a share of its time (Flash and Hogan, 1985)."""
    return share**3 * (10.0 - 15.0 * share + 6.0 * share**2)


def angle(first: FloatArray, second: FloatArray) -> float:
    """Return the angle between two unit vectors [deg]."""
    return math.degrees(math.atan2(float(np.linalg.norm(np.cross(first, second))), first @ second))
