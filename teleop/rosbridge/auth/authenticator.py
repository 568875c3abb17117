"""Authentication of clients by token, or by a rosauth message authentication code."""

from __future__ import annotations

import hashlib
import hmac
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final
from urllib.parse import parse_qs, urlsplit

from teleop.rosbridge.auth.credentials import Credential, Credentials
from teleop.rosbridge.auth.permissions import Access
from teleop.rosbridge.errors import OperationError

_WINDOW: Final = 5.0
"""Largest difference between the clocks of client and server for a valid code [s] (rosauth)."""

_TEXTS: Final = ("mac", "client", "dest", "rand", "level")
_MAX_LENGTH: Final = 256
_MAX_USED: Final = 1024
"""Number of used codes that are kept; with more, further ones are rejected until some expire."""


@dataclass(frozen=True, slots=True)
class Admission:
    """Result of a successful ``auth`` operation."""

    access: Access
    duration: float | None = None
    """Validity [s]; None for unlimited."""


class Authenticator:
    """Verifies tokens and codes; each code is accepted only once."""

    def __init__(self, credentials: Credentials, wall: Callable[[], float]) -> None:
        """Create an authenticator.

        Args:
            credentials: Tokens and secrets with their permissions.
            wall: Returns the Unix time [s], by which rosauth codes expire.
        """
        self.credentials = credentials
        """What is verified by, which may be replaced."""

        self._wall = wall
        self._used: dict[str, float] = {}
        """Unix time at which each used code expires [s]."""

    @property
    def anonymous(self) -> Access | None:
        """Permissions of clients without a token; None if a token is required."""
        return self.credentials.anonymous

    def verify_token(self, token: str) -> Access | None:
        """Return the permissions of a token; None if it is unknown."""
        return self.credentials.find(token)

    def verify_operation(self, operation: dict[str, Any]) -> Admission | None:
        """Return the permissions for an ``auth`` operation; None if it is rejected.

        It contains a ``token``, or rosauth's ``mac`` and the fields from which it is computed.

        Raises:
            OperationError: If a field is missing.
        """
        token = operation.get("token")
        if isinstance(token, str):
            access = self.verify_token(token)
            return None if access is None else Admission(access)
        mac, client, dest, rand, level = (_text(operation, key) for key in _TEXTS)
        made, end = _seconds(operation, "t"), _seconds(operation, "end")
        now = self._wall()
        # The concatenation of rosauth's server: GT-RAIL/rosauth, src/ros_mac_authentication.cpp.
        message = f"{client}{dest}{rand}{made}{level}{end}"
        found: Credential | None = None
        for key in self.credentials.keys:
            code = hashlib.sha512((key.secret + message).encode(errors="surrogatepass"))
            good = hmac.compare_digest(
                code.hexdigest().encode(), mac.lower().encode(errors="replace")
            )
            if good and key.secret:
                found = key
        fresh = abs(now - made) < _WINDOW and end > now
        if found is None or not fresh or not self._unused(mac.lower(), now):
            return None
        return Admission(self.credentials.restricted(found.granted, level), end - now)

    def _unused(self, mac: str, now: float) -> bool:
        self._used = {code: until for code, until in self._used.items() if until > now}
        if mac in self._used or len(self._used) >= _MAX_USED:
            return False
        self._used[mac] = now + 2 * _WINDOW
        return True


def token_in(target: str, authorization: str | None) -> str | None:
    """Return the token in a request's header, otherwise that in its URL's query."""
    if authorization is not None:
        scheme, _, token = authorization.strip().partition(" ")
        if scheme.lower() == "bearer":
            return token.strip()
    values = parse_qs(urlsplit(target).query, keep_blank_values=True).get("token")
    return values[0] if values else None


def _text(operation: dict[str, Any], key: str) -> str:
    value = operation.get(key)
    if not isinstance(value, str) or len(value) > _MAX_LENGTH:
        raise OperationError(f"a token is required, or the short strings {', '.join(_TEXTS)}")
    return value


def _seconds(operation: dict[str, Any], key: str) -> int:
    """Return a time [s] that is given as a number or as a ROS stamp."""
    value = operation.get(key)
    if isinstance(value, dict):
        value = value.get("secs", value.get("sec"))
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value < 2**40:
        raise OperationError(f"{key} must be a time in seconds")
    return int(value)
