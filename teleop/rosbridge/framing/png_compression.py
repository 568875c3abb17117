"""JSON text as a encode_png, which rosbridge calls the compression ``png``.

Browsers once could inflate nothing else. It serves text, such as markers; scans and clouds, which
hardly shrink, are better asked for in CBOR.
"""

from __future__ import annotations

import math
import struct
import zlib
from base64 import b64encode
from typing import Final

_SIGNATURE: Final = b"\x89PNG\r\n\x1a\n"

_LEVEL: Final = 1
"""Of zlib: the higher ones cost several times as much and gain a tenth."""


def png_operation(text: bytes) -> bytes:
    """Return the ``png`` operation that holds another operation's JSON text."""
    return b'{"op":"png","data":"' + b64encode(encode_png(text)) + b'"}'


def encode_png(text: bytes) -> bytes:
    """Return a PNG whose red, green and blue, row by row, are a text and line feeds behind it."""
    width = max(math.isqrt(len(text) // 3), 1)
    height = max(-(-len(text) // (3 * width)), 1)
    stride = 3 * width
    padded = text.ljust(stride * height, b"\n")
    # Each row begins with the number of its filter; 0 leaves it as it is.
    rows = b"".join(b"\0" + padded[i : i + stride] for i in range(0, len(padded), stride))
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)  # 8 bits, red green blue
    return b"".join(
        (
            _SIGNATURE,
            _chunk(b"IHDR", header),
            _chunk(b"IDAT", zlib.compress(rows, _LEVEL)),
            _chunk(b"IEND", b""),
        )
    )


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
