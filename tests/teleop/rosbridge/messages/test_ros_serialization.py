"""Messages in the serialisations of ROS 1 and ROS 2."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from teleop.rosbridge.messages.message_defaults import DTYPES
from teleop.rosbridge.messages.message_types import Field, MessageType
from teleop.rosbridge.messages.ros_serialization import RosSerializer, RosVersion
from tests.teleop.rosbridge.support import (
    FORM_NAMES,
    FORMS,
    Wire,
    extreme,
    publish,
    subscribe,
    typed_messages,
    whole,
)


@pytest.mark.parametrize(
    ("kind", "ros_version", "expected"),
    [
        ("std_msgs/String", "ros2", b"\x00\x01\x00\x00\x03\x00\x00\x00\xc3\xa9\x00"),
        ("std_msgs/String", "ros1", b"\x02\x00\x00\x00\xc3\xa9"),
        ("std_msgs/msg/String", "ros1", b"\x00\x01\x00\x00\x03\x00\x00\x00\xc3\xa9\x00"),
    ],
)
def test_cbor_raw_contains_the_serialization_of_the_requested_ros(
    kind: str, ros_version: Any, expected: bytes
) -> None:
    wire = Wire(ros_version=ros_version)
    wire.send(subscribe(kind=kind, compression="cbor-raw"))
    wire.now += 7
    wire.send(publish("é"))
    (received,) = wire.received()
    message = {"secs": 1, "nsecs": 7, "bytes": expected}
    assert received == {"op": "publish", "topic": "/chatter", "msg": message}


def test_highest_priority_encoding_is_used() -> None:
    wire = Wire()
    for i, compression in enumerate(("none", "png", "cbor", "cbor-raw")):
        wire.send(subscribe(compression=compression, id=i))
        wire.send(publish("x"))
    assert [output.binary for output in wire.outputs()] == [False, False, True, True]


SERIALIZERS: dict[RosVersion, RosSerializer] = {
    "ros1": RosSerializer(FORMS, "ros1"),
    "ros2": RosSerializer(FORMS, "ros2"),
}


@cache
def reader(kind: str, ros_version: RosVersion) -> Typestore:
    """Return a type store built from the definition text that clients receive."""
    text = SERIALIZERS[ros_version].definition(FORMS[kind])
    found = get_types_from_msg(text or "\n", kind)
    store = get_typestore(Stores.EMPTY)
    store.register({name: d for name, d in found.items() if name not in store.fielddefs})
    return store


def agrees(kind: MessageType, message: Any, read: Any) -> bool:
    """Return whether a message was read as it was written."""
    return all(
        alike(field, message[field.name], getattr(read, field.name)) for field in kind.fields
    )


def alike(field: Field, wrote: Any, read: Any) -> bool:
    if field.nested:
        kind, many = FORMS[field.kind], field.repeated
        pairs = zip(wrote, read, strict=True) if many else [(wrote, read)]
        return all(agrees(kind, *pair) for pair in pairs)
    if field.kind == "string":
        return bool(wrote == read)
    if field.kind == "bool":
        return np.array_equal(np.asarray(wrote, bool), np.asarray(read, bool))
    dtype = DTYPES[field.kind]
    one = np.frombuffer(wrote, dtype) if isinstance(wrote, bytes) else np.asarray(wrote, dtype)
    other = np.asarray(read).astype(dtype)  # bytes of ROS 1 are signed
    return np.array_equal(one, other, equal_nan=dtype.kind == "f")


@settings(max_examples=30)
@given(typed_messages(finite=False))
def test_serialized_messages_of_all_types_are_read_by_their_definition(
    typed: tuple[MessageType, Any],
) -> None:
    kind, partial = typed
    check_serialization(kind, whole(kind, partial))


def test_extreme_messages_with_fields_of_each_form_are_read_by_their_definition() -> None:
    for name in FORM_NAMES:
        check_serialization(FORMS[name], whole(name, extreme(FORMS[name])))


def check_serialization(kind: MessageType, message: Any) -> None:
    for ros_version, serializer in SERIALIZERS.items():
        data, store = serializer.bytes(kind, message), reader(kind.name, ros_version)
        read = store.deserialize_ros1 if ros_version == "ros1" else store.deserialize_cdr
        assert agrees(kind, message, read(data, kind.name))


@pytest.mark.parametrize("store", [Stores.ROS2_JAZZY, Stores.ROS1_NOETIC])
@pytest.mark.parametrize("kind", ["sensor_msgs/msg/PointCloud2", "nav_msgs/msg/Odometry"])
def test_serialization_is_that_of_ros(store: Stores, kind: str) -> None:
    ros_version: RosVersion = "ros2" if store is Stores.ROS2_JAZZY else "ros1"
    raw = SERIALIZERS[ros_version].bytes(FORMS[kind], whole(kind, {"header": {"frame_id": "é"}}))
    ros = get_typestore(store)
    if ros_version == "ros1":
        assert bytes(ros.serialize_ros1(ros.deserialize_ros1(raw, kind), kind)) == raw
    else:
        assert bytes(ros.serialize_cdr(ros.deserialize_cdr(raw, kind), kind)) == raw


def test_ros_1_definitions_have_no_bounds_and_ros_2_pads_empty_types() -> None:
    bounded, constant = FORMS["shape_msgs/SolidPrimitive"], FORMS["bond/Constants"]
    assert "float64[<=3] dimensions" in SERIALIZERS["ros2"].definition(bounded)
    assert "float64[] dimensions" in SERIALIZERS["ros1"].definition(bounded)
    assert (
        SERIALIZERS["ros2"]
        .definition(constant)
        .endswith("uint8 structure_needs_at_least_one_member\n")
    )
    assert "structure" not in SERIALIZERS["ros1"].definition(constant)
