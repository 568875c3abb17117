"""Tasks of a hand on an arm, one after the other; ``kind`` says which one it is.

Places of the tip are in ``arm_base``: x ahead, z up from the foot of the arm.
"""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias

from pydantic import Field
from pydantic.dataclasses import dataclass

from teleop.scenario.files.schema import STRICT, Metres, Seconds

Offset: TypeAlias = Annotated[float, Field(ge=-10.0, le=10.0)]
"""A coordinate [m]."""
Spot: TypeAlias = tuple[Offset, Offset, Offset]
"""A place of the tip [m]."""
Steep: TypeAlias = Annotated[float, Field(ge=-90.0, le=90.0)]
"""Angle by which the gripper points down, straight away from the arm's foot [degrees]."""
Five: TypeAlias = tuple[float, float, float, float, float]
"""A number for each joint, from the base."""
Times: TypeAlias = Annotated[int, Field(ge=1, le=10_000)]
"""How often something is done."""


@dataclass(frozen=True, slots=True, config=STRICT)
class Pick:
    """Comes from above, closes the gripper about what is there, and lifts it."""

    kind: Literal["pick"]
    """``pick``."""
    at: Spot
    """Where the tip grips [m]."""
    down: Steep = 60.0
    """Angle by which the gripper points down [degrees]."""
    above: Metres = 0.07
    """Height from which it comes, and to which it lifts [m]."""
    effort: Annotated[float, Field(ge=0.0, le=20.0)] = 0.0
    """Largest force of the jaws, if they get a goal [N]; 0 for the gripper's own."""


@dataclass(frozen=True, slots=True, config=STRICT)
class Put:
    """Comes from above, opens the gripper, and goes up again."""

    kind: Literal["put"]
    """``put``."""
    at: Spot
    """Where the tip lets go [m]."""
    down: Steep = 60.0
    """Angle by which the gripper points down [degrees]."""
    above: Metres = 0.07
    """Height from which it comes, and to which it goes [m]."""


@dataclass(frozen=True, slots=True, config=STRICT)
class Reach:
    """Leads the tip to a place, which may be out of reach."""

    kind: Literal["reach"]
    """``reach``."""
    to: Spot
    """Where to [m]."""
    down: Steep = 30.0
    """Angle by which the gripper points down [degrees]."""
    aside: Annotated[float, Field(ge=-90.0, le=90.0)] = 0.0
    """Angle by which it points to the left of that [degrees]."""
    lasting: Seconds = 8.0
    """Time after which it gives up [s]."""


@dataclass(frozen=True, slots=True, config=STRICT)
class Sweep:
    """Moves the hand in circles, or by a turn, with the clutch closed and no look at the tip; else it keeps still."""

    kind: Literal["sweep"]
    """``sweep``."""
    radius: Metres = 0.0
    """Radius, upright and across the arm [m]."""
    cone: Annotated[float, Field(ge=0.0, le=90.0)] = 0.0
    """Largest angle by which it points off meanwhile, in a circle as well [degrees]."""
    turn: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Turn about x, y and z that it makes in the first second [degrees]."""
    period: Annotated[float, Field(gt=0.0)] = 2.0
    """Time of a circle [s]."""
    lasting: Seconds = 4.0
    """For how long [s]."""


@dataclass(frozen=True, slots=True, config=STRICT)
class Roam:
    """Moves the hand to one place after the other, drawn by the seed, whether the arm can follow or not."""

    kind: Literal["roam"]
    """``roam``."""
    far: Metres = 0.4
    """Largest distance from where it began, along each axis [m]."""
    speed: Annotated[float, Field(gt=0.0, le=3.0)] = 0.6
    """Mean speed of a reach [m/s]."""
    lasting: Seconds = 10.0
    """For how long [s]."""


@dataclass(frozen=True, slots=True, config=STRICT)
class Clutch:
    """Closes the clutch and opens it again, with a hand that keeps still."""

    kind: Literal["clutch"]
    """``clutch``."""
    times: Times = 10
    """How often."""
    each: Annotated[float, Field(ge=0.02)] = 0.1
    """Time for which it is closed; it is open for a tick [s]."""


@dataclass(frozen=True, slots=True, config=STRICT)
class Lose:
    """Tracking is lost with the clutch closed: the pose drifts off, and is somewhere else at once."""

    kind: Literal["lose"]
    """``lose``."""
    by: Spot
    """Way from where the hand is to where it is seen next [m]."""
    drift: Metres = 0.0
    """Way of the pose while it is guessed [m]."""
    lasting: Seconds = 0.5
    """For how long it is guessed [s]."""
    said: bool = True
    """Whether the messages say so; otherwise the pose jumps with nothing said."""


@dataclass(frozen=True, slots=True, config=STRICT)
class Move:
    """Asks for a way that the robot plans."""

    kind: Literal["move"]
    """``move``."""
    to: str | Spot
    """Name of a pose, such as stow, or a place of the tip [m]."""
    down: Steep = 30.0
    """Angle by which the gripper points down, at a place [degrees]."""
    wait: bool = True
    """Whether the next task waits for its end."""


@dataclass(frozen=True, slots=True, config=STRICT)
class WayOut:
    """Has the robot do what it offers where the hand leads no further, such as to turn the wrist over."""

    kind: Literal["way_out"]
    """``way_out``."""


@dataclass(frozen=True, slots=True, config=STRICT)
class Joints:
    """Sends a timed motion of the joints as it is, good or bad."""

    kind: Literal["joints"]
    """``joints``."""
    times: tuple[float, ...]
    """Times of its points [s]."""
    angles: tuple[tuple[float, ...], ...]
    """Angles at each point [degrees]."""
    names: tuple[str, ...] = ()
    """Names of the joints, if not the arm's."""


@dataclass(frozen=True, slots=True, config=STRICT)
class Grip:
    """Asks for an opening of the gripper."""

    kind: Literal["grip"]
    """``grip``."""
    opening: Metres = 0.0
    """Opening [m]."""
    effort: Annotated[float, Field(ge=0.0, le=20.0)] = 0.0
    """Largest force of the jaws together [N]; 0 for the gripper's own."""


@dataclass(frozen=True, slots=True, config=STRICT)
class Jog:
    """Turns joints at rates until the time is up."""

    kind: Literal["jog"]
    """``jog``."""
    rates: Five
    """Rate of each joint [rad/s]."""
    lasting: Seconds = 2.0
    """For how long [s]."""


@dataclass(frozen=True, slots=True, config=STRICT)
class Drive:
    """Drives at a speed and a turn rate until the time is up."""

    kind: Literal["drive"]
    """``drive``."""
    speed: Annotated[float, Field(ge=-3.0, le=3.0)] = 0.0
    """Forward speed [m/s]."""
    turn: Annotated[float, Field(ge=-6.0, le=6.0)] = 0.0
    """Turn rate, positive to the left [rad/s]."""
    lasting: Seconds = 2.0
    """For how long [s]."""


@dataclass(frozen=True, slots=True, config=STRICT)
class Wait:
    """Does nothing, with the clutch open."""

    kind: Literal["wait"]
    """``wait``."""
    lasting: Seconds = 1.0
    """For how long [s]."""


Task: TypeAlias = Annotated[
    Pick
    | Put
    | Reach
    | Sweep
    | Roam
    | Clutch
    | Lose
    | Move
    | WayOut
    | Joints
    | Grip
    | Jog
    | Drive
    | Wait,
    Field(discriminator="kind"),
]
"""Any task."""
