"""Messages in pieces, in pictures and in ROS's own bytes."""

from __future__ import annotations

import json
import struct
from base64 import b64decode
from functools import cache
from io import BytesIO
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from PIL import Image
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from teleop.rosbridge.framing.fragments import split_message
from teleop.rosbridge.framing.png_compression import encode_png
from teleop.rosbridge.limits import ClientLimits
from teleop.rosbridge.messages.message_defaults import DTYPES
from teleop.rosbridge.messages.message_types import Field, MessageType
from teleop.rosbridge.messages.ros_serialization import RosSerializer, RosVersion
from tests.teleop.rosbridge.support import REGISTRY, SECOND, Wire, error, messages, whole

TEXT = {"topic": "/text", "type": "std_msgs/String"}


def publish(data: str) -> dict[str, Any]:
    return {"op": "publish", "topic": "/text", "msg": {"data": data}}


def pixels(png: bytes) -> bytes:
    """Return the bytes of an RGB image."""
    with Image.open(BytesIO(png)) as image:
        assert (image.format, image.mode) == ("PNG", "RGB")
        return image.tobytes()


# Fragments that leave


def pieces(wire: Wire, client: int = 0) -> list[Any]:
    return [json.loads(f) for output in wire.outputs(client) for f in output.frames]


@pytest.mark.parametrize("size", [10, 100, 1000])
def test_a_message_larger_than_asked_for_comes_in_fragments(size: int) -> None:
    wire = Wire()
    wire.send({"op": "subscribe", **TEXT, "fragment_size": size})
    wire.send(publish('"é\n' * 100))
    heard = pieces(wire)
    if size == 1000:  # of its 935 bytes
        assert heard == [publish('"é\n' * 100)] or len(heard) == 2
        return
    assert {f["op"] for f in heard} == {"fragment"}
    assert {f["id"] for f in heard} == {"fragment:1"}
    assert [f["num"] for f in heard] == list(range(len(heard)))
    assert {f["total"] for f in heard} == {len(heard)}
    assert all(type(f["total"]) is int and len(f["data"]) <= size for f in heard)
    assert json.loads("".join(f["data"] for f in heard)) == publish('"é\n' * 100)


@pytest.mark.parametrize("size", [None, 0, 2**31 - 1, 2**31, 1e12, 100_000])
def test_nobody_who_did_not_ask_gets_fragments(size: object) -> None:
    wire = Wire()
    wire.send({"op": "subscribe", **TEXT, "fragment_size": size})
    wire.send(publish("x" * 1000))
    assert pieces(wire) == [publish("x" * 1000)]


def test_binary_messages_are_never_cut() -> None:
    wire = Wire()
    wire.send({"op": "subscribe", **TEXT, "fragment_size": 10, "compression": "cbor"})
    wire.send(publish("x" * 1000))
    (output,) = wire.outputs()
    assert list(output.frames) == [output.payload]


def test_each_message_in_fragments_has_an_id_of_its_own_and_the_smallest_size_counts() -> None:
    wire = Wire(clients=2)
    wire.send({"op": "subscribe", **TEXT, "fragment_size": 500, "id": "a"})
    wire.send({"op": "subscribe", **TEXT, "fragment_size": 50, "id": "b"})
    wire.send({"op": "subscribe", **TEXT}, 1)
    for _ in range(2):
        wire.send(publish("x" * 80))
    heard = pieces(wire)
    assert [f["id"] for f in heard] == ["fragment:1"] * 3 + ["fragment:2"] * 3
    assert pieces(wire, 1) == [publish("x" * 80)] * 2


def test_an_answer_comes_in_fragments_too() -> None:
    wire = Wire()
    wire.send({"op": "call_service", "service": "/nope", "fragment_size": 20, "id": 1})
    whole = json.loads("".join(f["data"] for f in pieces(wire)))
    assert (whole["op"], whole["id"]) == ("service_response", 1)


