"""What a simulated robot is fitted out with, and what kind of day it is where it drives.

The heavy imports wait until something is built, so that the command line can offer these settings
without loading a physics engine.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from robot_sim import SimulationConfig, World
    from robot_sim.drive.drivetrain import SlipFault


@dataclass(frozen=True, slots=True)
class RobotOptions:
    """Sensors, drive and tyres of the robot, and the state of its world; the default is the plain one."""

    scanner: str = "default"
    """Model of both scanners: sick_lms200, sick_lms111, hokuyo_utm30lx; an LMS1xx at 10 Hz by default."""
    inertial: str = "default"
    """Model of the inertial unit: xsens_mti630, bosch_bmi088; a small MEMS unit by default."""
    effects: bool = False
    """Whether the scanners' light does what light does: mixed pixels, dark and slanting surfaces, glass."""
    sun: float = 0.0
    """Daylight as a share of full sun, for the effects; 0 is indoors."""
    firmware: bool = False
    """Whether wheels are reported as the P3-AT's own controller does, in ten packets a second."""
    uneven_tyres: bool = False
    """Whether the tyres roll as those identified on a real P3-AT, left unlike right."""
    alive: bool = False
    """Whether people walk about, doors swing and carts are pushed."""
    rearranged: int | None = None
    """Seed by which furniture was moved since the map was made; None leaves it in its place."""

    def world(self, scene: str, seed: int = 0) -> World:
        """Build a scene with such a robot, on such a day.

        Args:
            scene: name of a scene, or the path of a folder, a floor plan or an MJCF file.
            seed: of when those who live there are where.
        """
        from robot_sim import P3AT, WorldOptions, load_world
        from robot_sim.robot.imperfections import MANDOW_2007

        robot = P3AT()
        if self.uneven_tyres:
            robot = replace(robot, imperfections=MANDOW_2007)
        options = WorldOptions(alive=self.alive, rearranged=self.rearranged, timing=seed)
        return load_world(scene, robot=robot, options=options)

    def simulation(self, slips: Sequence[SlipFault] = ()) -> SimulationConfig:
        """Return the settings of a simulation with such sensors and such a drive.

        Args:
            slips: faults of the encoders.

        Raises:
            SensorError: a sensor of that name does not exist; the message lists those that do.
        """
        from robot_sim import DriveConfig, FirmwareConfig, SimulationConfig, sensor_suite

        suite = sensor_suite(self.scanner, self.inertial, realistic=self.effects, sun=self.sun)
        firmware = FirmwareConfig() if self.firmware else None
        return SimulationConfig(
            drive=DriveConfig(slips=tuple(slips), firmware=firmware),
            scanners=suite.scanners,
            inertial=suite.inertial,
        )
