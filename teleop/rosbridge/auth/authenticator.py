"""Who is let in: by a token, or by a code that rosauth's clients make from a secret."""

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
"""Difference between a client's clock and ours at which its code is still good [s] (rosauth)."""

_TEXTS: Final = ("mac", "client", "dest", "rand", "level")
_LONGEST: Final = 256
_MOST_USED: Final = 1024
"""Codes remembered within the window; with more, none is let in until some are forgotten."""


@dataclass(frozen=True, slots=True)
class Admission:
    """A client is let in."""

    access: Access
    lasts: float | None = None
    """How long [s]; None for as long as it stays."""


class Authenticator:
    """Judges what clients bring; remembers the codes it has seen, so that none is good twice."""

    def __init__(self, keyring: Credentials, wall: Callable[[], float]) -> None:
        """Make a gate.

        Args:
            keyring: Who may come in.
            wall: Returns the time since 1970 [s], by which rosauth's codes expire.
        """
        self._keyring = keyring
        self._wall = wall
        self._used: dict[str, float] = {}
        """When each code seen is too old anyway [s]."""

    @property
    def anonymous(self) -> Access | None:
        """What those may do who bring nothing; None if they must bring something."""
        return self._keyring.anonymous

    def renew(self, keyring: Credentials) -> None:
        """Let in by other keys from now on."""
        self._keyring = keyring

    def confirms(self, access: Access) -> bool:
        """Return whether a client that was let in with an access would be let in with it now."""
        return self._keyring.confirms(access)

    def token(self, token: str) -> Access | None:
        """Return what a token gives access to; None if it is not known."""
        return self._keyring.find(token)

    def operation(self, operation: dict[str, Any]) -> Admission | None:
        """Return what an ``auth`` operation gives access to; None if it is not good.

        It has a ``token``, or rosauth's ``mac`` with what goes into it.

        Raises:
            OperationError: If it lacks something.
        """
        token = operation.get("token")
        if isinstance(token, str):
            access = self.token(token)
            return None if access is None else Admission(access)
        mac, client, dest, rand, level = (_text(operation, key) for key in _TEXTS)
        made, end = _seconds(operation, "t"), _seconds(operation, "end")
        now = self._wall()
        # What rosauth's server adds up: GT-RAIL/rosauth, src/ros_mac_authentication.cpp.
        message = f"{client}{dest}{rand}{made}{level}{end}"
        found: Credential | None = None
        for key in self._keyring.keys:
            code = hashlib.sha512((key.secret + message).encode(errors="surrogatepass"))
            good = hmac.compare_digest(
                code.hexdigest().encode(), mac.lower().encode(errors="replace")
            )
            if good and key.secret:
                found = key
        fresh = abs(now - made) < _WINDOW and end > now
        if found is None or not fresh or not self._first(mac.lower(), now):
            return None
        return Admission(self._keyring.lowered(found.holding, level), end - now)

    def _first(self, mac: str, now: float) -> bool:
        self._used = {code: until for code, until in self._used.items() if until > now}
        if mac in self._used or len(self._used) >= _MOST_USED:
            return False
        self._used[mac] = now + 2 * _WINDOW
        return True


def token_in(target: str, authorization: str | None) -> str | None:
    """Return the token in a request's header or, if that has none, in its URL's query."""
    if authorization is not None:
        scheme, _, token = authorization.strip().partition(" ")
        if scheme.lower() == "bearer":
            return token.strip()
    values = parse_qs(urlsplit(target).query, keep_blank_values=True).get("token")
    return values[0] if values else None


def _text(operation: dict[str, Any], key: str) -> str:
    value = operation.get(key)
    if not isinstance(value, str) or len(value) > _LONGEST:
        raise OperationError(f"it needs a token, or the short strings {', '.join(_TEXTS)}")
    return value


def _seconds(operation: dict[str, Any], key: str) -> int:
    """Return a time that is written as a number, or in any of the ways ROS has it [s]."""
    value = operation.get(key)
    if isinstance(value, dict):
        value = value.get("secs", value.get("sec"))
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value < 2**40:
        raise OperationError(f"it needs {key}, a time in seconds")
    return int(value)
