"""Opening of client connections, first and after a loss, with one-line error messages."""

from __future__ import annotations

import asyncio
import itertools
import logging
import os
import ssl
from collections.abc import AsyncIterator, Callable
from http import HTTPStatus
from typing import Any, Final

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import InvalidHandshake, InvalidStatus, InvalidURI
from websockets.http11 import Response

from teleop.rosbridge.errors import ClientError

_MAX_FRAME: Final = 64_000_000
"""Largest received frame [bytes]."""
OTHER_NAME: Final = (62, 64)
"""OpenSSL's codes of a certificate for another name, and for another address."""

_WIRE: Final = logging.getLogger(f"{__name__}.wire")
_WIRE.setLevel(logging.CRITICAL)  # errors that matter are raised


class Connector:
    """Opens connections to one server."""

    def __init__(
        self,
        url: str,
        *,
        keepalive: float | None,
        timeout: float,
        token: str | None,
        tls: ssl.SSLContext | None,
    ) -> None:
        """Take the arguments of ``Client``."""
        if token is not None and not (token.isascii() and token.isprintable()):
            raise ClientError("token must be one line of ASCII")  # said here, without the token
        self.url = url.partition("?")[0]
        """URL of the server for messages, without its query, which may contain a token."""

        self._target = url
        self._timeout = timeout
        self._options: dict[str, Any] = {
            "compression": None,  # which costs more than it saves on local networks
            "proxy": None,  # no proxy from the environment
            "open_timeout": timeout,
            "ping_interval": keepalive,
            "ping_timeout": timeout,
            "close_timeout": 2,
            "max_size": _MAX_FRAME,
            "additional_headers": {} if token is None else {"Authorization": f"Bearer {token}"},
            "logger": _WIRE,
        }
        if tls is not None:
            self._options["ssl"] = tls

    async def open(self, patience: float = 0.0) -> ClientConnection:
        """Return a new connection.

        Args:
            patience: Time for which to retry while no server listens [s].

        Raises:
            ClientError: If the connection cannot be opened.
        """
        loop = asyncio.get_running_loop()
        end = loop.time() + patience
        while True:
            try:
                return await self._open()
            except ClientError as error:
                if loop.time() >= end or not isinstance(error.__cause__, OSError):
                    raise
                await asyncio.sleep(0.1)

    async def reopen(self, failed: Callable[[str], None]) -> AsyncIterator[ClientConnection]:
        """Yield new connections without end; ``failed`` is called with the reason of each failure."""
        while True:
            for pause in itertools.chain((0.1, 0.25, 0.5, 1.0, 2.0), itertools.repeat(5.0)):
                await asyncio.sleep(pause)
                try:
                    opened = await self._open()
                except ClientError as error:
                    failed(str(error))
                else:
                    break
            yield opened

    async def _open(self) -> ClientConnection:
        try:
            return await connect(self._target, **self._options)
        except ssl.SSLCertVerificationError as error:  # which is a ValueError, too
            way = "give the certificate of its issuer, as --ca FILE or tls="
            if error.verify_code in OTHER_NAME:
                way = "call it as its certificate does"
            reason = error.verify_message.rstrip(".")
            raise ClientError(f"{self.url} is not trusted: {reason}; {way}") from error
        except ssl.SSLError as error:
            why = f"{error.reason or 'it closes the connection'}; is it at ws://?"
            raise ClientError(f"{self.url} has no TLS in common with this client: {why}") from error
        except (InvalidURI, ValueError) as error:  # the latter for invalid ports and brackets
            raise ClientError(
                f"{self.url!r} is not a valid URL such as ws://127.0.0.1:9090"
            ) from error
        except InvalidStatus as error:
            if error.response.status_code == HTTPStatus.UNAUTHORIZED:
                raise ClientError(f"{self.url} does not accept this client's token") from error
            raise ClientError(f"{self.url} {_refusal(error.response)}") from error
        except (InvalidHandshake, EOFError) as error:
            hint = "; is it at wss://?" if self.url.startswith("ws:") else ""
            raise ClientError(f"{self.url} is not a rosbridge server: {error}{hint}") from error
        except TimeoutError as error:
            raise ClientError(f"{self.url} does not answer within {self._timeout:g} s") from error
        except OSError as error:
            raise ClientError(f"no server listens at {self.url}: {_cause(error)}") from error


def _refusal(response: Response) -> str:
    """Return in one line what an answer that is no WebSocket says."""
    status = response.status_code
    if status not in (HTTPStatus.FORBIDDEN, HTTPStatus.TOO_MANY_REQUESTS) and status < 500:
        return f"is not a rosbridge server: it answers HTTP {status}"
    # A server that does not take this client now, or a proxy before it.
    kind = "".join(response.headers.get_all("Content-Type"))
    said = (response.body or b"").decode(errors="replace").partition("\n")[0][:200]
    if not kind.startswith("text/plain") or not said.isprintable():
        said = f"HTTP {status}"
    return f"refuses the connection: {said}"


def _cause(error: OSError) -> str:
    """Return the text of an error without the addresses that asyncio adds."""
    return os.strerror(error.errno) if error.errno and error.errno > 0 else str(error)
