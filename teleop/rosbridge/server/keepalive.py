"""How a client that is dead, or silent, is found out."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Keepalive:
    """How a dead client is found out."""

    ping_interval: float | None = 5.0
    """Time between two pings [s]; None for no pings."""

    ping_timeout: float | None = 10.0
    """Time a client has to answer one [s]."""

    write_timeout: float | None = 10.0
    """Time a client has to take a frame off its socket [s]."""

    auth_timeout: float = 5.0
    """Time a client has to say who it is, where it is asked [s]."""

    @classmethod
    def none(cls) -> Keepalive:
        """Return a pulse that waits for ever, for lockstep, where a client may think for long."""
        return cls(None, None, None)
