"""Map of a scene from a survey drive, whose poses are the simulator's ground truth.

The cloud contains only points that a beam has hit. It is a survey with a perfect total station, not SLAM.
"""

from __future__ import annotations

from collections.abc import Callable

from localization.mapping.cloud_builder import CloudBuilder, MappingConfig
from localization.mapping.wall_faces import lost_faces_warning
from localization.maps.cloud import Cloud
from localization.motion.deskew import deskew
from localization.motion.odometry_track import OdometryTrack
from localization.types import Scan
from robot_sim import Simulation, SimulationConfig, World
from robot_sim.floorplan.plan import CloudSpec
from teleop.world_building.survey_drive import Progress, survey_drive


def survey(
    world: World,
    *,
    seed: int = 0,
    sensors: SimulationConfig | None = None,
    progress: Progress = lambda share, text: None,
    warn: Callable[[str], None] = lambda line: None,
) -> Cloud:
    """Drive the world's survey route and return its cloud.

    Args:
        world: A scene with a survey route.
        seed: Seed of the sensor noise.
        sensors: Sensors and drive of the robot; the default ones if not given.
        progress: Called with the completed share and a line of text.
        warn: Called with one line if the map lacks one face of a wall that was seen from both sides.

    Raises:
        SurveyError: If the drive takes four times as long as the route's length requires.
    """
    simulation = Simulation(world, seed=seed, config=sensors)
    builder = CloudBuilder(mapping_config(world))
    track = OdometryTrack().extended(simulation.stamp, simulation.truth().map_from_base)
    waiting: list[Scan] = []
    for readings, pose in survey_drive(simulation, progress=progress):
        waiting += [r for r in readings if isinstance(r, Scan)]
        track = track.extended(simulation.stamp, pose)
        if waiting:
            builder.add(deskew(waiting, track, simulation.mounts, simulation.stamp), pose)
            waiting = []
    progress(1.0, f"thinning {builder.count / 1e6:.1f} M points")
    cloud = builder.build(world.name)
    if (warning := lost_faces_warning(builder.lost_faces)) is not None:
        warn(warning)
    return cloud


def mapping_config(world: World) -> MappingConfig:
    """Return the settings of the map that a world's plan requests, with neighbourhoods to match."""
    spec = world.plan.cloud if world.plan is not None else CloudSpec()
    return MappingConfig(
        spacing=spec.spacing,
        raw_spacing=0.25 * spec.spacing,
        plane_radius=min(max(0.09, spec.spacing), 0.15),
        highest=float("inf") if spec.highest is None else spec.highest,
    )
