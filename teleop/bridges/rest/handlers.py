"""What is common to all requests: who may ask, what a body may be, how errors are answered."""

from __future__ import annotations

import base64
import binascii
import hmac
import json
import logging
from typing import Any, Final

from tornado.web import HTTPError, RequestHandler, stream_request_body

from teleop.bridges.broker_options import is_loopback
from teleop.bridges.client_life import FAILURES
from teleop.bridges.rest.errors import Failure, RestError
from teleop.bridges.rest.media_types import PLAIN, accepted_plain
from teleop.bridges.rest.state import State

MAX_BODY: Final = 1_000_000
"""Largest body [bytes]."""

_LOG: Final = logging.getLogger(__name__)


@stream_request_body
class Handler(RequestHandler):
    """A request; what it raises is answered in the interface's own form.

    Its body is read once it is known that the client may ask; otherwise the connection is closed behind the answer.
    """

    state: State
    """What all requests share."""

    def initialize(self, state: State) -> None:
        """Take what all requests share."""
        self.state = state
        self.received = bytearray()
        """The body, as far as it has come in."""

    def data_received(self, chunk: bytes) -> None:
        """Take a part of the body; the server bounds the whole."""
        self.received += chunk

    def set_default_headers(self) -> None:
        """Say nothing about the server; no page of another origin may read an answer."""
        self.clear_header("Server")
        self.set_header("Cache-Control", "no-store")
        self.set_header("Cross-Origin-Resource-Policy", "same-origin")
        self.set_header("X-Content-Type-Options", "nosniff")

    def prepare(self) -> None:
        """Refuse who may not ask."""
        self._check_page()
        self._check_token()

    def _check_page(self) -> None:
        """Refuse requests of web pages: programs send neither of these headers, and no page can leave them out.

        A page could also have a name of its own point here; on loopback only this machine's names are answered.
        """
        headers = self.request.headers
        if "Origin" in headers or headers.get("Sec-Fetch-Site", "none") not in (
            "none",
            "same-origin",
        ):
            raise Failure.FORBIDDEN.error("web pages are not served")
        host = self.request.host_name
        if self.state.on_loopback and not is_loopback(host):
            raise Failure.FORBIDDEN.error(f"Host must be this machine, got {host:.100}")

    def _check_token(self) -> None:
        if (token := self.state.token) is None:
            return
        scheme, _, rest = self.request.headers.get("Authorization", "").partition(" ")
        given = rest.strip()
        if scheme.lower() == "basic":
            try:
                given = base64.b64decode(given, validate=True).decode().partition(":")[2]
            except (binascii.Error, ValueError):
                given = ""
        elif scheme.lower() != "bearer":
            given = ""
        if not hmac.compare_digest(given.encode(errors="replace"), token.encode()):
            raise Failure.UNAUTHORIZED.error()

    def body(self) -> dict[str, Any]:
        """Return the body, an object of JSON; 422 if it is anything else."""
        try:
            parsed = json.loads(self.received)
        except (ValueError, RecursionError):
            raise Failure.UNREADABLE.error("it is no JSON") from None
        if not isinstance(parsed, dict):
            raise Failure.UNREADABLE.error("it must be an object")
        return parsed

    def plain(self) -> str:
        """Return the media type of an answer without records."""
        return accepted_plain(self.request.headers.get("Accept", ""))

    def answer(self, content: object, media: str) -> None:
        """Answer with a content in JSON."""
        self.set_header("Content-Type", media)
        self.finish(json.dumps(content))

    def nothing(self) -> None:
        """Answer that it is done."""
        self.set_status(204)
        self.finish()

    def write_error(self, status_code: int, **kwargs: Any) -> None:
        """Answer with the error that was raised."""
        error = kwargs.get("exc_info", (None, None, None))[1]
        if isinstance(error, FAILURES):
            error = Failure.NO_BROKER.error(str(error) or "no answer")
        elif isinstance(error, HTTPError):
            error = RestError(status_code, status_code, f"HTTP {status_code} {self._reason}")
        elif not isinstance(error, RestError):
            error = RestError(500, 50001, "internal error")
        self.set_status(error.status)
        if error.status in (401, 403):
            self.set_header("Connection", "close")
        if error.status == 401:
            self.set_header("WWW-Authenticate", 'Basic realm="farsteer"')
        self.set_header("Content-Type", PLAIN)
        self.finish(json.dumps({"error_code": error.code, "message": error.message}))

    def log_exception(self, typ: Any, value: Any, tb: Any) -> None:
        """Log what is no client's mistake."""
        if not isinstance(value, (RestError, HTTPError, *FAILURES)):
            _LOG.error("a request failed", exc_info=value)


class Elsewhere(Handler):
    """A path that the interface does not have."""

    def get(self, *_: str) -> None:
        """Refuse."""
        raise Failure.NO_SUCH_PAGE.error()

    post = put = patch = delete = head = options = get
