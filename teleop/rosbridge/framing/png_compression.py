"""JSON text as pixels of a PNG image, which rosbridge calls the compression ``png``.

Browsers once could inflate nothing else. It suits text such as markers; scans and clouds hardly
shrink and are better requested in CBOR. Packing takes forty times as long as writing the JSON, and
each spelling of a topic is a different image, so what is large or too much is sent as JSON.
"""

from __future__ import annotations

import math
import threading
from base64 import b64encode
from io import BytesIO
from typing import Final

from teleop.rosbridge.limits import TokenBucket

LARGEST_PNG: Final = 65_536
"""Longest JSON text that is packed [bytes], which takes 3 ms; a longer one is sent as it is."""

_RATE: Final = 1e6
"""Text that a server packs for all its clients [bytes/s], 4 % of a processor."""

_BURST: Final = 0.5
"""Time whose text may come at once [s]."""

_IMAGE: Final = 1000
"""What an image costs besides its text, as bytes of text."""

_LEVEL: Final = 1
"""zlib level; higher levels take several times as long and save a tenth."""


class PngPacker:
    """Packs the texts of one server, within a budget; may be called by several threads."""

    def __init__(self) -> None:
        self._budget: TokenBucket | None = None
        self._lock = threading.Lock()

    def pack(self, text: bytes, now: int) -> bytes:
        """Return the ``png`` operation of an operation's JSON text, or the text itself if it is too much.

        Args:
            text: The text.
            now: Time [ns] by which the budget is refilled.
        """
        return png_operation(text) if self._admit(len(text), now) else text

    def _admit(self, length: int, now: int) -> bool:
        if length > LARGEST_PNG:
            return False
        with self._lock:
            if self._budget is None:
                self._budget = TokenBucket(_RATE, _BURST, now)
            return self._budget.take(length + _IMAGE, now)


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
