"""Large frames are validated by the type of their payload before any object is built."""

from __future__ import annotations

import base64
import json
import tracemalloc
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from teleop.rosbridge.compat.rosapi import serve_rosapi
from teleop.rosbridge.errors import FrameError
from teleop.rosbridge.framing.large_frames import LARGE_FRAME, LargeFrameReader, PayloadField
from teleop.rosbridge.limits import ClientLimits
from teleop.rosbridge.messages.message_types import MessageType
from tests.teleop.rosbridge.support import (
    FORMS,
    PRIMITIVES,
    Wire,
    error,
    extreme,
    typed_messages,
)

MANY = 333_000
AXES = '{"op":"publish","topic":"/joy","msg":{"axes":%s}}'
TYPES = {
    "/joy": "sensor_msgs/Joy",
    "/path": "nav_msgs/Path",
    "/tf": "tf2_msgs/TFMessage",
    "/cloud": "sensor_msgs/PointCloud2",
    "/text": "std_msgs/String",
}


def reader_of(kind: MessageType) -> LargeFrameReader:
    """Return a reader of large messages of a type on topic ``/t``."""
    payload = PayloadField("topic", "msg", lambda name: kind if name == "/t" else None)
    return LargeFrameReader(FORMS, {"publish": payload})


def wire() -> Wire:
    """Return a wire without rate limits whose client has advertised topics."""
    wire = Wire(2, limits=ClientLimits(messages=1e9, bytes=1e12, frame=5_000_000))
    serve_rosapi(wire.protocol)
    for topic, kind in TYPES.items():
        wire.send({"op": "advertise", "topic": topic, "type": kind})
        wire.send({"op": "subscribe", "topic": topic, "compression": "cbor"}, 1)
    return wire


def plain(value: Any) -> Any:
    """Return a message for JSON, with bytes as base64 or as a list."""
    if isinstance(value, dict):
        return {name: plain(part) for name, part in value.items()}
    if isinstance(value, list):
        return [plain(part) for part in value]
    if isinstance(value, bytes):
        return base64.b64encode(value).decode() if len(value) % 2 else list(value)
    return value


@pytest.mark.slow
@settings(max_examples=200)
@given(typed_messages())
def test_valid_messages_of_all_types_pass_the_schema(typed: tuple[MessageType, Any]) -> None:
    kind, message = typed
    check_schema(kind, plain(message))


@pytest.mark.sweep
def test_extreme_messages_of_every_type_pass_the_schema() -> None:
    for name in FORMS:
        check_schema(FORMS[name], plain(extreme(FORMS[name])))


def check_schema(kind: MessageType, message: Any) -> None:
    frame = json.dumps({"op": "publish", "topic": "/t", "id": "publish:/t:1", "msg": message})
    assert reader_of(kind).read(frame) == json.loads(frame)
    assert reader_of(kind).read(frame.encode()) == json.loads(frame)


@settings(max_examples=100)
@given(st.sampled_from(PRIMITIVES), st.sampled_from(["one", "sequence", "array", "bounded"]))
def test_values_of_another_json_type_do_not_pass_the_schema(primitive: str, form: str) -> None:
    kind = FORMS[f"forms/{primitive.title()}"]
    value: Any = 1 if primitive in ("string", "bool") else True
    message = {form: value if form == "one" else [value]}
    frame = json.dumps({"op": "publish", "topic": "/t", "msg": message})
    with pytest.raises(FrameError, match=r"publish: Expected"):
        reader_of(kind).read(frame)


@pytest.mark.parametrize(
    ("garbage", "text"),
    [
        ("x" * 999_999, "must have in its first or last 1024 an op of"),
        ("[" * 999_999, "must have in its first or last 1024 an op of"),
        ("[" + "[]," * MANY + "[]]", "must have in its first or last 1024 an op of"),
        ('{"op":' + "1" * 999_000 + "}", "must have in its first or last 1024"),
        ('{"op":"no","msg":[' + "{}," * MANY + "{}]}", "an op of action_feedback"),
        ('{"op":"subscribe","topic":[' + "[]," * MANY + "[]]}", "an op of"),
        ('{"op":"publish","msg":[' + "[]," * MANY + "[]]}", "must have its topic in its first"),
        ('{"op":"publish","topic":"/no","msg":[' + "[]," * MANY + "[]]}", "unknown topic /no"),
        ('{"op":"publish","topic":"/joy","x":[' + "[]," * MANY + "]}", "unknown field `x`"),
        ('{"op":"publish","topic":"/joy","id":[' + "[]," * MANY + "]}", "got `array`"),
        (AXES % ("[" + "[]," * MANY + "[]]"), "got `array` - at `$.msg.axes[0]`"),
        (AXES % ('"' + "x" * 999_000 + '"'), "got `str` - at `$.msg.axes`"),
        (AXES % ("[" + "1" * 999_000 + "]"), "out of range"),
        (AXES % ("[" + "[" * 999_000), "got `array` - at `$.msg.axes[0]`"),
        (AXES.replace("axes", "x") % ("[" + "1," * 499_000 + "1]"), "unknown field `x`"),
        (AXES.replace("/joy", "/path") % ("[" + "[]," * MANY + "[]]"), "unknown field `axes`"),
        (
            AXES.replace("/joy", "/path").replace("axes", "poses") % ("[" + "{}," * MANY + "{}]"),
            "too many omitted",
        ),
        ("{}" * 499_000, "must have in its first or last 1024 an op of"),
        (" " * 999_999, "must have in its first or last 1024 an op of"),
        (np.random.default_rng(0).bytes(999_999), "must have in its first or last 1024"),
        (b"\xa1\x62op\x59\xff\xff" + bytes(999_000), "must have in its first or last 1024"),
    ],
    ids=lambda value: repr(value[:40]) if isinstance(value, bytes | str) else None,
)
def test_garbage_is_rejected_before_objects_are_built(garbage: str | bytes, text: str) -> None:
    there = wire()
    there.raw(garbage[: LARGE_FRAME + 10])  # fills the caches
    there.received()
    tracemalloc.start()
    there.raw(garbage)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    (said,) = there.received()
    assert text in said["msg"]
    # A megabyte of one string or number is one object; the others would be hundreds of thousands.
    one = '"axes":["1' in str(garbage)[:60] or '"axes":"' in str(garbage)[:60]
    assert most < (2_100_000 if one else 100_000)


