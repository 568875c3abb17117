"""Faults of a scenario, each at its time; ``kind`` says which one it is."""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias

from pydantic import Field
from pydantic.dataclasses import dataclass

from teleop.scenario.files.schema import STRICT, Degrees, Metres, Place, Seconds, Share

Scanner: TypeAlias = Literal["laser_horizontal", "laser_vertical", "both"]
"""Which of the robot's scanners."""


Edge: TypeAlias = Annotated[float, Field(ge=0.05, le=5.0)]
"""Length of an edge of a box [m]."""


@dataclass(frozen=True, slots=True, config=STRICT)
class Kidnap:
    """The robot is carried off: it stands elsewhere, at rest, from one instant to the next."""

    kind: Literal["kidnap"]
    """``kidnap``."""
    at: Seconds
    """When [s]."""
    to: Place | Literal["anywhere"] = "anywhere"
    """Where to: a place, [x, y, heading], or ``anywhere``, a free spot of the floor drawn by the scenario's seed."""


@dataclass(frozen=True, slots=True, config=STRICT)
class WheelSlip:
    """The wheels turn faster than the robot moves, as on ice; the encoders believe them."""

    kind: Literal["wheel_slip"]
    """``wheel_slip``."""
    at: Seconds
    """When it begins [s]."""
    lasting: Seconds = 1.0
    """For how long [s]."""
    factor: Annotated[float, Field(ge=0.0, le=10.0)] = 2.0
    """Speed of the wheels over that of the ground."""


@dataclass(frozen=True, slots=True, config=STRICT)
class ScannerDead:
    """A scanner sends nothing."""

    kind: Literal["scanner_dead"]
    """``scanner_dead``."""
    at: Seconds
    """When it begins [s]."""
    lasting: Seconds | None = None
    """For how long [s]; to the end, unless given."""
    scanner: Scanner = "both"
    """Which one."""


@dataclass(frozen=True, slots=True, config=STRICT)
class ScannerDirty:
    """Dirt on a scanner's window: neighbouring beams end at the window, or return nothing."""

    kind: Literal["scanner_dirty"]
    """``scanner_dirty``."""
    at: Seconds
    """When it begins [s]."""
    lasting: Seconds | None = None
    """For how long [s]; to the end, unless given."""
    scanner: Scanner = "laser_horizontal"
    """Which one."""
    share: Share = 0.3
    """Share of its beams that the dirt covers."""


@dataclass(frozen=True, slots=True, config=STRICT)
class Box:
    """A box is put down that the map does not know, as when furniture is moved."""

    kind: Literal["box"]
    """``box``."""
    at: Seconds
    """When [s]."""
    to: Place
    """Where its middle stands."""
    lasting: Seconds | None = None
    """After which time it is taken away [s]; never, unless given."""
    size: tuple[Edge, Edge, Edge] = (0.6, 0.6, 1.0)
    """Its length, width and height [m], each 0.05 to 5."""


@dataclass(frozen=True, slots=True, config=STRICT)
class Walker:
    """A person walks along a path, once, and is gone; nobody steps aside."""

    kind: Literal["person"]
    """``person``."""
    at: Seconds
    """When the walk begins [s]."""
    path: Annotated[tuple[Place, ...], Field(min_length=2)]
    """Corners of the path."""
    speed: Annotated[float, Field(ge=0.1, le=3.0)] = 1.2
    """Walking speed [m/s]."""


@dataclass(frozen=True, slots=True, config=STRICT)
class DoorClosed:
    """A door that was open when the map was made is closed."""

    kind: Literal["door_closed"]
    """``door_closed``."""
    at: Seconds
    """When [s]."""
    door: str
    """Its name in the floor plan."""
    lasting: Seconds | None = None
    """After which time it is opened again [s]; never, unless given."""


@dataclass(frozen=True, slots=True, config=STRICT)
class Link:
    """The link between client and robot gets worse; nothing is lost or overtaken, as on a TCP connection."""

    kind: Literal["link"]
    """``link``."""
    at: Seconds
    """When it begins [s]."""
    lasting: Seconds | None = None
    """For how long [s]; to the end, unless given."""
    direction: Literal["up", "down", "both"] = "both"
    """``up``: from the client to the robot; ``down``: from the robot to the client."""
    client: Annotated[int, Field(ge=1)] | None = None
    """Number of the client, in the order of their connections; all of them, unless given."""
    delay: Seconds = 0.0
    """Time that each message takes [s]."""
    jitter: Seconds = 0.0
    """Largest additional delay, drawn evenly for each message by the scenario's seed [s]."""
    rate: Annotated[float, Field(ge=0.0)] = 0.0
    """Bytes carried in a second; 0 for any number."""
    blackout: bool = False
    """Whether nothing gets through at all."""


@dataclass(frozen=True, slots=True, config=STRICT)
class OperatorKilled:
    """The operator's program dies: its connection ends without a word."""

    kind: Literal["operator_killed"]
    """``operator_killed``."""
    at: Seconds
    """When [s]."""
    silent: bool = False
    """Whether the connection stays open, as when the program hangs or a network is gone."""


@dataclass(frozen=True, slots=True, config=STRICT)
class WrongHint:
    """A second operator gives a hint of the robot's pose that is wrong."""

    kind: Literal["wrong_hint"]
    """``wrong_hint``."""
    at: Seconds
    """When [s]."""
    off: Metres = 5.0
    """Distance of the hinted position from the true one [m], in a direction drawn by the scenario's seed."""
    turned: Degrees = 0.0
    """By so much the heading is wrong [degrees]."""


@dataclass(frozen=True, slots=True, config=STRICT)
class ClockStep:
    """The operator's clock jumps, as when it is set by a time server: the stamps of its commands do, too."""

    kind: Literal["clock_step"]
    """``clock_step``."""
    at: Seconds
    """When [s]."""
    step: Annotated[float, Field(ge=-86_400.0, le=86_400.0)]
    """By how much [s]; negative for back."""


@dataclass(frozen=True, slots=True, config=STRICT)
class EStopPressed:
    """A second person presses the e-stop, and perhaps releases it."""

    kind: Literal["estop"]
    """``estop``."""
    at: Seconds
    """When [s]."""
    lasting: Seconds | None = None
    """After which time it is released [s]; never, unless given."""


@dataclass(frozen=True, slots=True, config=STRICT)
class BoardUnplugged:
    """The line to the board of a second arm is unplugged; the board holds its arm where it is."""

    kind: Literal["board_unplugged"]
    """``board_unplugged``."""
    at: Seconds
    """When [s]."""
    lasting: Seconds | None = None
    """After which time it is plugged in again [s]; never, unless given."""


Fault: TypeAlias = Annotated[
    Kidnap
    | WheelSlip
    | ScannerDead
    | ScannerDirty
    | Box
    | Walker
    | DoorClosed
    | Link
    | OperatorKilled
    | WrongHint
    | ClockStep
    | EStopPressed
    | BoardUnplugged,
    Field(discriminator="kind"),
]
"""Any fault."""
