"""The controller's packets: known frames, round trips, and bytes that are no packet."""

from __future__ import annotations

import pytest
from hypothesis import given, strategies as st

from robot_sim.drive.aria_packets import (
    POSITION_UNITS,
    StandardPacket,
    checksum,
    frame_packet,
    unframe_packet,
)
from robot_sim.drive.bumpers import Bumpers
from robot_sim.errors import PacketError

words = st.integers(-32768, 32767)
ring = st.tuples(*[st.booleans()] * 5)
packets = st.builds(
    StandardPacket,
    moving=st.booleans(),
    x=st.integers(0, POSITION_UNITS - 1),
    y=st.integers(0, POSITION_UNITS - 1),
    heading=words,
    left=words,
    right=words,
    turn=words,
    battery=st.integers(0, 255),
    left_stalled=st.booleans(),
    right_stalled=st.booleans(),
    bumpers=st.builds(Bumpers, ring, ring),
    control=words,
    flags=st.integers(0, 65535),
    compass=st.integers(0, 255),
    sonars=st.lists(st.tuples(st.integers(0, 31), st.integers(0, 5000)), max_size=16).map(tuple),
)

PLAIN = StandardPacket(
    moving=True,
    x=1000,
    y=POSITION_UNITS - 500,
    heading=-1027,
    left=195,
    right=205,
    turn=10,
    battery=121,
    left_stalled=False,
    right_stalled=True,
    bumpers=Bumpers(front=(True, False, False, False, False)),
)


@pytest.mark.parametrize(
    ("data", "whole"),
    [
        # The client's SYNC0, SYNC1, SYNC2 and ENABLE with argument 1, as the drivers send them.
        ("00", "fa fb 03 00 00 00"),
        ("01", "fa fb 03 01 00 01"),
        ("02", "fa fb 03 02 00 02"),
        ("04 3b 01 00", "fa fb 06 04 3b 01 00 05 3b"),
    ],
)
def test_known_packets_are_framed_as_public_drivers_frame_them(data: str, whole: str) -> None:
    assert frame_packet(bytes.fromhex(data)) == bytes.fromhex(whole)
    assert unframe_packet(bytes.fromhex(whole)) == bytes.fromhex(data)


def test_fields_of_a_packet_are_at_the_offsets_of_public_drivers() -> None:
    data = unframe_packet(PLAIN.to_bytes())
    assert data[0] == 0x33
    assert int.from_bytes(data[1:3], "little") == 1000
    assert int.from_bytes(data[3:5], "little") == 32268
    assert int.from_bytes(data[5:7], "little", signed=True) == -1027
    assert int.from_bytes(data[7:9], "little", signed=True) == 195
    assert int.from_bytes(data[9:11], "little", signed=True) == 205
    assert data[11] == 121
    # Left stall and rear ring, then right stall and front ring, the front's left end in bit 1.
    assert data[12] == 0
    assert data[13] == 0b11


def test_rear_ring_is_numbered_from_its_right_end() -> None:
    left_end = StandardPacket(
        False, 0, 0, 0, 0, 0, 0, 120, False, False, Bumpers(rear=(True, *[False] * 4))
    )
    assert unframe_packet(left_end.to_bytes())[12] == 0b100000


@given(packets)
def test_packet_survives_encoding_and_decoding(packet: StandardPacket) -> None:
    assert StandardPacket.from_bytes(packet.to_bytes()) == packet


@given(st.binary(min_size=1, max_size=195), st.integers(0, 7))
def test_flipped_bit_is_detected_or_changes_the_data_only(data: bytes, bit: int) -> None:
    whole = bytearray(frame_packet(data))
    whole[3] ^= 1 << bit
    with pytest.raises(PacketError, match="checksum"):
        unframe_packet(bytes(whole))


@given(st.binary(max_size=40))
def test_random_bytes_are_rejected_in_one_line(garbage: bytes) -> None:
    with pytest.raises(PacketError) as refusal:
        StandardPacket.from_bytes(b"\xfa" + garbage)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    ("packet", "why"),
    [
        (b"", "begins with"),
        (b"\xfa\xfb\x09\x00\x00\x00", "third byte"),
        (frame_packet(b"\x20abc"), "0x20"),
        (frame_packet(b"\x32abc"), "longer"),
    ],
)
def test_rejected_packet_gives_the_reason(packet: bytes, why: str) -> None:
    with pytest.raises(PacketError, match=why):
        StandardPacket.from_bytes(packet)


def test_number_that_does_not_fit_its_field_is_rejected() -> None:
    with pytest.raises(PacketError, match="fit"):
        StandardPacket(False, 0, 0, 0, 40_000, 0, 0, 120, False, False, Bumpers()).to_bytes()
    with pytest.raises(PacketError, match="195"):
        frame_packet(bytes(196))


def test_checksum_of_an_odd_number_of_bytes_includes_the_last() -> None:
    assert checksum(b"\x01\x02\x03") == 0x0102 ^ 0x03
    assert checksum(b"\xff\xff\x00\x02") == 1
