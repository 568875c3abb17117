"""Messages in PNG images."""

from __future__ import annotations

import json
from base64 import b64decode
from io import BytesIO
from random import Random
from typing import Any

from hypothesis import given, strategies as st
from PIL import Image

from teleop.rosbridge.framing.png_compression import encode_png
from tests.teleop.rosbridge.framing.test_fragments import pieces
from tests.teleop.rosbridge.support import Wire

TEXT = {"topic": "/text", "type": "std_msgs/String"}


def publish(data: str) -> dict[str, Any]:
    return {"op": "publish", "topic": "/text", "msg": {"data": data}}


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
    wire.send({"op": "subscribe", **TEXT, "compression": "png"})
    wire.send(publish("é" * 1000))
    (received,) = wire.received()
    assert received.keys() == {"op", "data"}
    assert json.loads(pixels(b64decode(received["data"]))) == publish("é" * 1000)
    wire.send({"op": "subscribe", **TEXT, "compression": "png", "fragment_size": 50, "id": "b"})
    text = Random(0).randbytes(1000).hex()
    wire.send(publish(text))
    joined = json.loads("".join(f["data"] for f in pieces(wire)))
    assert json.loads(pixels(b64decode(joined["data"]))) == publish(text)
