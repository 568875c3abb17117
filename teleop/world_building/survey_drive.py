"""Survey drive: along a world's survey route, steered by ground truth.

A person at the joystick who watches the robot steers like this. The readings are all that mapping gets.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Final

import numpy as np

from localization.types import SECOND, Health, Pose, Reading, Twist
from robot_sim import Simulation
from teleop.errors import TeleopError
from teleop.scenario.tour_driver import DriverConfig, TourDriver

Progress = Callable[[float, str], None]
"""Called now and then with the completed share, in [0, 1], and a line of text."""

_SPEED: Final = 0.4
"""Forward speed of the drive [m/s]."""


class SurveyError(TeleopError):
    """A survey drive could not be completed."""


def survey_drive(
    simulation: Simulation,
    *,
    rest: int = 0,
    progress: Progress = lambda share, text: None,
) -> Iterator[tuple[tuple[Reading, ...], Pose]]:
    """Drive the survey route; yield each tick's readings and the true pose after it.

    Args:
        simulation: A simulation of a scene with a survey route, before its first tick.
        rest: Time for which the robot stands still first [ns].
        progress: Called with the completed share and a line of text.

    Raises:
        SurveyError: If the drive takes four times as long as the route's length requires.
    """
    route = simulation.world.survey
    driver = TourDriver(route, DriverConfig(speed=_SPEED))
    length = float(np.hypot(*np.diff(np.array(route), axis=0).T).sum())
    time_limit = rest + round((60.0 + 4.0 * length / _SPEED) * SECOND)
    pose = simulation.truth().map_from_base
    while not driver.done:
        begun = simulation.stamp >= rest
        twist = driver.command(pose, Health.TRACKING) if begun else Twist.planar(0.0, 0.0)
        simulation.command(twist)
        readings = tuple(simulation.step())
        pose = simulation.truth().map_from_base
        yield readings, pose
        if simulation.stamp % SECOND == 0:
            progress(driver.progress, f"driving, {simulation.stamp // SECOND} s")
        if simulation.stamp > time_limit:
            at = np.round(pose.position[:2], 1).tolist()
            raise SurveyError(f"the survey drive got stuck near {at}, {driver.progress:.0%} done")
