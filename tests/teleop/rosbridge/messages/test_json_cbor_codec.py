from __future__ import annotations

import base64
import contextlib
import json
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from teleop.rosbridge.errors import FrameError, MessageError
from teleop.rosbridge.messages.cbor import read_cbor, write_cbor
from teleop.rosbridge.messages.json_cbor_codec import Codec
from teleop.rosbridge.messages.message_completion import complete
from teleop.rosbridge.messages.message_types import MessageType
from tests.teleop.rosbridge.support import FORMS, extreme, typed_messages, whole

CODEC = Codec(FORMS)


def same(a: Any, b: Any) -> bool:
    """Return whether two messages are equal, with NaN equal to NaN."""
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and np.array_equal(a, b, equal_nan=a.dtype.kind == "f")
    if isinstance(a, list):
        return len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, float) and math.isnan(a):
        return math.isnan(b)
    return type(a) is type(b) and bool(a == b)


@pytest.mark.slow
@settings(max_examples=200)
@given(typed_messages())
def test_json_round_trip_preserves_messages_of_all_types(typed: tuple[MessageType, Any]) -> None:
    kind, partial = typed
    message = whole(kind, partial)
    text = CODEC.json(kind, message)
    assert text.isascii()
    assert same(complete(FORMS, kind, json.loads(text)), message)


@settings(max_examples=200)
@given(typed_messages(finite=False))
def test_cbor_round_trip_preserves_messages_of_all_types(typed: tuple[MessageType, Any]) -> None:
    kind, partial = typed
    message = whole(kind, partial)
    read = read_cbor(write_cbor(CODEC.cbor(kind, message)))
    assert same(complete(FORMS, kind, read, finite=False), message)


@pytest.mark.sweep
def test_every_type_round_trips_through_json_and_cbor() -> None:
    for name in FORMS:
        kind, message = FORMS[name], whole(name, extreme(FORMS[name]))
        assert same(complete(FORMS, kind, json.loads(CODEC.json(kind, message))), message)
        read = read_cbor(write_cbor(CODEC.cbor(kind, message)))
        assert same(complete(FORMS, kind, read), message)


@given(values=st.lists(st.floats(width=32, allow_nan=False, allow_infinity=False), max_size=50))
def test_float32_values_are_written_short_but_exact(values: list[float]) -> None:
    text = CODEC.json(FORMS["sensor_msgs/LaserScan"], {"ranges": values})
    assert json.loads(text)["ranges"] == pytest.approx(values, rel=1e-7)
    assert np.array_equal(
        np.array(json.loads(text)["ranges"], np.float32), np.array(values, np.float32)
    )


def test_scans_are_written_with_significant_digits_only() -> None:
    ranges = np.linspace(0.1, 29.9, 1000).astype(np.float32)
    text = CODEC.json(FORMS["sensor_msgs/LaserScan"], {"ranges": ranges})
    assert len(text) < 13 * 1000


def test_json_is_compact_ascii_with_fields_in_the_order_of_the_type() -> None:
    text = CODEC.json(FORMS["std_msgs/Header"], {"frame_id": "é"})
    assert text == ('{"stamp":{"sec":0,"nanosec":0,"secs":0,"nsecs":0},"frame_id":"\\u00e9"}')


@pytest.mark.parametrize("blob", [bytes(range(256)), memoryview(bytes(256)), np.zeros(9, np.uint8)])
def test_bytes_are_base64_in_json_and_a_byte_string_in_cbor(blob: Any) -> None:
    kind, message = FORMS["sensor_msgs/CompressedImage"], {"data": blob}
    assert json.loads(CODEC.json(kind, message))["data"] == base64.b64encode(blob).decode()
    assert read_cbor(write_cbor(CODEC.cbor(kind, message)))["data"] == bytes(blob)


@pytest.mark.parametrize(
    ("kind", "values", "encoded"),
    [
        ("UInt16", [1, 2], "d8454401000200"),
        ("UInt32", [1], "d8464401000000"),
        ("UInt64", [1], "d847480100000000000000"),
        ("Int8", [-1, 1], "d84842ff01"),
        ("Int16", [-2], "d84d42feff"),
        ("Int32", [-2], "d84e44feffffff"),
        ("Int64", [-2], "d84f48feffffffffffffff"),
        ("Float32", [1.5], "d855440000c03f"),
        ("Float64", [1.5], "d85648000000000000f83f"),
        ("UInt8", [1, 255], "4201ff"),
    ],
)
def test_arrays_of_numbers_are_the_typed_arrays_of_cbor_byte_for_byte(
    kind: str, values: list[float], encoded: str
) -> None:
    message = CODEC.cbor(FORMS[f"std_msgs/{kind}MultiArray"], {"data": values})
    assert bytes.fromhex("64" + b"data".hex() + encoded) in write_cbor(message)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_nan_and_infinity_are_rejected_in_json_by_field(bad: float) -> None:
    with pytest.raises(MessageError, match="field data is"):
        CODEC.json(FORMS["std_msgs/Float64"], {"data": bad})
    with pytest.raises(MessageError, match="field ranges contains NaN"):
        CODEC.json(FORMS["sensor_msgs/LaserScan"], {"ranges": [1.0, bad]})
    read = read_cbor(write_cbor(CODEC.cbor(FORMS["std_msgs/Float64"], {"data": bad})))
    assert same(read["data"], bad)


@pytest.mark.parametrize(
    "message",
    [
        {"datum": ""},
        {"data": 1},
        {"data": None},
        [],
        None,
    ],
)
def test_invalid_host_messages_are_rejected(message: Any) -> None:
    for write in (CODEC.json, CODEC.cbor):
        with pytest.raises(MessageError, match="cannot encode a std_msgs/String"):
            write(FORMS["std_msgs/String"], message)


def test_fixed_arrays_of_wrong_size_are_rejected() -> None:
    with pytest.raises(MessageError, match="covariance"):
        CODEC.json(FORMS["geometry_msgs/PoseWithCovariance"], {"covariance": np.zeros((6, 6))})


@pytest.mark.parametrize(
    "data",
    [
        *(bytes([head]) for head in (0x1C, 0x1D, 0x1E, 0x3C, 0x5C, 0x7C, 0x9C, 0xBC)),  # reserved
        b"\x81" * 100_000,  # nested deeply
        b"\xff",  # break outside of an indefinite item
        b"\x62\xff\xfe",  # text that is not UTF-8
        b"\xa1\x01",  # key without value
        b"\xd8\x4e\x43abc",  # int32 array of three bytes
    ],
)
def test_invalid_cbor_is_rejected(data: bytes) -> None:
    with pytest.raises(FrameError):
        read_cbor(data)


@given(st.binary(max_size=60))
def test_arbitrary_bytes_raise_no_other_exception_than_frame_error(data: bytes) -> None:
    with contextlib.suppress(FrameError):
        read_cbor(data)
