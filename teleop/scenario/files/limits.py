"""Limits that the outcome of a scenario must keep."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field
from pydantic.dataclasses import dataclass

from teleop.scenario.files.schema import STRICT, Metres, Seconds

Count = Annotated[int, Field(ge=0)]
"""A number of events."""


@dataclass(frozen=True, slots=True, config=STRICT)
class Limits:
    """Each limit is judged only if it is given, but for ``goals`` and ``violations``."""

    goals: bool = True
    """Whether all goals must be reached, in order and in time."""
    contacts: Count | None = None
    """Largest number of times that the robot touches an obstacle; one that it has not touched for a second is
    touched anew."""
    tilt: Annotated[float, Field(ge=0.0, le=180.0)] | None = None
    """Largest tilt from the vertical [degrees]."""
    position_max: Metres | None = None
    """Largest error of the estimated position, while the robot claims to know it: ``tracking``,
    ``degraded`` or ``slipping`` [m]."""
    doubted_max: Metres | None = None
    """Largest error of the estimated position while the robot claims to know it or doubts it, ``suspect`` [m]."""
    position_rmse: Metres | None = None
    """Largest root mean square of that error [m]."""
    heading_rmse: Annotated[float, Field(ge=0.0, le=180.0)] | None = None
    """Largest root mean square of the error of the estimated heading during that time [degrees]."""
    heading_max: Annotated[float, Field(ge=0.0, le=180.0)] | None = None
    """Largest error of the estimated heading during that time [degrees]."""
    grace: Seconds = 2.0
    """Time after somebody has carried the robot off in which these errors and ``nees`` do not count yet [s]; it ends
    as soon as the robot no longer claims to know its place."""
    lost: Seconds | None = None
    """Longest time in all that the robot is not localised: ``waiting``, ``lost`` or ``relocalising`` [s]."""
    silent_error: Seconds | None = None
    """Longest time in all that the position is more than 0.5 m wrong while the robot claims to
    know it [s]."""
    stops: Count | None = None
    """Largest number of stops that the robot makes of itself while it moves: by its watchdog, a lost driver, or
    the e-stop."""
    hints: Count | None = None
    """Largest number of hints that operators give."""
    nees: tuple[float, float] | None = None
    """Bounds of the mean normalised estimation error squared of the pose; 6 is consistent."""
    stopping_time: Seconds | None = None
    """Longest time from the last valid command of a driver that falls silent to wheels at rest [s]."""
    runaway: Metres | None = None
    """Longest way driven after a driver has fallen silent [m]."""
    distance: Metres | None = None
    """Least distance to drive [m]."""
    duration: Seconds | None = None
    """Longest time until the last goal is reached [s]."""
    picked: Count | None = None
    """Least number of parcels that the arm holds 2 cm above where they lay."""
    placed: Count | None = None
    """Least number of parcels that lie where ``mission.deliver`` wants them at the end."""
    dropped: Count | None = None
    """Largest number of times that the gripper loses what it holds without having been opened."""
    arm_contacts: Count | None = None
    """Largest number of times that the arm touches anything but, with its gripper, a parcel; counted as ``contacts``."""
    load: Annotated[float, Field(ge=0.0)] | None = None
    """Largest share of its stall torque that a servo of the arm bears for a second on end."""
    load_max: Annotated[float, Field(ge=0.0)] | None = None
    """Largest share of its stall torque that a servo of the arm bears at all."""
    slip: Metres | None = None
    """Largest way that a parcel slips in the closed gripper [m]."""
    tip_moved: Metres | None = None
    """Largest distance of the arm's tip from where it began, as seen from the arm's foot [m]."""
    tip_off: Metres | None = None
    """Largest distance of the arm's tip from ``mission.tip`` at the end [m]."""
    pointing_off: Annotated[float, Field(ge=0.0, le=180.0)] | None = None
    """Largest angle of the gripper from where ``mission.tip`` points at the end [degrees]."""
    mirror_error: Annotated[float, Field(ge=0.0, le=180.0)] | None = None
    """Largest error of a joint of the second arm, while both rest [degrees]."""
    wheels_off: Seconds | None = None
    """Longest time on end for which two wheels or more are off the ground, as before tipping over [s]."""
    violations: Count = 0
    """Largest number of things that the client may not do and tried."""
    rules: bool = False
    """Whether the rules that hold in every run are judged as well: ``farsteer fuzz --rules`` lists them."""
