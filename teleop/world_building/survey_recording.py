"""Recording of a survey drive, for mapping from its readings alone.

The simulator steers the robot along the survey route, as a person at the joystick would; the mapping in
``localization.mapping.slam`` gets the readings and nothing else, and ``map_quality`` evaluates its map.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

from localization.evaluation.trajectory import Trajectory
from localization.logs.mcap_writer import ReadingsWriter
from localization.types import SECOND
from robot_sim import Simulation, SimulationConfig, World
from teleop.world_building.survey_drive import Progress, survey_drive

_REST: Final = 2 * SECOND
"""Time for which the robot stands still first, so that the gyro's bias is known before it turns the map [ns]."""


def record_survey(
    world: World,
    path: Path,
    *,
    seed: int = 0,
    sensors: SimulationConfig | None = None,
    progress: Progress = lambda share, text: None,
) -> Trajectory:
    """Drive the world's survey route, write all readings to a log, and return the true trajectory.

    Args:
        world: A scene with a survey route.
        path: File of the log; its folder is created.
        seed: Seed of the sensor noise.
        sensors: Sensors and drive of the robot; the default ones if not given.
        progress: Called with the completed share and a line of text.

    Raises:
        SurveyError: If the drive takes four times as long as the route's length requires.
    """
    simulation = Simulation(world, seed=seed, config=sensors)

    def halfway(share: float, text: str) -> None:
        progress(0.5 * share, text)

    metadata = {"scene": world.name, "seed": str(seed), "drive": "survey"}
    with ReadingsWriter(path, simulation.mounts, metadata) as log:
        truth = []
        for readings, pose in survey_drive(simulation, rest=_REST, progress=halfway):
            for reading in readings:
                log.write(reading, simulation.stamp)
            truth.append((simulation.stamp, pose))
    return Trajectory.from_poses(truth)
