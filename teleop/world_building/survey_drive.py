"""The drive of a survey: along a world's survey route, steered by where the robot truly is.

So steers a hand at the joystick that looks at the robot. What is made of the readings is the mapper's.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Final

import numpy as np

from localization.types import SECOND, Health, Pose, Reading, Twist
from robot_sim import Simulation
from teleop.scenario.tour_driver import DriverConfig, TourDriver

Progress = Callable[[float, str], None]
"""Called now and then with the share done and a line of text."""

_SPEED: Final = 0.4
"""Of the drive [m/s]."""


class SurveyError(RuntimeError):
    """A survey that could not be made to its end."""


def survey_drive(
    simulation: Simulation,
    *,
    rest: int = 0,
    progress: Progress = lambda share, text: None,
) -> Iterator[tuple[tuple[Reading, ...], Pose]]:
    """Drive the survey route; yield each tick's readings and where the robot is after it.

    Args:
        simulation: of a scene with a survey route, at its beginning.
        rest: how long the robot stands before it begins [ns].
        progress: called with the share done and a line of text.

    Raises:
        SurveyError: if the route took four times as long as its length lets expect.
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
            raise SurveyError(f"the survey got stuck near {at}, {driver.progress:.0%} done")
