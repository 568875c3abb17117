"""JSON text as pixels of a PNG image, which rosbridge calls the compression ``png``.

Browsers once could inflate nothing else. It suits text such as markers; scans and clouds hardly
shrink and are better requested in CBOR.
"""

from __future__ import annotations

import math
from base64 import b64encode
from io import BytesIO
from typing import Final

_LEVEL: Final = 1
"""zlib level; higher levels take several times as long and save a tenth."""


def png_operation(text: bytes) -> bytes:
    """Return the ``png`` operation that contains another operation's JSON text."""
    return b'{"op":"png","data":"' + b64encode(encode_png(text)) + b'"}'


def encode_png(text: bytes) -> bytes:
    """Return an RGB image whose bytes, row by row, are a text padded with line feeds."""
    from PIL import Image  # few clients request PNG, and Pillow takes 50 ms to import

    width = max(math.isqrt(len(text) // 3), 1)
    height = max(-(-len(text) // (3 * width)), 1)
    image = Image.frombytes("RGB", (width, height), text.ljust(3 * width * height, b"\n"))
    png = BytesIO()
    image.save(png, "PNG", compress_level=_LEVEL)
    return png.getvalue()
