"""Timeouts by which unresponsive clients are detected."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Keepalive:
    """Timeouts by which unresponsive clients are detected."""

    ping_interval: float | None = 5.0
    """Time between two pings [s]; None for no pings."""

    ping_timeout: float | None = 10.0
    """Time for the answer to a ping [s]; None for unlimited."""

    write_timeout: float | None = 10.0
    """Time in which a client must read a frame from its socket [s]; None for unlimited."""

    auth_timeout: float = 5.0
    """Time in which a client must authenticate, if required [s]."""

    @classmethod
    def off(cls) -> Keepalive:
        """Return unlimited timeouts, for lockstep, where a client may pause for long."""
        return cls(None, None, None)
