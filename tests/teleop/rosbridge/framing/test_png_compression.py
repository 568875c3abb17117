"""Messages in PNG images."""

from __future__ import annotations

import json
from base64 import b64decode
from io import BytesIO
from random import Random
from typing import Any

import pytest
from hypothesis import given, strategies as st
from PIL import Image

from teleop.rosbridge.framing.png_compression import encode_png
from teleop.rosbridge.limits import ClientLimits
from teleop.rosbridge.messages.json_cbor_codec import Codec
from teleop.rosbridge.messages.ros_serialization import RosSerializer
from tests.teleop.rosbridge.framing.test_fragments import pieces
from tests.teleop.rosbridge.support import CHATTER, Wire, publish, subscribe


def pixels(png: bytes) -> bytes:
    """Return the bytes of an RGB image."""
    with Image.open(BytesIO(png)) as image:
        assert (image.format, image.mode) == ("PNG", "RGB")
        return image.tobytes()


@given(st.binary(min_size=1, max_size=3000))
def test_image_contains_the_text_padded_with_line_feeds(text: bytes) -> None:
    read = pixels(encode_png(text))
    assert read.startswith(text)
    assert not read[len(text) :].strip(b"\n")
    assert len(read) - len(text) < 3 * (len(text) ** 0.5 + 2)


def test_subscribers_may_request_json_in_png() -> None:
    wire = Wire()
    wire.send(subscribe(compression="png"))
    wire.send(publish("é" * 1000))
    (received,) = wire.received()
    assert received.keys() == {"op", "data"}
    assert json.loads(pixels(b64decode(received["data"]))) == publish("é" * 1000)
    wire.send(subscribe(compression="png", fragment_size=50, id="b"))
    text = Random(0).randbytes(1000).hex()
    wire.send(publish(text))
    joined = json.loads("".join(f["data"] for f in pieces(wire)))
    assert json.loads(pixels(b64decode(joined["data"]))) == publish(text)


def picture(size: int) -> dict[str, Any]:
    return publish(Random(1).randbytes(size).hex())


def test_messages_above_64_kb_are_sent_as_json() -> None:
    wire = Wire()
    wire.send(subscribe(compression="png"))
    wire.protocol.topics.monitor("/chatter", "std_msgs/String", lambda *_: None)
    for size, op in ((32_000, "png"), (33_000, "publish")):
        wire.send(picture(size))
        (received,) = wire.received()
        assert received["op"] == op
    assert received == picture(33_000)


def test_viewers_of_many_spellings_and_callers_together_are_packed_a_megabyte_a_second() -> None:
    limits = ClientLimits.unhurried()
    wire = Wire(clients=25, limits=limits)
    for client in range(25):
        topic = "/" * (client % 5) + "chatter" + "/" * (client // 5)
        wire.send(subscribe(topic=topic, compression="png"), client)
    packed = plain = 0
    for _ in range(30):
        wire.send(picture(16_000))
        wire.send({"op": "call_service", "service": "/no" * 5000, "compression": "png"})
        for client in range(25):
            for received in wire.received(client):
                text = pixels(b64decode(received["data"])) if received["op"] == "png" else b""
                packed += len(text)
                plain += received["op"] != "png"
        wire.wait(100)
    assert 2.5e6 <= packed <= 3.7e6
    assert plain > 600


@pytest.mark.parametrize("compression", ["none", "cbor", "cbor-raw"])
def test_message_is_encoded_once_for_all_spellings_of_its_topic(
    compression: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    encoded: list[Any] = []

    def count(method: type, name: str) -> None:
        original = getattr(method, name)

        def counting(*args: Any) -> Any:
            encoded.append(args)
            return original(*args)

        monkeypatch.setattr(method, name, counting)

    for method, name in ((Codec, "json_pieces"), (Codec, "cbor"), (RosSerializer, "bytes")):
        count(method, name)
    wire = Wire(clients=20)
    wire.send({"op": "advertise", **CHATTER})
    for client in range(20):
        topic = {**CHATTER, "topic": "/" * client + "chatter"}
        wire.send({"op": "subscribe", **topic, "compression": compression}, client)
    wire.send(publish("x"))
    topics = {wire.received(client)[-1]["topic"] for client in range(20)}
    assert topics == {"/" * client + "chatter" for client in range(20)}
    assert len(encoded) == 1
