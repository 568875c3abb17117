"""Quality-of-service policies of topics."""

from __future__ import annotations

from typing import Any

import pytest

from tests.teleop.rosbridge.support import CHATTER, Wire, publish, subscribe


@pytest.mark.parametrize("keeps", [{"latch": True}, {"qos": {"durability": "transient_local"}}])
def test_last_message_is_kept_on_request_unless_the_subscriber_is_volatile(keeps: Any) -> None:
    wire = Wire(clients=3)
    wire.send({"op": "advertise", **CHATTER, **keeps}, 0)
    wire.send(publish("old"), 0)
    wire.send(publish("x"), 0)
    for identity in "ab":
        wire.send(subscribe(id=identity), 1)
    wire.send(subscribe(qos={"durability": "volatile"}), 2)
    assert wire.received(1) == [publish("x")]
    assert wire.received(2) == []


@pytest.mark.parametrize(
    ("qos", "depth"),
    [
        ({}, 4),
        ({"depth": 2}, 2),
        ({"reliability": "best_effort", "history": "keep_last", "depth": 10}, 10),
        ({"depth": 2, "history": "keep_all"}, 0),
        (None, 4),
    ],
)
def test_qos_depth_is_the_queue_length(qos: object, depth: int) -> None:
    wire = Wire()
    wire.send(subscribe(queue_length=4, qos=qos))
    wire.send(publish("x"))
    assert [output.depth for output in wire.outputs()] == [depth]
