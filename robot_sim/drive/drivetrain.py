"""Drivetrain: from a commanded twist to wheel rates, within speed limits and acceleration ramps."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from localization.types import Twist
from robot_sim.array_types import FloatArray
from robot_sim.drive.motor_controller import FirmwareConfig, Override, quantised_command
from robot_sim.drive.motor_stall import StallConfig
from robot_sim.robot.skid_steer_parameters import SkidSteer

_LIMITS = (
    "max_speed",
    "max_turn",
    "acceleration",
    "braking",
    "turn_acceleration",
    "turn_braking",
)


@dataclass(frozen=True, slots=True)
class SlipFault:
    """Injected fault: wheels spinning on ice.

    While it is active, the encoders of both sides report ``factor`` times the real rim speed. The
    motion itself is not changed.
    """

    start_ns: int
    """Time at which the fault begins [ns]."""
    duration_ns: int
    """Duration of the fault [ns]."""
    factor: float
    """Reported over real rim speed."""

    def __post_init__(self) -> None:
        if self.duration_ns < 0 or not math.isfinite(self.factor):
            raise ValueError(
                f"wheel slip must last >= 0 ns with a finite factor, got {self.duration_ns} ns"
                f" and {self.factor}"
            )

    def active(self, stamp: int) -> bool:
        """Return whether the fault is active at ``stamp`` [ns]."""
        return self.start_ns <= stamp < self.start_ns + self.duration_ns


@dataclass(frozen=True, slots=True)
class DriveConfig:
    """Limits of the motion and errors of the encoders."""

    max_speed: float = 0.7
    """Limit of the forward speed [m/s]; Webots ``Pioneer3at.proto``."""
    max_turn: float = math.radians(140.0)
    """Limit of the yaw rate [rad/s]; data sheet, as quoted by others."""
    acceleration: float = 0.5
    """Limit of the forward acceleration [m/s^2]."""
    braking: float = 1.0
    """Limit of the deceleration towards rest [m/s^2]."""
    turn_acceleration: float = math.radians(150.0)
    """Limit of the angular acceleration [rad/s^2]."""
    turn_braking: float = math.radians(300.0)
    """Limit of the angular deceleration towards rest [rad/s^2]."""
    encoder_scale_sigma: float = 0.003
    """Standard deviation of each side's constant scale error, as a share; drawn once per seed."""
    encoder_noise: float = 0.002
    """Standard deviation of the noise of one reading [m/s]."""
    slips: tuple[SlipFault, ...] = ()
    """Injected slip faults."""
    stall: StallConfig = field(default_factory=StallConfig)
    """Conditions under which the motors count as stalled."""
    firmware: FirmwareConfig | None = None
    """Motor controller like the P3-AT's own, through which commands and wheel speeds go; None for
    none."""

    def __post_init__(self) -> None:
        for name in _LIMITS:
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} must be > 0, got {getattr(self, name)}")


def ramp(now: float, target: float, *, gain: float, loss: float) -> float:
    """Move ``now`` towards ``target`` by at most ``gain``, or by ``loss`` while slowing down."""
    if now * target < 0.0 or abs(target) < abs(now):
        # Slowing down; a change of sign passes through rest first.
        floor = target if now * target > 0.0 else 0.0
        return max(floor, now - loss) if now > 0.0 else min(floor, now + loss)
    return min(target, now + gain) if target > now else max(target, now - gain)


class Drivetrain:
    """Follows a commanded twist within its limits."""

    def __init__(self, config: DriveConfig, robot: SkidSteer) -> None:
        self._config = config
        self._robot = robot
        firmware = config.firmware
        self._track = robot.effective_track if firmware is None else firmware.effective_track
        self._target = (0.0, 0.0)
        self._speed = 0.0
        self._turn = 0.0
        self.override = Override.NONE
        """Override by the motor controller; any but ``NONE`` stops the wheels at once."""

    @property
    def target(self) -> tuple[float, float]:
        """Forward speed [m/s] and yaw rate [rad/s] that the drivetrain aims for."""
        return self._target

    def command(self, twist: Twist) -> None:
        """Set the target twist; only forward speed and yaw rate are used.

        Beyond a limit both are scaled by the same factor, so that the curvature is kept.
        """
        forward, turn = float(twist.linear[0]), float(twist.angular[2])
        if not (math.isfinite(forward) and math.isfinite(turn)):
            raise ValueError(
                f"command must be finite, got forward {forward} m/s and turn {turn} rad/s"
            )
        if self._config.firmware is not None:
            forward, turn = quantised_command(forward, turn, self._config.firmware)
        rim = abs(forward) + abs(turn) * 0.5 * self._track
        excess = max(
            1.0,
            abs(forward) / self._config.max_speed,
            abs(turn) / self._config.max_turn,
            rim / (self._robot.wheel_rate * self._robot.rolling_radius),
        )
        self._target = (forward / excess, turn / excess)

    def advance(self, dt: float) -> tuple[float, float]:
        """Advance the ramps by ``dt`` [s]; return the left and right wheel rates [rad/s]."""
        c = self._config
        forward, turn = self._target
        self._speed = ramp(self._speed, forward, gain=c.acceleration * dt, loss=c.braking * dt)
        self._turn = ramp(self._turn, turn, gain=c.turn_acceleration * dt, loss=c.turn_braking * dt)
        across = self._turn * 0.5 * self._track
        radius = self._robot.rolling_radius
        return (self._speed - across) / radius, (self._speed + across) / radius

    def advance_tick(self, steps: int, dt: float) -> FloatArray:
        """Advance the ramps by a tick, with the same results as ``steps`` calls of ``advance``.

        Args:
            steps: Physics steps of the tick.
            dt: Length of one step [s].

        Returns:
            (steps, 2) left and right wheel rate at each step [rad/s].
        """
        if self.override is not Override.NONE:
            self._speed = self._turn = 0.0
            return np.zeros((steps, 2))
        rates = np.empty((steps, 2))
        for i in range(steps):
            rates[i] = self.advance(dt)
            if (self._speed, self._turn) == self._target:
                # The target is reached: the rest of the tick repeats this step.
                rates[i + 1 :] = rates[i]
                break
        return rates
