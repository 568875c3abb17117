"""Packets of the Pioneer controllers (ARIA protocol): fields, framing and checksum.

The standard server information packet (SIP) and the frame around every packet, as the public
drivers read them: allenh1/p2os ``sip.cpp`` and ``packet.cpp``, reedhedges/AriaCoda ``ArRobot.cpp``,
and the Pioneer 3 Operations Manual, table 4. Words are little-endian but for the checksum.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Final

from robot_sim.drive.bumpers import SEGMENTS, Bumpers
from robot_sim.errors import PacketError

PACKET_HEADER: Final = b"\xfa\xfb"
POSITION_UNITS: Final = 1 << 15
"""Range of a position, which is sent in 15 bits and wraps around."""

_STOPPED, _MOVING = 0x32, 0x33
_LONGEST: Final = 200
"""Largest number of bytes of a whole packet."""
_BEGIN: Final = struct.Struct("<BHHhhhBHhHBB")
"""Type, x, y, heading, left and right speed, battery, stalls and bumpers, control, flags, compass,
number of sonar readings."""
_SONAR: Final = struct.Struct("<BH")
_END: Final = struct.Struct("<BBBBBHBh")
"""Gripper, analogue port, analogue input, digital in and out, battery again, charger, yaw rate."""


def checksum(data: bytes) -> int:
    """Return the sum of big-endian words modulo 2^16, exclusive-or'ed with an odd last byte."""
    even = len(data) & ~1
    total = sum(data[i] << 8 | data[i + 1] for i in range(0, even, 2)) & 0xFFFF
    return total ^ data[-1] if len(data) > even else total


def frame_packet(data: bytes) -> bytes:
    """Return the frame around a packet's data, which begins with its type.

    Raises:
        PacketError: the data are too long for one packet.
    """
    if len(data) > _LONGEST - 5:
        raise PacketError(f"a packet holds at most {_LONGEST - 5} bytes, got {len(data)}")
    return PACKET_HEADER + bytes([len(data) + 2]) + data + checksum(data).to_bytes(2, "big")


def unframe_packet(packet: bytes) -> bytes:
    """Return the data of one whole packet.

    Raises:
        PacketError: the bytes are not one valid packet; the message gives the reason.
    """
    if packet[:2] != PACKET_HEADER:
        raise PacketError(f"a packet begins with fa fb, got {packet[:2].hex(' ') or 'nothing'}")
    if len(packet) < 6 or packet[2] != len(packet) - 3:
        raise PacketError(
            f"a packet's third byte must be the number of bytes after it, got {len(packet)} bytes"
        )
    data, found = packet[3:-2], int.from_bytes(packet[-2:], "big")
    if found != checksum(data):
        raise PacketError(f"checksum is {found:#06x}, the data's is {checksum(data):#06x}")
    return data


@dataclass(frozen=True, slots=True)
class StandardPacket:
    """The standard server information packet (SIP), in the controller's own units."""

    moving: bool
    """Whether the wheels move."""
    x: int
    """Position x in [0, 32768); times ``DistConvFactor`` it is in [mm]."""
    y: int
    """Position y, in the same units as ``x``."""
    heading: int
    """Signed heading; times ``AngleConvFactor`` it is in [rad]."""
    left: int
    """Speed of the left wheels; times ``VelConvFactor`` it is in [mm/s]."""
    right: int
    """Speed of the right wheels, in the same units as ``left``."""
    turn: int
    """Yaw rate [0.1 deg/s]."""
    battery: int
    """Battery voltage [0.1 V]."""
    left_stalled: bool
    """Whether the left motors are stalled."""
    right_stalled: bool
    """Whether the right motors are stalled."""
    bumpers: Bumpers
    """Pressed segments of the bumper rings."""
    control: int = 0
    """Set-point of the heading servo, in units of ``heading``."""
    flags: int = 1
    """Status bits; bit 0: motors enabled."""
    compass: int = 0
    """Compass heading [2 deg]."""
    sonars: tuple[tuple[int, int], ...] = ()
    """Number and range [mm] of each sonar with a new reading."""

    def to_bytes(self) -> bytes:
        """Return the packet as it is sent.

        Raises:
            PacketError: a number does not fit its field.
        """
        front = _bits(self.bumpers.front)
        # The rear ring is numbered from its right end.
        rear = _bits(self.bumpers.rear[::-1])
        touched = self.left_stalled | rear << 1 | self.right_stalled << 8 | front << 9
        try:
            data = _BEGIN.pack(
                _MOVING if self.moving else _STOPPED,
                self.x,
                self.y,
                self.heading,
                self.left,
                self.right,
                self.battery,
                touched,
                self.control,
                self.flags,
                self.compass,
                len(self.sonars),
            )
            data += b"".join(_SONAR.pack(*sonar) for sonar in self.sonars)
            data += _END.pack(0, 0, 0, 0, 0, self.battery, 0, self.turn)
        except struct.error as error:
            raise PacketError(f"a number does not fit the standard packet: {error}") from None
        return frame_packet(data)

    @classmethod
    def from_bytes(cls, packet: bytes) -> StandardPacket:
        """Read a packet; bytes after the yaw rate are ignored, as by older clients.

        Raises:
            PacketError: the bytes are not one valid standard packet.
        """
        data = unframe_packet(packet)
        if data[0] not in (_STOPPED, _MOVING):
            raise PacketError(f"a standard packet has type 0x32 or 0x33, got {data[0]:#04x}")
        try:
            begin = _BEGIN.unpack_from(data)
            at = [_BEGIN.size + i * _SONAR.size for i in range(begin[-1])]
            sonars = tuple(_SONAR.unpack_from(data, i) for i in at)
            end = _END.unpack_from(data, _BEGIN.size + len(at) * _SONAR.size)
        except struct.error:
            raise PacketError(f"a standard packet is longer than {len(data)} bytes") from None
        kind, x, y, heading, left, right, battery, touched, control, flags, compass, _ = begin
        return cls(
            moving=kind == _MOVING,
            x=x % POSITION_UNITS,
            y=y % POSITION_UNITS,
            heading=heading,
            left=left,
            right=right,
            turn=end[-1],
            battery=battery,
            left_stalled=bool(touched & 1),
            right_stalled=bool(touched >> 8 & 1),
            bumpers=Bumpers(_flags(touched >> 9), _flags(touched >> 1)[::-1]),
            control=control,
            flags=flags,
            compass=compass,
            sonars=sonars,
        )


def _bits(segments: tuple[bool, ...]) -> int:
    return sum(pressed << i for i, pressed in enumerate(segments))


def _flags(bits: int) -> tuple[bool, ...]:
    return tuple(bool(bits >> i & 1) for i in range(SEGMENTS))
