"""CBOR with typed arrays (RFC 8746) and large byte strings that are copied only once."""

from __future__ import annotations

import os
import struct
from typing import Any, Final

import cbor2
import numpy as np
from numpy.typing import NDArray

from teleop.rosbridge.errors import FrameError
from teleop.rosbridge.messages.message_defaults import DTYPES

TAGS: Final = {
    "byte": 64,
    "uint16": 69,
    "uint32": 70,
    "uint64": 71,
    "int8": 72,
    "int16": 77,
    "int32": 78,
    "int64": 79,
    "float32": 85,
    "float64": 86,
}
"""Tags of the little-endian typed arrays (RFC 8746, section 2.1), by primitive."""

_DTYPES_BY_TAG: Final = {tag: DTYPES[kind] for kind, tag in TAGS.items()}

_LARGE: Final = 65_536
"""Size from which on bytes are copied only when the whole message is joined [bytes]."""

_MAX_DEPTH: Final = 100
"""Nesting levels that are read; a ROS message has about ten."""

_PLACEHOLDER: Final = os.urandom(16)
"""Stands for a large byte string until it is inserted; random, so that no message contains it."""

_ENCODED_PLACEHOLDER: Final = cbor2.dumps(_PLACEHOLDER)

_BYTE_STRING_32: Final = 0x5A
"""Initial byte of a byte string with a 32-bit length (RFC 8949, section 3.1)."""


def write_cbor(value: object) -> bytes:
    """Return a value in CBOR; a ``memoryview`` becomes a byte string that is copied once."""
    return b"".join(cbor_pieces(value))


def cbor_pieces(value: object) -> list[bytes | memoryview]:
    """Return a value in CBOR as pieces; a ``memoryview`` becomes a byte string that is not copied."""
    views: list[memoryview] = []

    def insert_placeholder(encoder: cbor2.CBOREncoder, view: memoryview) -> None:
        views.append(view)
        encoder.encode_bytes(_PLACEHOLDER)

    encoded = cbor2.dumps(value, encoders={memoryview: insert_placeholder})
    first, *rest = encoded.split(_ENCODED_PLACEHOLDER)
    pieces: list[bytes | memoryview] = [first]
    for view, after in zip(views, rest, strict=True):
        pieces += struct.pack("!BI", _BYTE_STRING_32, view.nbytes), view, after
    return pieces


def read_cbor(data: bytes) -> Any:
    """Return the value of CBOR bytes; typed arrays become numpy arrays.

    Raises:
        FrameError: If the bytes are not CBOR.
    """
    try:
        return cbor2.loads(data, tag_hook=_read_typed_array, max_depth=_MAX_DEPTH)
    except (cbor2.CBORError, ValueError, TypeError, OverflowError, MemoryError) as error:
        raise FrameError(f"not CBOR: {error}") from error


def typed_array(kind: str, array: NDArray[Any]) -> cbor2.CBORTag:
    """Return an array of numbers of a primitive as a typed array."""
    return cbor2.CBORTag(TAGS[kind], array_bytes(array))


def array_bytes(array: NDArray[Any]) -> bytes | memoryview:
    """Return the bytes of an array, without a copy of a large one."""
    if array.nbytes < _LARGE:
        return array.tobytes()
    return memoryview(np.ascontiguousarray(array).view(np.uint8).data)


def view_if_large(data: bytes) -> bytes | memoryview:
    """Return bytes in the form that ``write_cbor`` copies least."""
    return data if len(data) < _LARGE else memoryview(data)


def _read_typed_array(tag: cbor2.CBORTag, immutable: bool) -> Any:
    dtype = _DTYPES_BY_TAG.get(tag.tag)
    if dtype is None or not isinstance(tag.value, bytes):
        return tag
    return np.frombuffer(tag.value, dtype)
