"""Lines of text between the bridge and a board of servos; ``docs/servos.md`` describes them."""

from __future__ import annotations

import binascii
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

COUNT: Final = 6
"""Angles in a line: of five joints, and of the gripper's servo."""
LONGEST: Final = 60
"""Characters of the longest line."""

_ANGLES: Final = re.compile(rb"([AW])((?: -?\d{1,3}\.\d){6})")
_REFUSAL: Final = re.compile(rb"E ([a-z]+(?: \d)?) (\d{1,5})")
_STARTED: Final = re.compile(rb"R servos (\d{1,2})")


@dataclass(frozen=True, slots=True)
class Angles:
    """Where the board's servos are."""

    degrees: tuple[float, ...]
    """Angles of the five joints, and of the gripper's servo [deg]."""
    measured: bool
    """Whether the servos' feedback wires say so; otherwise it is what the board writes."""


@dataclass(frozen=True, slots=True)
class Refusal:
    """The board did not obey a line."""

    reason: str
    """Why."""
    count: int
    """Lines that it has refused since its start."""


@dataclass(frozen=True, slots=True)
class Started:
    """The board has started, at its power-up or anew."""

    servos: int
    """How many it has."""


Answer = Angles | Refusal | Started
"""A line of the board."""


def joint_line(degrees: Sequence[float]) -> bytes:
    """Return the line that sends the board's servos to angles [deg].

    Raises:
        ValueError: If there are not six numbers, or one is not finite or no angle; the message says which.
    """
    if len(degrees) != COUNT:
        raise ValueError(f"a board takes {COUNT} angles, of five joints and the gripper's servo")
    for n, value in enumerate(degrees, start=1):
        if not (math.isfinite(value) and abs(value) < 1000.0):
            raise ValueError(f"angle {n} is {value:g} degrees")
    # A zero without a sign, which a rounded -0.04 has: the same pose is the same line.
    words = (f"{round(float(value), 1) + 0.0:.1f}" for value in degrees)
    content = f"J {' '.join(words)}".encode("ascii")
    return b"%s*%04X\n" % (content, binascii.crc_hqx(content, 0))


class LineReader:
    """Cuts what a board sends into lines. Owns the one that has not ended."""

    def __init__(self) -> None:
        """Start in front of a line."""
        self.unreadable = 0
        """Lines that were no answer: cut, garbled or too long."""
        self._line = bytearray()

    def take(self, data: bytes) -> list[Answer]:
        """Return the answers that end in these characters."""
        answers = []
        *ends, rest = data.split(b"\n")
        for end in ends:
            line = bytes(self._line) + end
            self._line.clear()
            if (answer := _read(line)) is not None:
                answers.append(answer)
            elif line:
                self.unreadable += 1
        self._line += rest
        del self._line[LONGEST + 1 :]
        return answers


def _read(line: bytes) -> Answer | None:
    content, checksum = line[:-5], line[-5:]
    if len(line) > LONGEST or checksum != b"*%04X" % binascii.crc_hqx(content, 0):
        return None
    if (match := _ANGLES.fullmatch(content)) is not None:
        return Angles(tuple(float(word) for word in match[2].split()), match[1] == b"A")
    if (match := _REFUSAL.fullmatch(content)) is not None:
        return Refusal(match[1].decode("ascii"), int(match[2]))
    if (match := _STARTED.fullmatch(content)) is not None:
        return Started(int(match[1]))
    return None
