"""The pipe between the robot's processes: bounded, in order, and it never makes its sender wait."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest
from hypothesis import given, settings, strategies as st

from teleop.robot.real_time.channel import Channel, ChannelClosedError


@contextmanager
def pair(bound: int = 1 << 20) -> Iterator[tuple[Channel, Channel]]:
    here, there = (Channel(end, bound) for end in socket.socketpair())
    yield here, there
    here.close()
    there.close()


@settings(max_examples=30)
@given(st.lists(st.binary(max_size=3000), max_size=30))
def test_payloads_arrive_whole_and_in_order(payloads: list[bytes]) -> None:
    with pair() as (here, there):
        for payload in payloads:
            here.send(payload)
        received: list[bytes] = []
        while len(received) < len(payloads):
            received += there.wait(10.0)
        assert received == payloads


def test_payload_larger_than_any_buffer_arrives_while_it_is_flushed() -> None:
    with pair(bound=100) as (here, there):
        large = bytes(range(256)) * 40_000
        here.send(large)
        received: list[bytes] = []
        reader = threading.Thread(target=lambda: received.extend(there.wait(20.0)))
        reader.start()
        while not here.flush():
            pass
        reader.join()
        assert received == [large]


def trickle(other: socket.socket, stop: threading.Event) -> None:
    """Send a payload byte by byte: each would give the whole of it as much time again."""
    other.sendall((1 << 20).to_bytes(4, "little"))
    while not stop.wait(0.02):
        other.sendall(b"x")


def take(other: socket.socket, stop: threading.Event) -> None:
    """Take what waits part by part: each would begin the wait anew."""
    while not stop.wait(0.02):
        other.recv(50_000)


@pytest.mark.parametrize(("busy", "waiting"), [(trickle, 0), (take, 20_000_000)])
def test_waiting_ends_in_time_while_a_payload_trickles_in_or_what_waits_is_taken(
    busy: Callable[[socket.socket, threading.Event], None], waiting: int
) -> None:
    end, other = socket.socketpair()
    here, stop = Channel(end, 1 << 30), threading.Event()
    if waiting:
        here.send(bytes(waiting))
    peer = threading.Thread(target=busy, args=(other, stop))
    peer.start()
    try:
        begun = time.monotonic()
        assert here.wait(0.2) == []
        assert 0.2 <= time.monotonic() - begun < 5.0
    finally:
        stop.set()
        peer.join()
        here.close()
        other.close()


def test_sender_never_waits_and_the_oldest_unsent_payloads_are_dropped() -> None:
    with pair(bound=200_000) as (here, there):
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


def test_a_side_that_has_gone_or_sends_nonsense_is_noticed() -> None:
    with pair() as (here, there):
        there.close()
        with pytest.raises(ChannelClosedError):
            here.receive()
    one, other = socket.socketpair()
    other.sendall(b"\xff" * 100)
    with one, other, pytest.raises(ChannelClosedError):
        Channel(one, 100).wait(10.0)
