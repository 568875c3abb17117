"""Detection of motor stalls as in the Pioneer's controller.

Source: the manual (ActivMedia AROS, StallVal and StallCount). Each wheel's power is averaged over
500 ms, where power counts only while the wheel is slower than 100 mm/s; beyond StallVal the motors are
powered but barely move, and the power is cut for a while.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from localization.types import SECOND
from robot_sim.array_types import FloatArray
from robot_sim.robot.skid_steer_parameters import SkidSteer


@dataclass(frozen=True, slots=True)
class StallConfig:
    """Conditions under which a side counts as stalled.

    Raises:
        ValueError: a number is not positive.
    """

    window: int = SECOND // 2
    """Time over which the load is averaged [ns]; the manual."""
    slow: float = 0.1
    """Rim speed above which the load does not count [m/s]; the manual."""
    share: float = 0.4
    """Average load that counts as a stall, as a share of the torque limit: StallVal 200 of a
    greatest PWM of 500, as remembered. Standing on a ramp of 35 % takes 0.22; turning in place on
    tile, however slowly, 0.25."""

    def __post_init__(self) -> None:
        for name in ("window", "slow", "share"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"stall {name} must be > 0, got {getattr(self, name)}")


class StallDetector:
    """Averages the load of both sides, each of which has its wheels coupled."""

    def __init__(self, robot: SkidSteer, config: StallConfig, tick: int) -> None:
        """Begin without load; ``tick`` is the time between updates [ns]."""
        self._slow = config.slow / robot.rolling_radius
        self._limit, self._share = robot.wheel_torque, config.share
        self._enough = 0.99 * config.share * robot.wheel_torque
        self._light = 0
        self._loads: deque[tuple[float, float]] = deque(maxlen=max(1, config.window // tick))

    def update(self, torques: FloatArray, rates: FloatArray) -> tuple[bool, bool]:
        """Add the latest torques [N m] and rates [rad/s] of the wheels, (4,) in the order of ``WHEELS``.

        Returns:
            Whether the left and the right side are stalled.
        """
        front_left, front_right, rear_left, rear_right = (
            abs(torque) if abs(rate) < self._slow else 0.0
            for torque, rate in zip(torques.tolist(), rates.tolist(), strict=True)
        )
        loads = (0.5 * (front_left + rear_left), 0.5 * (front_right + rear_right))
        self._loads.append(loads)
        # A mean is no greater than its greatest value: mostly no sum is needed.
        self._light = 0 if max(loads) >= self._enough else self._light + 1
        if self._light >= len(self._loads):
            return False, False
        most = self._limit * (self._loads.maxlen or 1)
        left, right = (sum(side) / most for side in zip(*self._loads, strict=True))
        return left >= self._share, right >= self._share

    def clear(self) -> None:
        """Forget the loads, as when the power was cut."""
        self._loads.clear()
