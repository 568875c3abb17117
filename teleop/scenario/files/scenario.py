"""A scenario: a world, a start, a mission, an operator, faults at their times, and limits of the outcome.

It is a frozen value with a schema: unknown fields and impossible values are refused as it is made.
"""

from __future__ import annotations

from dataclasses import field
from typing import Annotated, Final, Literal, TypeAlias

from pydantic import Field, TypeAdapter
from pydantic.dataclasses import dataclass

from teleop.scenario.files.arm_tasks import Spot, Steep
from teleop.scenario.files.faults import Fault
from teleop.scenario.files.limits import Limits
from teleop.scenario.files.operator_settings import Follower, Operator
from teleop.scenario.files.schema import STRICT, Degrees, Metres, Place, Point, Seconds, Share

NO_SCANNERS: Final = "none"
"""Name of the scanner of a robot without any."""


Name: TypeAlias = Annotated[
    str, Field(min_length=1, max_length=80, pattern=r"^[a-z0-9][a-z0-9_.-]*$")
]
"""Small letters, digits, and ``-``, ``_`` or ``.``."""
Side: TypeAlias = Annotated[float, Field(ge=0.005, le=0.2)]
"""Length of an edge of a parcel [m]."""


@dataclass(frozen=True, slots=True, config=STRICT)
class Parcel:
    """A small box that lies loose, for an arm to pick up."""

    name: Name
    """Its name."""
    at: Point
    """Where its middle is."""
    z: Metres = 0.0
    """Height of its underside above the ground [m]."""
    size: tuple[Side, Side, Side] = (0.03, 0.03, 0.03)
    """Its length, width and height [m], each 0.005 to 0.2."""
    mass: Annotated[float, Field(ge=0.001, le=0.2)] = 0.02
    """Its mass [kg]."""


@dataclass(frozen=True, slots=True, config=STRICT)
class WorldSettings:
    """Where the robot drives, with which sensors, and how the world differs from its map."""

    scene: str = "office"
    """Name of a scene, or path of a scene folder, floor plan or MJCF file in the scenario file's folder."""
    alive: bool = False
    """Whether people walk about, doors swing and carts are pushed."""
    rearranged: Annotated[int, Field(ge=0)] | None = None
    """Seed by which furniture has moved since the map was made; unless given, it has not."""
    scanner: str = "default"
    """Model of both scanners: sick_lms200, sick_lms111, hokuyo_utm30lx; by default an LMS1xx at 10 Hz; none for a
    robot without scanners."""
    inertial: str = "default"
    """Model of the inertial unit: xsens_mti630, bosch_bmi088; by default a small MEMS unit."""
    effects: bool = False
    """Whether beams have the errors of mixed pixels, dark and slanting surfaces, and glass."""
    sun: Share = 0.0
    """Daylight as a share of full sun, for these errors; 0 is indoors."""
    firmware: bool = False
    """Whether wheel speeds are reported as the P3-AT's own controller does, in ten packets a second."""
    uneven_tyres: bool = False
    """Whether the tyres differ between left and right, as identified on a real P3-AT."""
    surface: str | None = None
    """Surface of the whole ground, such as carpet; unless given, each place has its own."""
    arm: str | None = None
    """Arm that the robot carries, such as s2; unless given, none."""
    arm_mount: str = "bracket"
    """Where the arm is mounted: bracket, ahead of the front bumper, or plate, on the top plate."""
    arm_speed: Annotated[float, Field(ge=0.0, allow_inf_nan=False)] = 0.2
    """Largest speed of the vehicle while the arm is off its stow pose [m/s]; 0 for no such limit."""
    board: Literal["degree", "microsecond"] | None = None
    """What the pulses of a second arm are rounded to, whose servos have play and follow the arm; unless given, none
    does."""
    parcels: tuple[Parcel, ...] = ()
    """Small boxes that lie loose, for the arm to pick up."""
    stale_limits: bool = True
    """Whether the robot slows down for commands that are more than 0.5 s old when they arrive, and refuses those
    that are more than 1 s old."""
    guard: bool = True
    """Whether the robot keeps from driving into what its scanners see."""