@given(st.binary(min_size=1, max_size=5000).map(bytes.hex), st.integers(1, 3000))
def test_pieces_are_the_whole_and_not_too_many(text: str, size: int) -> None:
    parts = [json.loads(part) for part in split_message(text.encode(), size, "i")]
    assert "".join(part["data"] for part in parts) == text
    assert len(parts) == parts[0]["total"] <= 1024


# Fragments that come


def fragments(operation: object, count: int, identity: object = "f") -> list[dict[str, Any]]:
    text = json.dumps(operation)
    size = -(-len(text) // count)
    return [
        {
            "op": "fragment",
            "id": identity,
            "num": i,
            "total": count,
            "data": text[i * size : (i + 1) * size],
        }
        for i in range(count)
    ]


CALL = {"op": "call_service", "service": "/nope", "id": "c", "args": {"text": "é" * 50}}


@settings(max_examples=30)
@given(st.permutations(range(7)), st.permutations(range(7)))
def test_fragments_are_joined_by_number_in_whatever_order_they_come(
    first: list[int], second: list[int]
) -> None:
    wire = Wire()
    one, two = fragments(CALL, 7, "one"), fragments({**CALL, "id": "d"}, 7, 2)
    for i, j in zip(first, second, strict=True):
        wire.send(one[i])
        wire.send(one[i])  # again, as after a stall
        wire.send(two[j])
    assert sorted(answer["id"] for answer in wire.heard() if answer["op"] != "status") == ["c", "d"]


def test_fragments_of_different_clients_do_not_meet() -> None:
    wire = Wire(clients=2)
    parts = fragments(CALL, 2)
    wire.send(parts[0], 0)
    wire.send(parts[1], 1)
    assert wire.heard(0) == wire.heard(1) == []


def test_fragments_without_their_rest_are_forgotten_after_ten_seconds() -> None:
    wire = Wire()
    wire.send(fragments(CALL, 2)[0])
    assert wire.protocol.timers.due == wire.now + 10 * SECOND
    wire.wait(10_000)
    text = "fragment: message incomplete after 10 s"
    assert wire.heard() == [error(text, "f")]
    assert wire.ask(fragments(CALL, 2)[1]) == []
    assert wire.protocol.timers.due == wire.now + 10 * SECOND


def test_who_left_is_told_nothing_of_its_fragments() -> None:
    wire = Wire()
    wire.send(fragments(CALL, 2)[0])
    wire.protocol.disconnect(wire.clients[0], wire.now)
    wire.wait(10_000)
    assert wire.protocol.connections.drain() == []


def test_who_leaves_takes_its_fragments_along_before_their_time_is_over() -> None:
    wire = Wire()
    (connection,) = wire.protocol.connections
    wire.send(fragments(publish("x" * 1000), 2)[0])
    assert "f" in connection.reassembly
    wire.protocol.disconnect(wire.clients[0], wire.now)
    assert "f" not in connection.reassembly  # though a timer still knows the connection


def test_fragments_that_wait_are_bounded_in_bytes_and_number() -> None:
    wire = Wire(limits=ClientLimits(assembly=100))
    piece = {"op": "fragment", "id": "f", "num": 0, "total": 3, "data": "x" * 60}
    wire.send(piece)
    (status,) = wire.ask({**piece, "num": 1})
    assert "exceed 100 bytes" in status["msg"]
    for i in range(8):
        assert wire.ask({**piece, "id": i, "data": "x"}) == []
    (status,) = wire.ask({**piece, "id": 8, "data": "x"})
    assert "at most 8 messages may be incomplete" in status["msg"]


def test_operations_in_fragments_are_counted_like_others() -> None:
    wire = Wire(limits=ClientLimits(messages=10, burst=1))
    calls = '{"op":"call_service","service":"/nope"}' * 15
    wire.send({"op": "fragment", "num": 0, "total": 1, "data": calls, "id": 1})
    heard = wire.heard()
    assert [h["op"] for h in heard] == ["service_response"] * 10 + ["status"]
    assert heard[-1] == error("rate limit of 10 operations/s exceeded: operation dropped")


def test_a_message_does_not_change_its_number_of_pieces() -> None:
    wire = Wire()
    piece = {"op": "fragment", "id": "f", "num": 0, "total": 3, "data": "x"}
    wire.send(piece)
    (status,) = wire.ask({**piece, "num": 1, "total": 4})
    assert "total was 3 before, got 4" in status["msg"]


@pytest.mark.parametrize("inner", [fragments(CALL, 1)[0], [1], "x"])
def test_what_fragments_join_to_must_be_an_operation(inner: object) -> None:
    wire = Wire()
    for part in fragments(inner, 3 if isinstance(inner, dict) else 1):
        wire.send(part)
    (status,) = wire.heard()
    assert status["level"] == "error"


# Pictures


@given(st.binary(min_size=1, max_size=3000))
def test_a_picture_holds_its_text_and_line_feeds_behind_it(text: bytes) -> None:
    read = pixels(encode_png(text))
    assert read.startswith(text)
    assert not read[len(text) :].strip(b"\n")
    assert len(read) - len(text) < 3 * (len(text) ** 0.5 + 2)


def test_a_subscriber_may_have_its_json_in_pictures() -> None:
    wire = Wire()
    wire.send({"op": "subscribe", **TEXT, "compression": "png"})
    wire.send(publish("é" * 1000))
    (heard,) = wire.heard()
    assert heard.keys() == {"op", "data"}
    assert json.loads(pixels(b64decode(heard["data"]))) == publish("é" * 1000)
    wire.send({"op": "subscribe", **TEXT, "compression": "png", "fragment_size": 50, "id": "b"})
    wire.send(publish("x" * 1000))
    joined = json.loads("".join(f["data"] for f in pieces(wire)))
    assert json.loads(pixels(b64decode(joined["data"]))) == publish("x" * 1000)


# ROS's own bytes


@pytest.mark.parametrize(
    ("kind", "flavour", "expected"),
    [
        ("std_msgs/String", "ros2", b"\x00\x01\x00\x00\x03\x00\x00\x00\xc3\xa9\x00"),
        ("std_msgs/String", "ros1", b"\x02\x00\x00\x00\xc3\xa9"),
        ("std_msgs/msg/String", "ros1", b"\x00\x01\x00\x00\x03\x00\x00\x00\xc3\xa9\x00"),
    ],
)
def test_cbor_raw_brings_the_bytes_of_the_ros_that_is_spoken(
    kind: str, flavour: Any, expected: bytes
) -> None:
    wire = Wire(ros_version=flavour)
    wire.send({"op": "subscribe", "topic": "/text", "type": kind, "compression": "cbor-raw"})
    wire.now += 7
    wire.send(publish("é"))
    (heard,) = wire.heard()
    message = {"secs": 1, "nsecs": 7, "bytes": expected}
    assert heard == {"op": "publish", "topic": "/text", "msg": message}


def test_of_several_codings_the_densest_counts() -> None:
    wire = Wire()
    for i, compression in enumerate(("none", "png", "cbor", "cbor-raw")):
        wire.send({"op": "subscribe", **TEXT, "compression": compression, "id": i})
        wire.send(publish("x"))
    assert [output.binary for output in wire.outputs()] == [False, False, True, True]


KINDS = sorted(REGISTRY)


CODECS: dict[RosVersion, RosSerializer] = {
    "ros1": RosSerializer(REGISTRY, "ros1"),
    "ros2": RosSerializer(REGISTRY, "ros2"),
}


@cache
def reader(kind: str, flavour: RosVersion) -> Typestore:
    """Types that are known from nothing but the text that clients get of them."""
    text = CODECS[flavour].definition(REGISTRY[kind])
    found = get_types_from_msg(text or "\n", kind)
    store = get_typestore(Stores.EMPTY)
    store.register({name: d for name, d in found.items() if name not in store.fielddefs})
    return store


def agrees(kind: MessageType, message: Any, read: Any) -> bool:
    """Whether a message was read as it was written."""
    return all(
        alike(field, message[field.name], getattr(read, field.name)) for field in kind.fields
    )


def alike(field: Field, wrote: Any, read: Any) -> bool:
    if field.nested:
        kind, many = REGISTRY[field.kind], field.repeated
        pairs = zip(wrote, read, strict=True) if many else [(wrote, read)]
        return all(agrees(kind, *pair) for pair in pairs)
    if field.kind == "string":
        return bool(wrote == read)
    if field.kind == "bool":
        return np.array_equal(np.asarray(wrote, bool), np.asarray(read, bool))
    dtype = DTYPES[field.kind]
    one = np.frombuffer(wrote, dtype) if isinstance(wrote, bytes) else np.asarray(wrote, dtype)
    other = np.asarray(read).astype(dtype)  # a byte of ROS 1 has a sign
    return np.array_equal(one, other, equal_nan=dtype.kind == "f")


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=2)
@given(data=st.data())
def test_a_messages_bytes_are_read_back_by_who_has_only_its_definition(
    kind: str, data: st.DataObject
) -> None:
    message = whole(kind, data.draw(messages(kind, finite=False)))
    for flavour, codec in CODECS.items():
        raw, store = codec.bytes(REGISTRY[kind], message), reader(kind, flavour)
        read = store.deserialize_ros1 if flavour == "ros1" else store.deserialize_cdr
        assert agrees(REGISTRY[kind], message, read(raw, kind))


