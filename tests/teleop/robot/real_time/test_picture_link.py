"""The link between the camera and the gateway: real sockets, values of any size, ends that are replaced."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import pytest

from teleop.robot.real_time.picture_link import PictureLink, socket_pair

LARGE = 3_000_000

Ends = list[Callable[[], PictureLink]]


@pytest.fixture
def ends() -> Iterator[Ends]:
    """Return what opens the ends that control keeps, as child processes inherit them."""
    kept, opened = socket_pair(), list[PictureLink]()

    def inherited(end: socket.socket) -> PictureLink:
        opened.append(PictureLink(os.dup(end.fileno())))
        return opened[-1]

    yield [partial(inherited, end) for end in kept]
    for link in opened:
        link.close()
    for end in kept:
        end.close()


def exchanged(sender: PictureLink, receiver: PictureLink) -> list[Any]:
    """Return what arrives until nothing waits."""
    values = []
    while sender.waiting:
        values += receiver.receive()
        sender.flush()
    return values + receiver.receive()


def test_values_of_any_size_cross_both_ways(ends: Ends) -> None:
    draws, talks = (begin() for begin in ends)
    picture = os.urandom(LARGE)
    draws.send("picture", picture)
    talks.send("wanted", {"a", "b"})
    assert draws.receive() == [{"a", "b"}]
    assert exchanged(draws, talks) == [picture]


def test_sender_never_waits_and_keeps_the_newest_of_each_key(ends: Ends) -> None:
    draws, talks = (begin() for begin in ends)
    begun = os.urandom(LARGE)
    draws.send("colours", begun)
    for number in range(100):
        draws.send("colours", number)
        draws.send("depth", -number)
    assert exchanged(draws, talks) == [begun, 99, -99]


def test_rest_of_a_value_whose_sender_died_spoils_no_other(ends: Ends) -> None:
    draws, talks = (begin() for begin in ends)
    draws.send("picture", os.urandom(LARGE))
    draws.close()
    successor = ends[0]()
    successor.send("picture", b"whole")
    assert exchanged(successor, talks) == [b"whole"]


def test_rest_of_a_value_whose_receiver_died_spoils_no_other(ends: Ends) -> None:
    draws, talks = (begin() for begin in ends)
    draws.send("picture", os.urandom(LARGE))
    assert talks.receive() == []
    talks.close()
    successor = ends[1]()
    draws.send("other", b"whole")
    assert exchanged(draws, successor) == [b"whole"]
