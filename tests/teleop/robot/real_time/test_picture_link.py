"""The link between the camera and the gateway: real sockets, values of any size, ends that are replaced."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from typing import Any

import pytest

from teleop.robot.real_time.picture_link import PictureLink, socket_pair

LARGE = 3_000_000


@pytest.fixture
def pair() -> Iterator[tuple[socket.socket, socket.socket]]:
    """Return the ends that control keeps."""
    ends = socket_pair()
    yield ends
    for end in ends:
        end.close()


def end_of(kept: socket.socket) -> PictureLink:
    """Return an end as a child process inherits it."""
    return PictureLink(os.dup(kept.fileno()))


def exchanged(sender: PictureLink, receiver: PictureLink) -> list[Any]:
    """Return what arrives until nothing waits."""
    values = []
    while sender.waiting:
        values += receiver.receive()
        sender.flush()
    return values + receiver.receive()


def test_values_of_any_size_cross_both_ways(pair: tuple[socket.socket, socket.socket]) -> None:
    draws, talks = map(end_of, pair)
    picture = os.urandom(LARGE)
    draws.send("picture", picture)
    talks.send("wanted", {"a", "b"})
    assert draws.receive() == [{"a", "b"}]
    assert exchanged(draws, talks) == [picture]
    draws.close()
    talks.close()


def test_sender_never_waits_and_keeps_the_newest_of_each_key(
    pair: tuple[socket.socket, socket.socket],
) -> None:
    draws, talks = map(end_of, pair)
    begun = os.urandom(LARGE)
    draws.send("colours", begun)
    for number in range(100):
        draws.send("colours", number)
        draws.send("depth", -number)
    assert exchanged(draws, talks) == [begun, 99, -99]
    draws.close()
    talks.close()


def test_rest_of_a_value_whose_sender_died_spoils_no_other(
    pair: tuple[socket.socket, socket.socket],
) -> None:
    draws, talks = map(end_of, pair)
    draws.send("picture", os.urandom(LARGE))
    draws.close()
    successor = end_of(pair[0])
    successor.send("picture", b"whole")
    assert exchanged(successor, talks) == [b"whole"]
    successor.close()
    talks.close()


def test_rest_of_a_value_whose_receiver_died_spoils_no_other(
    pair: tuple[socket.socket, socket.socket],
) -> None:
    draws, talks = map(end_of, pair)
    draws.send("picture", os.urandom(LARGE))
    assert talks.receive() == []
    talks.close()
    successor = end_of(pair[1])
    draws.send("other", b"whole")
    assert exchanged(draws, successor) == [b"whole"]
    draws.close()
    successor.close()