@pytest.mark.parametrize("store", [Stores.ROS2_JAZZY, Stores.ROS1_NOETIC])
@pytest.mark.parametrize("kind", ["sensor_msgs/msg/PointCloud2", "nav_msgs/msg/Odometry"])
def test_ros_itself_writes_the_same_bytes(store: Stores, kind: str) -> None:
    flavour: RosVersion = "ros2" if store is Stores.ROS2_JAZZY else "ros1"
    raw = CODECS[flavour].bytes(REGISTRY[kind], whole(kind, {"header": {"frame_id": "é"}}))
    ros = get_typestore(store)
    if flavour == "ros1":
        assert bytes(ros.serialize_ros1(ros.deserialize_ros1(raw, kind), kind)) == raw
    else:
        assert bytes(ros.serialize_cdr(ros.deserialize_cdr(raw, kind), kind)) == raw


def test_ros_1_has_no_bounds_and_ros_2_has_a_field_in_types_of_constants() -> None:
    bounded, constant = REGISTRY["shape_msgs/SolidPrimitive"], REGISTRY["bond/Constants"]
    assert "float64[<=3] dimensions" in CODECS["ros2"].definition(bounded)
    assert "float64[] dimensions" in CODECS["ros1"].definition(bounded)
    assert (
        CODECS["ros2"].definition(constant).endswith("uint8 structure_needs_at_least_one_member\n")
    )
    assert "structure" not in CODECS["ros1"].definition(constant)


