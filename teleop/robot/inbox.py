"""Messages from clients that wait for the robot's next tick."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from localization.types import Hint
from teleop.joystick import VelocityRequest
from teleop.robot.arm.arm_commands import Wish


@dataclass(frozen=True, slots=True, eq=False)
class FromClient:
    """What a client wants, or what became of it."""

    client: str
    """Name of the client; empty for nobody."""


@dataclass(frozen=True, slots=True, eq=False)
class DriveCommand(FromClient):
    """A client requests a velocity."""

    request: VelocityRequest
    """The requested velocity and the state of the deadman button."""
    stamp: int = 0
    """Time of the request by the client's clock [ns]; 0 if it has none."""
    arrival: int | None = None
    """Time at which it arrived at the robot's socket, by the clock of the tick's ``now`` [ns]; None for that
    of the tick that takes it."""
    age: int = 0
    """Estimated time between the operator's hand and the arrival [ns]: delay of the link and of waiting."""
    stream: bool = False
    """Whether it is of a stream without deadman button, such as ``/cmd_vel``."""
    rested: bool = False
    """Whether the client has paused for a second before it, over a link that worked all the time."""


@dataclass(frozen=True, slots=True, eq=False)
class PoseHint(FromClient):
    """A client says where the robot is; nobody does so for the pose that it starts with."""

    hint: Hint
    """The pose, with its covariance."""


@dataclass(frozen=True, slots=True)
class TakeOver(FromClient):
    """A client takes the driver's lease from the client that holds it."""


@dataclass(frozen=True, slots=True)
class Ask(FromClient):
    """A client asks the driver for the robot."""

    number: int
    """Number of its connection."""


@dataclass(frozen=True, slots=True)
class Give(FromClient):
    """The driver gives the robot to the client that asks for it."""


@dataclass(frozen=True, slots=True)
class Refuse(FromClient):
    """The driver refuses the client that asks for the robot."""


@dataclass(frozen=True, slots=True)
class EStop(FromClient):
    """A client latches the e-stop."""

    holder: str = ""
    """Holder of the token that the client connected with; empty without tokens."""


@dataclass(frozen=True, slots=True)
class EStopReset(FromClient):
    """A client releases the e-stop."""

    holder: str = ""
    """Holder of the token that the client connected with; empty without tokens."""
    admin: bool = False
    """Whether the client may release an e-stop that another token's holder latched."""
    operator: bool = False
    """Whether the client may drive, and so release an e-stop that somebody without a token latched."""


@dataclass(frozen=True, slots=True)
class GuardSwitch(FromClient):
    """The driver switches the guard off for as long as it drives, or on again."""

    on: bool
    """Whether it is to guard."""


@dataclass(frozen=True, slots=True)
class Undo(FromClient):
    """A client reverts the last accepted hint, or the last pose that a global search set."""


@dataclass(frozen=True, slots=True)
class Relocalize(FromClient):
    """A client requests a search of the whole map."""


@dataclass(frozen=True, slots=True)
class Disconnected(FromClient):
    """A client's connection has ended."""


@dataclass(frozen=True, slots=True)
class StepGoal(FromClient):
    """A client asks for one step: straight on, a turn on the spot, or an arc."""

    number: int
    """Number of the step, from 1; no other step of the same server has it."""
    distance: float = 0.0
    """Distance to drive along the way, positive forward [m]; 0 for a turn on the spot."""
    angle: float = 0.0
    """Angle to turn on that way, positive to the left [rad]; 0 for a straight step."""
    speed: float = 0.0
    """Speed [m/s], of a turn [rad/s]; 0 for the robot's own."""
    time_limit: float = 0.0
    """Time after which it is given up [s]; 0 for that which the robot works out."""
    measure_by: str = "odometry"
    """What says how far it went: ``odometry`` or ``localization``."""
    age: int = 0
    """Estimated time between the client's sending and the arrival [ns]."""
    hold_to_run: bool = False
    """Whether it is driven only while its client holds the deadman with the stick at rest."""


@dataclass(frozen=True, slots=True)
class StepCancel(FromClient):
    """A client cancels one of its steps."""

    number: int
    """Number of the step."""


@dataclass(frozen=True, slots=True)
class StepAlive(FromClient):
    """A client whose steps are under way is connected; comes ten times a second."""

    arrival: int
    """Time at which that was known, by the clock of the tick's ``now`` [ns]."""
    age: int = 0
    """Age of its oldest ping without an answer [ns]; 0 if it has answered all."""


@dataclass(frozen=True, slots=True)
class StepAnswered(FromClient):
    """The result of a step has been taken by the gateway."""

    number: int
    """Number of the step."""


@dataclass(frozen=True, slots=True, eq=False)
class ArmWish(FromClient):
    """A client wants something of the arm."""

    wish: Wish
    """What it wants."""
    arrival: int | None = None
    """See ``DriveCommand``."""
    age: int = 0
    """See ``DriveCommand``."""
    rested: bool = False
    """See ``DriveCommand``."""


@dataclass(frozen=True, slots=True)
class WorldCall(FromClient):
    """A client calls a service of the playground."""

    number: int
    """Number of the call, from 1; no other call of the same server has it."""
    service: str
    """Name of the service's type, such as ``SetEntityState``."""
    request: str
    """The request, as JSON."""


InboxMessage: TypeAlias = (
    DriveCommand
    | PoseHint
    | TakeOver
    | Ask
    | Give
    | Refuse
    | EStop
    | EStopReset
    | GuardSwitch
    | Undo
    | Relocalize
    | Disconnected
    | StepGoal
    | StepCancel
    | StepAlive
    | StepAnswered
    | ArmWish
    | WorldCall
)
"""Everything that clients can send to the robot."""
