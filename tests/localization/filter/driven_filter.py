"""A filter that is driven call by call: it keeps the newest state, for tests of longer sequences."""

from __future__ import annotations

from typing import Any

import numpy as np

from localization.filter import ekf, prediction, updates
from localization.filter.ekf import EkfConfig, FilterState
from localization.geometry import FloatArray
from localization.types import Match, Pose


class DrivenFilter:
    """Keeps the newest state of a filter; its methods are the filter's functions."""

    def __init__(self, config: EkfConfig = EkfConfig(), state: FilterState | None = None) -> None:  # noqa: B008  (frozen)
        self.config = config
        self.state = state or ekf.initial_state(config)

    def __getattr__(self, name: str) -> Any:
        """What the newest state holds: ``pose``, ``covariance`` and all its other fields."""
        return getattr(self.state, name)

    @property
    def standing(self) -> bool:
        return self.state.standing(self.config)

    def predict(self, *readings: Any, slipping: bool, speed: float | None = None) -> Pose:
        self.state, motion = prediction.predict(
            self.state, self.config, *readings, slipping=slipping, speed=speed
        )
        return motion

    def update_wheel_yaw(self, *readings: Any, seconds: float = 0.02) -> bool:
        self.state, agree = updates.update_wheel_yaw(
            self.state, self.config, *readings, seconds=seconds
        )
        return agree

    def update_standstill(self, *readings: Any, seconds: float = 0.02) -> None:
        self.state = updates.update_standstill(self.state, self.config, *readings, seconds=seconds)

    def update_tilt(self, elapsed: float) -> None:
        self.state = updates.update_tilt(self.state, self.config, elapsed)

    def update_match(self, match: Match) -> None:
        self.state = updates.update_match(self.state, self.config, match)

    def match_nis(self, match: Match) -> float:
        return updates.match_nis(self.state, match)

    def match_innovation(self, match: Match) -> tuple[FloatArray, FloatArray, FloatArray]:
        return updates.match_innovation(self.state, match)

    def update_relative(
        self, then: Pose, motion: Pose, covariance: FloatArray, used: FloatArray
    ) -> None:
        self.state = updates.update_relative(self.state, then, motion, covariance, used)

    def widen(self, forward: float, side: float, vertical: float, yaw: float) -> None:
        self.state = updates.widen(self.state, forward, side, vertical, yaw)

    def mark(self) -> None:
        self.state = ekf.mark(self.state)

    def reset_pose(self, pose: Pose, covariance: FloatArray) -> None:
        self.state = ekf.with_pose(self.state, pose, np.asarray(covariance))
