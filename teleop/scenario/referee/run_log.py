"""Log of a run: what the referee keeps of each tick, and the figures that follow from it at the end."""

from __future__ import annotations

import hashlib
import math
from typing import Final

import numpy as np

from localization.evaluation.consistency import nees
from localization.geometry import FloatArray, euler_from_rotation, so3_log
from localization.types import Estimate, Health, Pose
from teleop.robot.tick_record import TickRecord
from teleop.scenario.referee.outcome import TimeLines

LOCALISED: Final = frozenset({Health.TRACKING, Health.DEGRADED, Health.SLIPPING})
"""States in which the robot claims to know where it is."""
WITHOUT_PLACE: Final = frozenset({Health.WAITING, Health.LOST, Health.RELOCALISING})
"""States in which it says that it does not; ``suspect`` is neither."""


class RunLog:
    """Owns the figures of each tick, and the digest of the trajectory."""

    def __init__(self) -> None:
        self._stamps: list[int] = []
        self._rows: list[tuple[float, ...]] = []
        self._vectors: list[FloatArray] = []
        self._covariances: list[FloatArray] = []
        self._health: list[str] = []
        self._control: list[str] = []
        self._digest = hashlib.sha256()

    def __len__(self) -> int:
        return len(self._stamps)

    def take(self, tick: TickRecord) -> None:
        """Keep one tick."""
        truth, estimate, control = tick.truth, tick.estimate, tick.control
        true, guess = truth.map_from_base, estimate.map_from_base
        vector = np.full(6, math.nan) if guess is None else _difference(guess, true)
        planar = (math.nan,) * 3 if guess is None else _planar(guess)
        twist, speed = control.twist, truth.twist
        self._stamps.append(tick.stamp)
        self._rows.append(
            (
                *_planar(true),
                *planar,
                float(twist.linear[0]),
                float(twist.angular[2]),
                float(speed.linear[0]),
                float(speed.angular[2]),
                tick.condition.tilt,
            )
        )
        self._vectors.append(vector)
        self._covariances.append(estimate.covariance)
        self._health.append(estimate.health.value)
        self._control.append(control.control.value)
        self._update_digest(tick.stamp, true, estimate, self._rows[-1])

    def _update_digest(
        self, stamp: int, true: Pose, estimate: Estimate, row: tuple[float, ...]
    ) -> None:
        digest, guess = self._digest, estimate.map_from_base
        digest.update(b"%d %s" % (stamp, estimate.health.value.encode()))
        digest.update(true.position.tobytes() + true.quaternion_wxyz.tobytes())
        if guess is not None:
            digest.update(guess.position.tobytes() + guess.quaternion_wxyz.tobytes())
        digest.update(np.ascontiguousarray(estimate.covariance).tobytes())
        digest.update(np.array(row).tobytes())

    @property
    def sha256(self) -> str:
        """Digest of true poses, estimates with covariances, and commands, bit by bit."""
        return self._digest.hexdigest()

    def lines(self) -> TimeLines:
        """Return the figures tick by tick."""
        rows = np.array(self._rows).reshape(-1, 11)
        vectors = np.array(self._vectors).reshape(-1, 6)
        covariances = np.array(self._covariances).reshape(-1, 6, 6)
        known = np.isfinite(vectors[:, 0])
        sigma, values = np.full(len(rows), math.nan), np.full(len(rows), math.nan)
        if known.any():
            sigma[known] = np.sqrt(np.linalg.eigvalsh(covariances[known][:, :2, :2])[:, 1])
            # A covariance that is not positive definite is the robot's mistake, and no reason to lose the run.
            known[known] = np.linalg.eigvalsh(covariances[known])[:, 0] > 0.0
            values[known] = nees(vectors[known], covariances[known])
        return TimeLines(
            stamps=np.array(self._stamps, dtype=np.int64),
            true=rows[:, 0:3],
            estimated=rows[:, 3:6],
            error=np.asarray(np.hypot(vectors[:, 0], vectors[:, 1])),
            sigma=sigma,
            nees=values,
            health=tuple(self._health),
            control=tuple(self._control),
            command=rows[:, 6:8],
            speed=rows[:, 8:10],
            tilt=rows[:, 10],
        )


def _difference(guess: Pose, true: Pose) -> FloatArray:
    """Return truth minus estimate: position in ``map`` [m], rotation in ``base_link`` [rad]."""
    turn = so3_log(guess.rotation.T @ true.rotation)
    return np.concatenate((true.position - guess.position, turn))


def _planar(pose: Pose) -> tuple[float, float, float]:
    x, y = pose.position[:2].tolist()
    return x, y, float(euler_from_rotation(pose.rotation)[2])
