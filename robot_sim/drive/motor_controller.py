"""Motor controller like the P3-AT's firmware: packets every 100 ms, integer units, vendor constants.

It uses the vendor's effective track where the rest of this project uses the closed form, sends speeds
in mm/s and positions in mm, accepts commands at the resolution of its protocol, cuts the power when
the motors stall, and stops when a bumper is pressed in the direction of travel.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from localization.types import SECOND, WheelSpeeds
from robot_sim.drive.aria_packets import POSITION_UNITS, StandardPacket
from robot_sim.drive.bumpers import Bumpers
from robot_sim.drive.robot_condition import Condition

_MOST_STEPS = 127
"""Largest value of a signed byte, in which ``VEL2`` encodes the speed of a side."""


class MotionCommand(StrEnum):
    """Protocol command by which the client sets the motion."""

    VEL = "vel"
    """``VEL`` in integer mm/s and ``RVEL`` in integer deg/s, as ARIA and ROSARIA use them."""
    VEL2 = "vel2"
    """``VEL2``: each side in units of ``Vel2Divisor`` mm/s."""


class Override(StrEnum):
    """What the controller does with the motors regardless of the command."""

    NONE = "none"
    """The command is followed."""
    STOP = "stop"
    """The wheels are held where they are."""
    RELAX = "relax"
    """The motors have no power."""


@dataclass(frozen=True, slots=True)
class FirmwareConfig:
    """Constants of the controller; those of the P3-AT are from AriaCoda's ``p3at-sh.p``.

    Raises:
        ValueError: a number is not finite and positive.
    """

    cycle: int = SECOND // 10
    """Time between packets [ns]; AriaCoda."""
    distance_factor: float = 1.0
    """``DistConvFactor``: size of one unit of position [mm]."""
    angle_factor: float = 0.00153
    """``AngleConvFactor``: size of one unit of heading [rad]."""
    velocity_factor: float = 1.0
    """``VelConvFactor``: size of one unit of speed [mm/s]."""
    differential_factor: float = 0.0034
    """``DiffConvFactor``: yaw rate over half the difference of the sides' speeds [rad/mm]."""
    vel2_divisor: float = 20.0
    """``Vel2Divisor``: size of one unit of a ``VEL2`` command [mm/s]."""
    motion: MotionCommand = MotionCommand.VEL
    """Protocol command by which motion is commanded."""
    bump_stall: bool = True
    """Whether a bumper that is pressed in the direction of travel stops the robot and is reported
    as a stall of both sides; the manual's BumpStall, on by default."""
    stall_pause: int = SECOND // 5
    """Time for which a stall cuts the power [ns]: StallCount; 200 ms as remembered."""
    battery: float = 12.0
    """Battery voltage in the packets [V]: the nominal one, because the battery is not simulated."""

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            value = getattr(self, name)
            number = isinstance(value, int | float) and not isinstance(value, bool)
            if number and not (math.isfinite(value) and value > 0):
                raise ValueError(f"firmware {name} must be > 0, got {value}")

    @property
    def effective_track(self) -> float:
        """Distance [m] that divides the difference of the rim speeds to give the yaw rate."""
        return 2e-3 / self.differential_factor


def quantised_command(forward: float, turn: float, config: FirmwareConfig) -> tuple[float, float]:
    """Return a command [m/s, rad/s] at the resolution of the controller's protocol."""
    if config.motion is MotionCommand.VEL:
        return round(1e3 * forward) / 1e3, math.radians(round(math.degrees(turn)))
    unit = 1e-3 * config.vel2_divisor
    across = 0.5 * config.effective_track * turn
    left, right = (
        unit * max(-_MOST_STEPS, min(_MOST_STEPS, round(speed / unit)))
        for speed in (forward - across, forward + across)
    )
    return 0.5 * (left + right), (right - left) / config.effective_track


class Firmware:
    """Integrates the encoders' speeds to a pose and sends a packet once per cycle."""

    def __init__(self, config: FirmwareConfig) -> None:
        self._config = config
        self._x, self._y, self._heading = 0.0, 0.0, 0.0
        self._due = config.cycle
        self._begun = 0
        self._rolled = (0.0, 0.0)
        self._bumpers = Bumpers()
        self._stalled = (False, False)
        self._paused_until = -1
        self.packet: StandardPacket | None = None
        """The packet of the last tick; None if none was due."""

    def judge(self, condition: Condition, forward: float) -> Override:
        """Return the override for the coming tick.

        Args:
            condition: Condition of the robot after the last tick.
            forward: Forward speed that the drivetrain aims for [m/s].
        """
        c = self._config
        left, right = condition.left_stalled, condition.right_stalled
        if left or right:
            self._paused_until = condition.stamp + c.stall_pause
        bumped = c.bump_stall and (
            (forward > 0.0 and any(condition.bumpers.front))
            or (forward < 0.0 and any(condition.bumpers.rear))
        )
        self._bumpers = self._bumpers | condition.bumpers
        seen_left, seen_right = self._stalled
        self._stalled = (seen_left or left or bumped, seen_right or right or bumped)
        if condition.stamp < self._paused_until:
            return Override.RELAX
        return Override.STOP if bumped else Override.NONE

    def take(self, speeds: WheelSpeeds, dt: float) -> WheelSpeeds | None:
        """Take the encoders' speeds over ``dt`` [s]; return the client's speeds if a packet is due.

        Their stamp is the packet's, and they are means over the cycle, in integer units.
        """
        c = self._config
        left, right = speeds.left * dt, speeds.right * dt
        turned = (right - left) / c.effective_track
        along, heading = 0.5 * (left + right), self._heading + 0.5 * turned
        self._x += along * math.cos(heading)
        self._y += along * math.sin(heading)
        self._heading = math.remainder(self._heading + turned, math.tau)
        self._rolled = (self._rolled[0] + left, self._rolled[1] + right)
        self.packet = None
        if speeds.stamp < self._due:
            return None
        elapsed = (speeds.stamp - self._begun) / SECOND
        self.packet = self._standard_packet(elapsed)
        self._begun, self._rolled = speeds.stamp, (0.0, 0.0)
        self._bumpers, self._stalled = Bumpers(), (False, False)
        while self._due <= speeds.stamp:
            self._due += c.cycle
        return wheel_speeds(self.packet, speeds.stamp, c)

    def _standard_packet(self, elapsed: float) -> StandardPacket:
        c = self._config
        left, right = (rolled / elapsed for rolled in self._rolled)
        units = [round(1e3 * speed / c.velocity_factor) for speed in (left, right)]
        turn = (right - left) / c.effective_track
        return StandardPacket(
            moving=any(units),
            x=round(1e3 * self._x / c.distance_factor) % POSITION_UNITS,
            y=round(1e3 * self._y / c.distance_factor) % POSITION_UNITS,
            heading=round(self._heading / c.angle_factor),
            left=units[0],
            right=units[1],
            turn=round(10.0 * math.degrees(turn)),
            battery=round(10.0 * c.battery),
            left_stalled=self._stalled[0],
            right_stalled=self._stalled[1],
            bumpers=self._bumpers,
        )


def wheel_speeds(packet: StandardPacket, stamp: int, config: FirmwareConfig) -> WheelSpeeds:
    """Return the wheel speeds that a client reads from a packet received at ``stamp`` [ns]."""
    unit = 1e-3 * config.velocity_factor
    # Rounded to float32, the resolution of the message.
    left, right = (float(np.float32(unit * n)) for n in (packet.left, packet.right))
    return WheelSpeeds(stamp, left, right)
