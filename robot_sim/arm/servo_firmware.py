"""What runs on the board of a second arm: lines of text in, angles of its servos out, and lines back.

The same rules as in ``examples/servo_board/servo_board.ino``, against which a test compares it character by character.
All angles are tenths of a degree. A line is a letter and its fields, ``*``, a checksum of four digits, and a newline:

- in: ``J`` and six angles with one decimal, of the five joints and of the gripper's servo (0 closed to 180 open).
- out, in each frame: ``A`` and the angles that the servos' feedback wires say, or, without such wires, ``W`` and those
  that the board writes; ``E``, a reason and the count of refused lines, if there were any; ``R`` after a start.

A line that is not exactly so moves nothing. Silence moves nothing either: the servos hold.
"""

from __future__ import annotations

import binascii
import re
from collections.abc import Sequence
from typing import Final

from robot_sim.arm.arm_table import ArmTable
from robot_sim.arm.servo import Resolution

COUNT: Final = 6
"""Servos: of five joints, and of the gripper."""
RANGE: Final = 1800
"""Range of a servo [0.1 deg]."""
LONGEST: Final = 60
"""Characters of the longest line, without its end."""

_FASTEST: Final = 40  # 200 degrees/s in frames of 20 ms, as the table's motion limit
_LINE: Final = re.compile(rb"J((?: -?\d{1,3}\.\d){6})")


class ServoFirmware:
    """The program of the board, without a clock and without a port. Owns what it has read and what it writes."""

    def __init__(
        self, table: ArmTable, resolution: Resolution = "degree", *, feedback: bool = True
    ) -> None:
        """Start with limp servos.

        Args:
            table: The arm, for the angles at the servos' ends, and their pulses.
            resolution: What the pulses are rounded to.
            feedback: Whether the servos have feedback wires.
        """
        self.lower = (*(round(10 * degrees(angle)) for angle in table.lower), 0)
        """What the servos' zeros stand for [0.1 deg]."""
        self._shortest = round(1e6 * table.pulses.shortest)
        self._span = round(1e6 * table.pulses.longest) - self._shortest
        self._whole_degrees = resolution == "degree"
        self._feedback = feedback
        self.reset()

    def reset(self) -> None:
        """Start anew: the servos are limp until the next good line."""
        self.written: tuple[int, ...] | None = None
        """Where the servos are sent, above their zeros; None while they get no pulses."""
        self._target: tuple[int, ...] | None = None
        self._line = bytearray()
        self._refused = 0
        self._refusal: str | None = None
        self._started = True

    def take(self, data: bytes, standing: Sequence[int]) -> None:
        """Read characters.

        Args:
            data: What has come, in pieces of any length.
            standing: What the feedback wires say now, above the servos' zeros.
        """
        *lines, rest = data.split(b"\n")
        for line in lines:
            self._read(bytes(self._line) + line, standing)
            self._line.clear()
        self._line += rest
        del self._line[LONGEST + 1 :]

    def frame(self) -> None:
        """Write the pulses of a frame: closer to what is wanted, not faster than the arm may move."""
        if self.written is not None and self._target is not None:
            self.written = tuple(
                at + max(-_FASTEST, min(wanted - at, _FASTEST))
                for at, wanted in zip(self.written, self._target, strict=True)
            )

    @property
    def pulses(self) -> list[int] | None:
        """The pulses of this frame [us]; None while the servos get none."""
        if self.written is None:
            return None
        if self._whole_degrees:
            return [self._shortest + (at + 5) // 10 * self._span // 180 for at in self.written]
        half = RANGE // 2
        return [self._shortest + (at * self._span + half) // RANGE for at in self.written]

    def answer(self, standing: Sequence[int]) -> bytes:
        """Return the lines at the end of a frame, for what the feedback wires say now."""
        lines, cut = [], b""
        if self._started:
            cut = b"\n"  # ends the line that a reset has cut
            lines.append(f"R servos {COUNT}")
            self._started = False
        if self._refusal is not None:
            lines.append(f"E {self._refusal} {self._refused}")
            self._refusal = None
        angles = standing if self._feedback else self.written
        if angles is not None:
            values = (tenths + zero for tenths, zero in zip(angles, self.lower, strict=True))
            lines.append(" ".join(("A" if self._feedback else "W", *map(decimal, values))))
        return cut + b"".join(map(checked, lines))

    def _read(self, line: bytes, standing: Sequence[int]) -> None:
        if len(line) > LONGEST:
            self._refuse("length")
        elif line:
            content, sum_ = line[:-5], line[-5:]
            if len(line) < 5:
                self._refuse("form")
            elif sum_ != b"*%04X" % checksum(content):
                self._refuse("checksum")
            elif (match := _LINE.fullmatch(content)) is None:
                self._refuse("form")
            else:
                self._aim([int(word.replace(b".", b"")) for word in match[1].split()], standing)

    def _aim(self, angles: Sequence[int], standing: Sequence[int]) -> None:
        target = tuple(angle - zero for angle, zero in zip(angles, self.lower, strict=True))
        for n, tenths in enumerate(target, start=1):
            if not 0 <= tenths <= RANGE:
                return self._refuse(f"range {n}")
        self._target = target
        if self.written is None:
            # Without feedback wires it can only be hoped that the arm stands where it is wanted.
            self.written = tuple(standing) if self._feedback else target
        return None

    def _refuse(self, why: str) -> None:
        self._refused = (self._refused + 1) % 65536
        self._refusal = why


def degrees(angle: float) -> float:
    """Return an angle [rad] in degrees, rounded as a table has it."""
    return round(angle * 57.29577951308232, 6)


def decimal(tenths: int) -> str:
    """Return tenths as a number with one decimal."""
    whole, part = divmod(abs(tenths), 10)
    return f"{'-' if tenths < 0 else ''}{whole}.{part}"


def checksum(content: bytes) -> int:
    """Return the CRC-16/XMODEM of a line's content, which finds what a sum misses: characters that were lost."""
    return binascii.crc_hqx(content, 0)


def checked(content: str) -> bytes:
    """Return a line with its checksum and its end."""
    text = content.encode("ascii")
    return b"%s*%04X\n" % (text, checksum(text))