@dataclass(frozen=True, slots=True, config=STRICT)
class Start:
    """Where the robot starts, and what it knows of that."""

    at: Place | None = None
    """Where it stands; the world's own start, unless given."""
    known: Literal["exactly", "about", "nothing"] = "exactly"
    """What the robot knows: its pose, a pose that is wrong by ``off`` and ``turned``, or nothing, so that it
    must search."""
    off: Metres = 0.0
    """Distance of the pose that it is given from the true one [m], in a direction drawn by the seed."""
    turned: Degrees = 0.0
    """By so much the heading that it is given is wrong [degrees], to a side drawn by the seed."""


@dataclass(frozen=True, slots=True, config=STRICT)
class Goal:
    """A place to drive to."""

    at: Place
    """Where."""
    within: Annotated[float, Field(gt=0.0, le=100.0)] = 0.5
    """Distance at which it counts as reached, by ground truth [m]."""
    stay: Seconds = 0.0
    """How long the robot must stay within this distance [s]."""


@dataclass(frozen=True, slots=True, config=STRICT)
class Delivery:
    """A parcel that is to lie somewhere at the end."""

    parcel: str
    """Its name."""
    to: tuple[float, float, float]
    """Where its middle is to be: x, y and height above that of the map's origin [m]."""
    within: Annotated[float, Field(gt=0.0, le=10.0)] = 0.05
    """Distance at which it counts as placed [m]."""


@dataclass(frozen=True, slots=True, config=STRICT)
class TipGoal:
    """Where the arm's tip is to be at the end, as seen from the arm's foot."""

    at: Spot
    """Where [m]."""
    down: Steep = 30.0
    """Angle by which the gripper points down, straight away from the arm's foot [degrees]."""
    aside: Steep = 0.0
    """Angle by which it points to the left of that [degrees]."""


@dataclass(frozen=True, slots=True, config=STRICT)
class Mission:
    """What the operator has to do."""

    goals: tuple[Goal, ...] = ()
    """Places to drive to, in this order; without any the run lasts until ``time_limit``."""
    deliver: tuple[Delivery, ...] = ()
    """Parcels that the arm has to place somewhere, in any order."""
    tip: TipGoal | None = None
    """Where the arm's tip is to be at the end."""
    tour: bool = False
    """Whether the goals are the way-points of the world's own tour, or of one that is planned through its free floor;
    the robot must pass each within 1 m, and stand for a second at the last."""
    time_limit: Annotated[float, Field(gt=0.0, le=86_400.0)] = 120.0
    """Longest time of the run [s]."""


@dataclass(frozen=True, slots=True, config=STRICT)
class Scenario:
    """Everything that decides the outcome of a run: the same scenario gives the same bits in lockstep."""

    format: Literal[1]
    """Version of this format: 1."""
    name: Name
    """Its name, for reports: small letters, digits, and ``-``, ``_`` or ``.``."""
    description: Annotated[str, Field(max_length=2000)] = ""
    """What happens and what must not, in a sentence or two."""
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 0
    """Seed of all that is drawn: noise, jitter, an operator's lapses."""
    world: WorldSettings = field(default_factory=WorldSettings)
    """The world, the robot's sensors, and what has changed since the map was made."""
    start: Start = field(default_factory=Start)
    """Where the robot starts, and what it knows of it."""
    mission: Mission = field(default_factory=Mission)
    """What has to be done, and in which time."""
    operator: Operator = field(default_factory=Follower)
    """Who drives."""
    second: Operator | None = None
    """A second operator of the library, who connects as well and drives too, if it is let."""
    roles: Annotated[tuple[Literal["view", "operate", "admin"], ...], Field(max_length=2)] = ()
    """Roles of the tokens by which the operator and the second one connect, both of the library; without any,
    nobody needs a token."""
    fault: tuple[Fault, ...] = ()
    """What goes wrong, each at its time."""
    limits: Limits = field(default_factory=Limits)
    """What must hold at the end."""


SCHEMA: Final = TypeAdapter(Scenario)
"""Checks, writes and describes scenarios."""
