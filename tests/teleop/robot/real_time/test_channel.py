"""The pipe between the robot's processes: bounded, in order, and it never makes its sender wait."""

from __future__ import annotations

import socket
import threading
import time

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


def test_waiting_ends_in_time_while_a_payload_trickles_in() -> None:
    end, other = socket.socketpair()
    here, stop = Channel(end, 1 << 20), threading.Event()

    def trickle() -> None:
        other.sendall((1 << 20).to_bytes(4, "little"))
        while not stop.wait(0.02):
            other.sendall(b"x")

    peer = threading.Thread(target=trickle)
    peer.start()
    try:
        begun = time.monotonic()
        assert here.wait(0.2) == []
        assert 0.2 <= time.monotonic() - begun < 5.0, "each byte gave the whole payload 0.2 s more"
    finally:
        stop.set()
        peer.join()
        here.close()
        other.close()


def test_waiting_ends_in_time_while_the_other_side_takes_what_waits() -> None:
    end, other = socket.socketpair()
    here, stop = Channel(end, 1 << 30), threading.Event()
    here.send(bytes(20_000_000))

    def read() -> None:
        while not stop.wait(0.02):
            other.recv(50_000)

    peer = threading.Thread(target=read)
    peer.start()
    try:
        begun = time.monotonic()
        assert here.wait(0.2) == []
        assert 0.2 <= time.monotonic() - begun < 5.0, "each part that was taken began the wait anew"
    finally:
        stop.set()
        peer.join()
        here.close()
        other.close()


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