def test_a_header_of_ros_1_has_a_sequence_number() -> None:
    raw = RosSerializer(REGISTRY, "ros1").bytes(
        REGISTRY["std_msgs/Header"], {"stamp": {"sec": 1, "nanosec": 2}, "frame_id": "a"}
    )
    assert raw == struct.pack("<IIII", 0, 1, 2, 1) + b"a"


# Qualities of service


def test_a_transient_publishers_last_message_waits_unless_the_subscriber_is_volatile() -> None:
    wire = Wire(clients=3)
    wire.send({"op": "advertise", **TEXT, "qos": {"durability": "transient_local"}}, 0)
    wire.send(publish("x"), 0)
    wire.send({"op": "subscribe", **TEXT}, 1)
    wire.send({"op": "subscribe", **TEXT, "qos": {"durability": "volatile"}}, 2)
    assert wire.heard(1) == [publish("x")]
    assert wire.heard(2) == []


@pytest.mark.parametrize(
    ("qos", "depth"),
    [({}, 4), ({"depth": 2}, 2), ({"depth": 2, "history": "keep_all"}, 0), (None, 4)],
)
def test_the_depth_of_a_qos_is_the_length_of_the_queue(qos: object, depth: int) -> None:
    wire = Wire()
    wire.send({"op": "subscribe", **TEXT, "queue_length": 4, "qos": qos})
    wire.send(publish("x"))
    assert [output.depth for output in wire.outputs()] == [depth]
