"""A second arm: a board with its servos, as the first one but with its own pulses, dead bands and play."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from robot_sim.arm.arm_table import JOINTS, ArmTable
from robot_sim.arm.servo import DEGREES, Resolution, ServoBank
from robot_sim.arm.servo_firmware import RANGE, ServoFirmware
from robot_sim.array_types import FloatArray

BAUD: Final = 115_200
"""Bits per second of the line; a character takes ten."""
COUNTS: Final = (100, 600)
"""What the converter of ten bits reads of a potentiometer at 0 and at 180 degrees, as the sketch has it."""

_CHARACTER: Final = 10 * 1_000_000_000 // BAUD


class ServoBoard:
    """A board, its servos and its line, without clock and port: time passes where ``advance`` says so.

    Owns the firmware, the servos and the characters that are on the way.
    """

    def __init__(
        self,
        table: ArmTable,
        resolution: Resolution = "degree",
        *,
        feedback: bool = True,
        angles: npt.ArrayLike | None = None,
    ) -> None:
        """Switch the board on.

        Args:
            table: The arm.
            resolution: What the pulses are rounded to.
            feedback: Whether the servos have feedback wires.
            angles: Where the joints stand, shape (5,) [rad]; the stow pose by default.
        """
        self.firmware = ServoFirmware(table, resolution, feedback=feedback)
        """What runs on the board."""
        self.servos = ServoBank(table, angles=angles)
        """The servos of the joints."""
        self.opening = 0.0
        """Opening of the gripper [m]."""
        self._widest = table.gripper.opening
        self._reach = table.gripper.speed * table.pulses.frame
        self._lower, self._upper = np.array(table.lower), np.array(table.upper)
        self._frame = round(1e9 * table.pulses.frame)
        self._until_frame = self._frame
        self._in, self._out = _Wire(), _Wire()

    def take(self, data: bytes) -> None:
        """Put characters on the line to the board, which takes them at the line's rate."""
        self._in.put(data)

    @property
    def waiting(self) -> int:
        """Characters that are still on the line to the board."""
        return self._in.waiting

    def advance(self, duration: int) -> bytes:
        """Let time [ns] pass; return the characters that arrive from the board meanwhile."""
        arrived = b""
        while duration > 0:
            step = min(duration, self._until_frame)
            duration -= step
            self._until_frame -= step
            if data := self._in.advance(step):
                self.firmware.take(data, self._readings())
            arrived += self._out.advance(step)
            if self._until_frame == 0:
                self._run_frame()
                self._until_frame = self._frame
        return arrived

    def reset(self) -> None:
        """Restart the board, as its button does: what was on the line is lost, and the servos go limp."""
        self.firmware.reset()
        self._in, self._out = _Wire(), _Wire()
        self._until_frame = self._frame

    @property
    def angles(self) -> FloatArray:
        """Where the joints stand, shape (5,) [rad]: what no wire says, for they have play."""
        return self.servos.aims

    def _run_frame(self) -> None:
        """Let the servos turn by the pulses of the frame that ends, and send those of the next."""
        if (written := self.firmware.written) is not None:
            self.servos.turn(1e-9 * self._frame)
            wanted = self._widest * written[JOINTS] / RANGE
            self.opening += max(-self._reach, min(wanted - self.opening, self._reach))
        self.firmware.frame()
        if (pulses := self.firmware.pulses) is not None:
            self.servos.drive(np.array(pulses[:JOINTS], dtype=np.float64))
        self._out.put(self.firmware.answer(self._readings()))

    def _readings(self) -> list[int]:
        """Return what the board makes of its converter's readings, above the servos' zeros [0.1 deg]."""
        shares = (self.servos.shafts - self._lower) / (self._upper - self._lower)
        return [tenths_of(share) for share in (*shares.tolist(), self.opening / self._widest)]


class _Wire:
    """One direction of a serial line: characters arrive one after the other."""

    def __init__(self) -> None:
        self._data = bytearray()
        self._time = 0

    @property
    def waiting(self) -> int:
        return len(self._data)

    def put(self, data: bytes) -> None:
        self._data += data

    def advance(self, duration: int) -> bytes:
        self._time += duration
        count = min(self._time // _CHARACTER, len(self._data))
        self._time = self._time - count * _CHARACTER if count < len(self._data) else 0
        arrived = bytes(self._data[:count])
        del self._data[:count]
        return arrived


def tenths_of(share: float) -> int:
    """Return the angle that the board makes of its converter's reading, for a share of a servo's range [0.1 deg]."""
    low, high = COUNTS
    return max(0, min((counts_of(share) - low) * RANGE // (high - low), RANGE))


def counts_of(share: float) -> int:
    """Return what the converter reads of a potentiometer that stands at this share of its servo's range."""
    low, high = COUNTS
    return round(low + share * (high - low))


assert RANGE == 10 * DEGREES
