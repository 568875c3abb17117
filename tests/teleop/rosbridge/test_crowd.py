"""Many clients at once, and one that does not read: what they cost, and what they cost the others."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from teleop.rosbridge.limits import Limits
from teleop.rosbridge.types import Message, MessageType
from tests.teleop.rosbridge.support import SECOND, Wire


def test_a_message_is_encoded_once_for_all_who_want_it_alike(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    wire = Wire(9, limits=Limits.unhurried())
    codec = wire.protocol.encoders.codec
    done: list[str] = []
    for method in ("json_pieces", "cbor"):

        def counted(kind: MessageType, message: Message, method: str = method) -> Any:
            done.append(method)
            return getattr(type(codec), method)(codec, kind, message)

        monkeypatch.setattr(codec, method, counted)
    wire.protocol.advertise("/cloud", "sensor_msgs/PointCloud2")
    for client in range(8):
        compression = "cbor" if client % 2 else "none"
        wire.send({"op": "subscribe", "topic": "/cloud", "compression": compression}, client)
    for _ in range(3):
        wire.protocol.publish("/cloud", {"data": np.arange(99, dtype=np.uint8)}, SECOND)
        payloads = [wire.outputs(client)[0].payload for client in range(8)]
        assert len({id(payload) for payload in payloads}) == 2
    assert sorted(done) == ["cbor"] * 3 + ["json_pieces"] * 3
