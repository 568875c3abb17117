"""Hobby servos as they are: pulses, dead band, speed and play between a wanted angle and the one that a gear aims at.

A servo gets a pulse in each frame of 20 ms, whose width is the angle. Its motor turns at a bounded speed until the
shaft's potentiometer is within the dead band of that width, and stops there: in the direction of the last motion each
change is followed, while on a reversal twice the dead band is not. Behind the shaft the gear and its spline have play.
Torque is no matter of this module: the plant bounds it.
"""

from __future__ import annotations

from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from robot_sim.arm.arm_table import ArmTable
from robot_sim.array_types import FloatArray

Resolution = Literal["microsecond", "degree"]
"""What a pulse is rounded to: as Arduino's ``Servo.writeMicroseconds``, or as its ``Servo.write`` of whole degrees."""

DEGREES: Final = 180
"""Degrees of ``Servo.write`` from the shortest pulse to the longest, whatever the servo's own range is."""


class ServoBank:
    """The servos of an arm's joints. Owns where their shafts stand, and on which side of its play each gear rests."""

    def __init__(
        self,
        table: ArmTable,
        resolution: Resolution = "microsecond",
        angles: npt.ArrayLike | None = None,
    ) -> None:
        """Let the servos stand.

        Args:
            table: The arm.
            resolution: What a pulse is rounded to.
            angles: Where the joints stand, shape (5,) [rad]; the stow pose by default.
        """
        pulses = table.pulses
        self._lower = np.array(table.lower)
        self._upper = np.array(table.upper)
        self._shortest = round(1e6 * pulses.shortest)
        self._span = round(1e6 * pulses.longest) - self._shortest
        self._per_angle = self._span / (self._upper - self._lower)
        self._whole_degrees = resolution == "degree"
        servos = [joint.servo for joint in table.joints]
        self._band = 1e6 * np.array([servo.dead_band for servo in servos]) / self._per_angle
        self._speed = np.array([servo.speed for servo in servos])
        self._half_play = 0.5 * np.array([servo.play for servo in servos])
        self.place(table.poses["stow"] if angles is None else angles)

    def place(self, angles: npt.ArrayLike) -> None:
        """Let shafts and gears stand at these angles, shape (5,) [rad], and take them for wanted."""
        self._shafts = np.array(angles, dtype=np.float64)
        self._aims = self._shafts.copy()
        self.command(self._shafts)

    def widths(self, wanted: npt.ArrayLike) -> FloatArray:
        """Return the pulses for wanted angles: whole microseconds, within the servos' range.

        Args:
            wanted: Angles of the joints, shape (5,) [rad]; what is beyond a limit becomes the limit.

        Returns:
            Widths, shape (5,) [us]; for whole degrees those that ``Servo.write`` makes, which cuts where it divides.
        """
        angles = np.maximum(np.minimum(wanted, self._upper), self._lower)
        beyond = (angles - self._lower) * self._per_angle
        if self._whole_degrees:
            degrees = np.rint(beyond * (DEGREES / self._span))
            beyond = np.floor(degrees * self._span / DEGREES)
        widths: FloatArray = self._shortest + np.rint(beyond)
        return widths

    def angles(self, widths: FloatArray) -> FloatArray:
        """Return the angles that pulses [us] stand for, shape (5,) [rad]."""
        angles: FloatArray = self._lower + (widths - self._shortest) / self._per_angle
        return angles

    def command(self, wanted: npt.ArrayLike) -> FloatArray:
        """Take wanted angles, shape (5,) [rad], for the frame that begins; return its pulses, shape (5,) [us]."""
        return self.drive(self.widths(wanted))

    def drive(self, widths: FloatArray) -> FloatArray:
        """Take the pulses of the frame that begins, shape (5,) [us]; return them."""
        centre = self.angles(widths)
        self._low, self._high = centre - self._band, centre + self._band
        return widths

    def turn(self, duration: float) -> FloatArray:
        """Let the motors run for a time [s], at most a frame; return the angles the gears aim at, shape (5,) [rad]."""
        shafts, reach = self._shafts, duration * self._speed
        goal = np.maximum(np.minimum(shafts, self._high), self._low)
        shafts = self._shafts = np.maximum(np.minimum(goal, shafts + reach), shafts - reach)
        half = self._half_play
        self._aims = np.maximum(np.minimum(self._aims, shafts + half), shafts - half)
        return self._aims

    @property
    def shafts(self) -> FloatArray:
        """What the potentiometers read, shape (5,) [rad]: the shafts' angles, before the gears' play."""
        return self._shafts

    @property
    def aims(self) -> FloatArray:
        """The angles that the gears aim at, shape (5,) [rad]: the joints', as far as the torque suffices."""
        return self._aims
