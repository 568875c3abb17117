"""Settings of ``farsteer kafka-rest``."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from teleop.errors import SettingError


@dataclass(frozen=True, slots=True)
class RestConfig:
    """Where the REST proxy listens, and to whom; each field is an option of the command."""

    host: str = "127.0.0.1"
    """Address to listen on; 0.0.0.0 for all of this machine's."""
    port: int = 8082
    """Port to listen on; 0 takes a free one."""
    token_file: Path | None = None
    """File with the token that clients must send, as Bearer or as the password of Basic; without one all may."""
    send_to: str = "turtle_control"
    """Topics to which clients may send records, separated by commas; * for any but the broker's own."""
    tls_cert: Path | None = None
    """Certificate for https (PEM)."""
    tls_key: Path | None = None
    """Private key of that certificate (PEM)."""

    def __post_init__(self) -> None:
        if not 0 <= self.port <= 65535:
            raise SettingError(f"port must be 0 to 65535, got {self.port}")
        if not re.fullmatch(r"\*|[A-Za-z0-9._-]+(,[A-Za-z0-9._-]+)*", self.send_to):
            raise SettingError(
                f"send_to must be topics, separated by commas, or *, got {self.send_to!r}"
            )
        if (self.tls_cert is None) != (self.tls_key is None):
            raise SettingError("--tls-cert and --tls-key belong together: give both")

    @property
    def sendable(self) -> frozenset[str] | None:
        """The topics to which clients may send; None if it may be any."""
        return None if self.send_to == "*" else frozenset(self.send_to.split(","))
