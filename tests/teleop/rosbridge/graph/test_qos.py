"""Quality-of-service policies of topics."""

from __future__ import annotations

from typing import Any

import pytest

from tests.teleop.rosbridge.support import Wire

TEXT = {"topic": "/text", "type": "std_msgs/String"}


def publish(data: str) -> dict[str, Any]:
    return {"op": "publish", "topic": "/text", "msg": {"data": data}}


def test_transient_message_is_kept_unless_the_subscriber_is_volatile() -> None:
    wire = Wire(clients=3)
    wire.send({"op": "advertise", **TEXT, "qos": {"durability": "transient_local"}}, 0)
    wire.send(publish("x"), 0)
    wire.send({"op": "subscribe", **TEXT}, 1)
    wire.send({"op": "subscribe", **TEXT, "qos": {"durability": "volatile"}}, 2)
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
    wire.send({"op": "subscribe", **TEXT, "queue_length": 4, "qos": qos})
    wire.send(publish("x"))
    assert [output.depth for output in wire.outputs()] == [depth]
