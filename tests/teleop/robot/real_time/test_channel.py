"""The pipe between the robot's processes: bounded, in order, and it never makes its sender wait."""

from __future__ import annotations

import socket
import threading

import pytest
from hypothesis import given, settings, strategies as st

from teleop.robot.real_time.channel import Channel, ChannelClosedError


def pair(bound: int = 1 << 20) -> tuple[Channel, Channel]:
    one, other = socket.socketpair()
    return Channel(one, bound), Channel(other, bound)


@settings(max_examples=30)
@given(st.lists(st.binary(max_size=3000), max_size=30))
def test_payloads_arrive_whole_and_in_order(payloads: list[bytes]) -> None:
    here, there = pair()
    for payload in payloads:
        here.send(payload)
    received: list[bytes] = []
    while len(received) < len(payloads):
        received += there.wait(10.0)
    assert received == payloads
    here.close()
    there.close()


def test_payload_larger_than_any_buffer_arrives_while_it_is_flushed() -> None:
    here, there = pair(bound=100)
    large = bytes(range(256)) * 40_000
    here.send(large)
    received: list[bytes] = []
    reader = threading.Thread(target=lambda: received.extend(there.wait(20.0)))
    reader.start()
    while not here.flush():
        pass
    reader.join()
    assert received == [large]
    here.close()
    there.close()


def test_sender_never_waits_and_the_oldest_unsent_payloads_are_dropped() -> None:
    here, there = pair(bound=200_000)
    numbered = [number.to_bytes(2, "little") * 5000 for number in range(400)]  # 4 MB
    for payload in numbered:
        here.send(payload)  # nobody reads
    assert here.waiting <= 200_000
    assert here.dropped > 300
    received: list[bytes] = []
    while not here.flush() or len(received) + here.dropped < len(numbered):
        received += there.wait(1.0)
    positions = [numbered.index(payload) for payload in received]
    assert positions == sorted(positions)
    assert positions[-1] == len(numbered) - 1, "the newest is kept"
    here.close()
    there.close()


def test_a_side_that_has_gone_or_sends_nonsense_is_noticed() -> None:
    here, there = pair()
    there.close()
    with pytest.raises(ChannelClosedError):
        here.receive()
    here.close()
    one, other = socket.socketpair()
    channel = Channel(one, 100)
    other.sendall(b"\xff" * 100)
    with pytest.raises(ChannelClosedError):
        channel.wait(10.0)
    channel.close()
    other.close()
