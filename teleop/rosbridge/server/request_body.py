"""The body of a POST, which websockets does not read: taken from the bytes before they are parsed."""

from __future__ import annotations

import re
from typing import Final

MAX_BODY: Final = 16_384
"""Largest body [bytes]."""

_MAX_HEAD: Final = 32_768
"""Largest header of a request with a body [bytes]."""

_END: Final = b"\r\n\r\n"

_LENGTHS: Final = re.compile(rb"\r\ncontent-length[ \t]*:([^\r\n]*)", re.IGNORECASE)

_TRANSFER: Final = re.compile(rb"\r\ntransfer-encoding[ \t]*:", re.IGNORECASE)


class RequestBody:
    """Holds a POST back until its body has arrived, and hands over its header alone.

    Whatever it does not understand it hands over as it came, so that the parser refuses it: a body above
    ``MAX_BODY``, several lengths, a length that is not a number, and transfer codings.
    """

    def __init__(self) -> None:
        self._held: bytearray | None = bytearray()
        self.content = b""
        """The body, once it has arrived; empty if there is none."""

    def take(self, data: bytes) -> bytes:
        """Return what the parser gets now, after these bytes have arrived."""
        if self._held is None:
            return data
        self._held += data
        if not b"POST ".startswith(self._held[:5]):
            return self._let_go()
        end = self._held.find(_END)
        if end < 0:
            return b"" if len(self._held) <= _MAX_HEAD else self._let_go()
        end += len(_END)
        head = bytes(self._held[:end])
        if (found := _length(head)) is None:
            return self._let_go()
        line, size = found
        if len(self._held) < end + size:
            return b""
        self.content = bytes(self._held[end : end + size])
        self._held[:end] = head.replace(line, b"", 1)
        del self._held[end - len(line) : end - len(line) + size]
        return self._let_go()

    def _let_go(self) -> bytes:
        """Return all that was held back; from now on everything passes."""
        held, self._held = self._held, None
        assert held is not None
        return bytes(held)


def _length(head: bytes) -> tuple[bytes, int] | None:
    """Return the header's line with the body's length, and the length; None if there is no body to be taken."""
    found = list(_LENGTHS.finditer(head))
    if len(found) != 1 or _TRANSFER.search(head):
        return None
    digits = found[0][1].strip(b" \t")
    if not re.fullmatch(rb"[0-9]{1,6}", digits) or not 0 < int(digits) <= MAX_BODY:
        return None
    return found[0][0], int(digits)
