from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from teleop.rosbridge.errors import MessageError
from teleop.rosbridge.messages.message_completion import complete
from tests.teleop.rosbridge.support import REGISTRY, SECOND

BLOB = {"header": {}, "format": "jpeg", "data": b"\x00\xff"}


def refusal(kind: str, partial: object) -> str:
    with pytest.raises(MessageError) as caught:
        complete(REGISTRY, kind, partial)
    return str(caught.value)


def test_omitted_fields_have_typed_defaults() -> None:
    odometry = complete(REGISTRY, "nav_msgs/Odometry", {"child_frame_id": "base_link"})
    assert odometry["child_frame_id"] == "base_link"
    assert odometry["header"] == {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}
    assert odometry["pose"]["covariance"].tolist() == [0.0] * 36
    assert odometry["pose"]["pose"]["orientation"]["w"] == 1.0


@pytest.mark.parametrize(
    ("kind", "partial", "text"),
    [
        (
            "std_msgs/String",
            {"dat": "x"},
            "Message type std_msgs/String does not have a field dat",
        ),
        (
            "std_msgs/String",
            {"data": 1},
            "std_msgs/String message requires a string for field data, but got a <class 'int'>",
        ),
        (
            "geometry_msgs/Twist",
            {"linear": {"x": "fast"}},
            "geometry_msgs/Twist message requires a float64 for field linear.x, "
            "but got a <class 'str'>",
        ),
        (
            "geometry_msgs/Twist",
            {"linear": {"w": 1}},
            "Message type geometry_msgs/Twist does not have a field linear.w",
        ),
        (
            "std_msgs/UInt8",
            {"data": 300},
            "std_msgs/UInt8 message requires a uint8 for field data, but got one out of range",
        ),
        (
            "sensor_msgs/Joy",
            {"buttons": [1, 0.5]},
            "sensor_msgs/Joy message requires a int32 for field buttons[1], "
            "but got a <class 'float'>",
        ),
        (
            "sensor_msgs/Joy",
            [],
            "sensor_msgs/Joy message requires a sensor_msgs/Joy, but got a <class 'list'>",
        ),
    ],
)
def test_misfits_are_rejected_with_the_texts_of_rosbridge(
    kind: str, partial: object, text: str
) -> None:
    assert refusal(kind, partial) == text


@pytest.mark.parametrize(
    ("kind", "data"),
    [
        ("Int32", 1.0),
        ("Int32", True),
        ("Int32", "1"),
        ("Int32", 2**31),
        ("Int64", -(2**63) - 1),
        ("UInt8", -1),
        ("Float64", None),
        ("Float64", True),
        ("Float64", math.nan),
        ("Float64", math.inf),
        ("Float64", 10**400),
        ("Float32", 1e39),
        ("Bool", 1),
        ("String", None),
        ("String", b"abc"),
        ("String", "\ud800"),
        ("Float32MultiArray", [1e39]),
        ("Float64MultiArray", [math.nan]),
        ("Float64MultiArray", [10**400]),
        ("Float64MultiArray", [[1.0]]),
        ("Float64MultiArray", [True]),
        ("Float64MultiArray", 1.0),
        ("Float64MultiArray", "AAAA"),
        ("Int64MultiArray", [2**63]),
        ("UInt8MultiArray", [256]),
        ("UInt8MultiArray", "no base64!"),
        ("UInt8MultiArray", "AAA"),
        ("UInt8MultiArray", None),
    ],
)
def test_values_of_wrong_type_or_out_of_range_are_rejected(kind: str, data: object) -> None:
    assert "data" in refusal(f"std_msgs/{kind}", {"data": data})


NOW = {"sec": 5, "nanosec": 7}
ZERO = {"sec": 0, "nanosec": 0}


@pytest.mark.parametrize(
    ("header", "stamp"),
    [
        ({"stamp": NOW}, NOW),
        ({"stamp": {"secs": 5, "nsecs": 7}}, NOW),
        ({"stamp": {**NOW, "secs": 5, "nsecs": 7}}, NOW),
        ({"stamp": "now"}, NOW),
        ({}, NOW),
        ({"seq": 7}, NOW),
        ({"stamp": {"secs": 0, "nsecs": 0}}, ZERO),
        (None, ZERO),
    ],
)
def test_a_header_has_the_stamp_that_it_gives_or_that_of_now(header: Any, stamp: object) -> None:
    partial = {} if header is None else {"header": header}
    joy = complete(REGISTRY, "sensor_msgs/Joy", partial, now=5 * SECOND + 7)
    assert joy["header"] == {"stamp": stamp, "frame_id": ""}
    assert "now" in refusal("std_msgs/Header", {"stamp": "now"})


@pytest.mark.parametrize(
    ("kind", "data"),
    [("Float64", 1), ("Float64", 1e308), ("String", "YWJj"), ("UInt64", 2**64 - 1)],
)
def test_values_that_fit_are_taken_as_their_type(kind: str, data: object) -> None:
    value = complete(REGISTRY, f"std_msgs/{kind}", {"data": data})["data"]
    wanted = {"Float64": float, "String": str, "UInt64": int}[kind]
    assert (value, type(value)) == (data, wanted)


@pytest.mark.parametrize("data", [b"\x00\xff", "AP8=", [0, 255], bytearray(b"\x00\xff")])
def test_bytes_may_be_base64_or_a_list(data: object) -> None:
    image = complete(REGISTRY, "sensor_msgs/CompressedImage", {**BLOB, "data": data})
    assert image["data"] == b"\x00\xff"


@pytest.mark.parametrize("size", [0, 35, 37])
def test_fixed_arrays_must_have_their_size(size: int) -> None:
    text = refusal("geometry_msgs/PoseWithCovariance", {"covariance": [0.0] * size})
    assert "36 elements" in text


def test_numpy_arrays_are_accepted_if_their_values_fit() -> None:
    joy = complete(REGISTRY, "sensor_msgs/Joy", {"axes": np.array([0.5]), "buttons": np.array([1])})
    assert joy["axes"].dtype == np.float32
    assert joy["buttons"].dtype == np.int32
    assert "buttons" in refusal("sensor_msgs/Joy", {"buttons": np.array([2**40])})
