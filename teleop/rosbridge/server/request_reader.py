"""One request as h11 parses it, within limits, and the body of a POST."""

from __future__ import annotations

import re
from http import HTTPStatus
from typing import Final

import h11
from websockets.datastructures import Headers
from websockets.exceptions import InvalidHeaderValue
from websockets.http11 import Request

MAX_BODY: Final = 16_384
"""Largest body [bytes]."""

_MAX_HEAD: Final = 16_384
"""Largest request line and headers, all together [bytes]."""

_MAX_LINE: Final = 8192
"""Longest target, and longest value of a header [bytes]."""

_MAX_LINES: Final = 64
"""Largest number of headers; browsers send about twenty."""

_END: Final = b"\r\n\r\n"

_LENGTHS: Final = re.compile(rb"\ncontent-length[ \t]*:[ \t]*([^\r\n]*)", re.IGNORECASE)

NOT_UNDERSTOOD: Final = "not a valid HTTP/1.1 request without a body"


class RequestError(ValueError):
    """A request that is refused before anybody looks at it, with the status of the answer."""

    def __init__(self, status: HTTPStatus, why: str) -> None:
        super().__init__(why)
        self.status = status


class RequestReader:
    """Takes bytes until they are a whole request."""

    def __init__(self) -> None:
        self._parser = h11.Connection(h11.SERVER, max_incomplete_event_size=_MAX_HEAD)
        self._head = bytearray()
        self.request: Request | None = None
        """The request, once its head is complete."""

        self.body = bytearray()
        """Its body, as far as it has arrived."""

    def take(self, data: bytes) -> bool:
        """Add bytes; return whether the request and its body are complete.

        Raises:
            RequestError: If it is not valid or too long.
        """
        try:
            return self._read_body(data) if self.request else self._read_head(data)
        except (h11.RemoteProtocolError, InvalidHeaderValue) as error:
            raise RequestError(HTTPStatus.BAD_REQUEST, NOT_UNDERSTOOD) from error

    @property
    def rest(self) -> bytes:
        """What has arrived after the request: the first frames of a WebSocket, if there will be one."""
        return self._parser.trailing_data[0]

    def _read_head(self, data: bytes) -> bool:
        room = _MAX_HEAD - len(self._head)
        taken, beyond = data[:room], data[room:]
        self._head += taken
        end = self._head.find(_END)
        if self._head.count(b"\n", 0, end if end >= 0 else len(self._head)) > _MAX_LINES:
            raise _too_large(f"more than {_MAX_LINES} headers")
        self._parser.receive_data(taken)
        event = self._parser.next_event()
        if isinstance(event, h11.Request):
            self.request = self._checked(event)
            return self._read_body(beyond)
        if len(self._head) >= _MAX_HEAD:
            raise _too_large(f"a request of more than {_MAX_HEAD} bytes")
        return False

    def _checked(self, event: h11.Request) -> Request:
        """Return a request as websockets knows it, unless a limit is exceeded or its body is in doubt."""
        request = _request_of(event)
        if len(request.path) > _MAX_LINE:
            raise RequestError(
                HTTPStatus.REQUEST_URI_TOO_LONG, f"a target of more than {_MAX_LINE} bytes"
            )
        if any(len(value) > _MAX_LINE for _, value in request.headers.raw_items()):
            raise _too_large(f"a header of more than {_MAX_LINE} bytes")
        head = self._head[: len(self._head) - len(self._parser.trailing_data[0])]
        if request.protocol not in ("HTTP/1.0", "HTTP/1.1") or not _clear_body(request, head):
            raise RequestError(HTTPStatus.BAD_REQUEST, NOT_UNDERSTOOD)
        return request

    def _read_body(self, data: bytes) -> bool:
        if data:
            self._parser.receive_data(data)
        while isinstance(event := self._parser.next_event(), h11.Data):
            self.body += event.data
        return event is not h11.NEED_DATA


def _too_large(why: str) -> RequestError:
    return RequestError(HTTPStatus.REQUEST_HEADER_FIELDS_TOO_LARGE, why)


def _request_of(event: h11.Request) -> Request:
    headers = Headers([(_text(name), _text(value)) for name, value in event.headers.raw_items()])
    protocol = f"HTTP/{_text(event.http_version)}"
    return Request(_text(event.target), headers, _text(event.method), protocol)


def _text(data: bytes) -> str:
    """Return text of a head as websockets does: any bytes may be in a header, such as the cookie of another program."""
    return data.decode("iso-8859-1")


def _clear_body(request: Request, head: bytearray) -> bool:
    """Return whether nobody could disagree on where a request ends: only a POST has a body, of one length."""
    lengths = [found.strip(b" \t") for found in _LENGTHS.findall(head)]
    if "Transfer-Encoding" in request.headers or len(lengths) > 1:
        return False
    length = lengths[0] if lengths else b"0"
    if not re.fullmatch(rb"[0-9]{1,6}", length):
        return False
    return int(length) <= (MAX_BODY if request.method == "POST" else 0)