def test_large_messages_of_all_types_arrive() -> None:
    there = wire()
    pose = {"position": {"x": 1.25, "y": 2.5, "z": 0.0}, "orientation": {"x": 0.0, "w": 1.0}}
    header = {"stamp": {"secs": 1, "nsecs": 2}, "seq": 4, "frame_id": "map"}
    numbers = np.random.default_rng(0).integers(0, 256, 30_000).tolist()
    for topic, message in (
        ("/path", {"header": {"stamp": "now"}, "poses": [{"header": header, "pose": pose}] * 500}),
        ("/tf", {"transforms": [{"header": header, "child_frame_id": "a"}] * 500}),
        ("/cloud", {"width": 1, "data": numbers}),
        ("/cloud", {"width": 1, "data": base64.b64encode(bytes(numbers)).decode()}),
        ("/text", {"data": "[[]," * 100_000}),
    ):
        operation = {"op": "publish", "id": "publish:1", "topic": topic, "msg": message}
        for frame in (
            json.dumps({**operation, "latch": False}),
            json.dumps(dict(reversed(operation.items()))).encode(),  # ROS# has op last
        ):
            assert len(frame) > LARGE_FRAME
            there.raw(frame)
            (received,) = there.received(1)
            assert received["topic"] == topic
            assert set(message) <= set(received["msg"])
        assert there.received() == []


def test_large_call_arguments_may_be_named_or_positional() -> None:
    there = wire()
    value = json.dumps("y" * 20_000)
    for args in ({"name": "/n", "value": value}, ["/n", value]):
        call = {"op": "call_service", "service": "/rosapi/set_param", "args": args, "id": "c"}
        (answer,) = there.ask(call)
        assert answer["result"] is True, answer


def test_large_responses_and_errors_of_clients_arrive() -> None:
    there = wire()
    service = {"service": "/big", "type": "std_srvs/Trigger"}
    there.send({"op": "advertise_service", **service}, 1)
    for values, good, received in (
        ({"success": True, "message": "m" * 20_000}, True, "{'success': True, 'message': 'mmm"),
        ("e" * 20_000, False, "Service /big failed: eee"),
    ):
        there.send({"op": "call_service", "service": "/big", "id": "c"})
        (request,) = there.received(1)
        response = {"op": "service_response", "service": "/big", "id": request["id"]}
        there.send({**response, "values": values, "result": good}, 1)
        (answer,) = there.received()
        assert answer["result"] is good
        assert str(answer["values"]).startswith(received)


def test_duplicate_topic_field_is_rejected() -> None:
    there = wire()
    twice = '{"op":"publish","topic":"/text","msg":{"data":"%s"},"topic":"/joy"}'
    there.raw(twice % ("x" * LARGE_FRAME))
    assert there.received() == [error("publish: duplicate field topic")]


def test_large_fragments_are_accepted_and_their_message_is_validated() -> None:
    there = wire()
    whole = json.dumps({"op": "publish", "topic": "/text", "msg": {"data": "x" * 50_000}})
    for num, data in enumerate((whole[:30_000], whole[30_000:])):
        there.send({"op": "fragment", "id": "f", "num": num, "total": 2, "data": data})
    assert len(there.received(1)) == 1
    for num, data in enumerate(("[" * 20_000, "[" * 20_000)):
        there.send({"op": "fragment", "id": "g", "num": num, "total": 2, "data": data})
    (said,) = there.received()
    assert "must have in its first or last 1024" in said["msg"]


def test_frames_may_contain_at_most_sixteen_operations() -> None:
    there = Wire(limits=ClientLimits.unhurried())
    there.raw('{"op":"status"}' * 16)
    assert there.received() == []
    there.raw('{"op":"status"}' * 17)
    assert there.received() == [error("a frame may contain at most 16 operations")]


def test_unpaired_surrogates_and_trailing_operations_in_large_frames_are_rejected() -> None:
    reader = reader_of(FORMS["std_msgs/String"])
    fill = "x" * LARGE_FRAME
    frame = '{"op":"publish","topic":"/t","msg":{"data":"' + fill
    assert reader.read(frame + '"}}')["msg"] == {"data": fill}
    for end in ('\\ud800"}}', '"}}{"op":"publish"}'):
        with pytest.raises(FrameError, match="not JSON"):
            reader.read(frame + end)


def test_messages_with_too_many_omitted_fields_are_rejected() -> None:
    there = wire()
    path = {"op": "publish", "topic": "/path"}
    there.send({**path, "msg": {"poses": [{}] * 400}})
    assert there.received() == []
    there.send({**path, "msg": {"poses": [{"pose": {"position": {"x": 1.0}}}] * 3000}})
    assert there.received() == []
    all_poses: list[list[Any]] = [[{}] * 300_000, [{"pose": {}}] * 80_000, [{}] * 5000]
    for poses in all_poses:
        there.send({**path, "msg": {"poses": poses}})
        (said,) = there.received()
        assert "too many omitted fields" in said["msg"]
