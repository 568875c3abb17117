"""Messages from clients that wait for the robot's next tick."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from localization.types import Hint
from teleop.joystick import VelocityRequest


@dataclass(frozen=True, slots=True, eq=False)
class DriveCommand:
    """A client requests a velocity."""

    client: str
    """Name of the client."""
    request: VelocityRequest
    """The requested velocity and the state of the deadman button."""
    stamp: int = 0
    """Time of the request by the client's clock [ns]; for latency statistics only."""


@dataclass(frozen=True, slots=True)
class TakeOver:
    """A client takes the driver's lease from the client that holds it."""

    client: str
    """Name of the client."""


@dataclass(frozen=True, slots=True)
class EStop:
    """A client latches the e-stop."""

    client: str
    """Name of the client."""
    holder: str = ""
    """Holder of the token that the client connected with; empty without tokens."""


@dataclass(frozen=True, slots=True)
class EStopReset:
    """A client releases the e-stop."""

    client: str
    """Name of the client."""
    holder: str = ""
    """Holder of the token that the client connected with; empty without tokens."""
    admin: bool = False
    """Whether the client may release an e-stop that another token's holder latched."""


@dataclass(frozen=True, slots=True)
class Undo:
    """A client reverts the last accepted hint, or the last pose that a global search set."""

    client: str
    """Name of the client."""


@dataclass(frozen=True, slots=True)
class Relocalize:
    """A client requests a search of the whole map."""

    client: str
    """Name of the client."""


@dataclass(frozen=True, slots=True)
class Disconnected:
    """A client's connection has ended."""

    client: str
    """Name of the client."""


InboxMessage: TypeAlias = (
    DriveCommand | TakeOver | EStop | EStopReset | Undo | Relocalize | Disconnected | Hint
)
"""Everything that clients can send to the robot."""
