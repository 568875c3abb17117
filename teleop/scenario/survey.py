"""Map a scene: drive its survey route and gather what the lidars see.

The cloud holds nothing that a beam did not hit. The poses the sweeps are placed at are the simulator's
own, and so is the steering: this is a survey with a perfect total station, not SLAM.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from localization.cloud import Cloud
from localization.deskew import OdometryTrack, deskew
from localization.mapping import CloudBuilder, MappingConfig
from localization.types import SECOND, Health, Scan
from robot_sim import Simulation, World
from teleop.scenario.driver import DriverConfig, TourDriver

_TIME_LIMIT = 1800 * SECOND


class SurveyError(RuntimeError):
    """A survey that could not be driven to its end."""


def survey(
    world: World,
    *,
    seed: int = 0,
    config: MappingConfig = MappingConfig(),  # noqa: B008  (frozen)
    progress: Callable[[float, str], None] = lambda share, text: None,
) -> Cloud:
    """Drive the world's survey route and return its cloud.

    Args:
        world: a scene with a survey route.
        seed: of the sensor noise.
        config: how points become a map.
        progress: called with the share done and a line of text.

    Raises:
        SurveyError: if the route could not be driven in half an hour of robot time.
    """
    simulation = Simulation(world, seed=seed)
    driver = TourDriver(world.survey, DriverConfig(speed=0.4))
    builder = CloudBuilder(config)
    track = OdometryTrack()
    truth = simulation.truth()
    track.add(truth.stamp, truth.map_from_base)
    waiting: list[Scan] = []
    while not driver.done:
        simulation.command(driver.command(truth.map_from_base, Health.TRACKING))
        waiting += [r for r in simulation.step() if isinstance(r, Scan)]
        truth = simulation.truth()
        track.add(truth.stamp, truth.map_from_base)
        if waiting:
            sweep = deskew(waiting, track, simulation.mounts, truth.stamp)
            builder.add(sweep, truth.map_from_base)
            waiting = []
            progress(driver.progress, f"surveying, {builder.count / 1e6:.1f} M points")
        if simulation.stamp > _TIME_LIMIT:
            at = np.round(truth.map_from_base.position[:2], 1).tolist()
            raise SurveyError(f"the survey got stuck near {at}, {driver.progress:.0%} done")
    progress(1.0, f"thinning {builder.count / 1e6:.1f} M points")
    return builder.build(world.name)
