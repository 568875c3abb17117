"""Options of a simulated robot and its world: sensors, drive, tyres, people, moved furniture.

The physics engine is imported when something is built, so that the command line can offer these options
without loading it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Final

from tyro.constructors import PrimitiveConstructorSpec

from teleop.errors import SettingError

if TYPE_CHECKING:
    from robot_sim import SimulationConfig, World
    from robot_sim.actors.extras import Extra
    from robot_sim.drive.drivetrain import SlipFault
    from robot_sim.scene_objects.parcels import Parcel


DEFAULT_ARM: Final = "s2"
"""The arm of ``--arm`` alone."""

_ONE_OR_NONE: Final = PrimitiveConstructorSpec[str | None](
    nargs=(0, 1),
    metavar="[NAME]",
    instance_from_str=lambda given: given[0] if given else DEFAULT_ARM,
    is_instance=lambda value: value is None or isinstance(value, str),
    str_from_instance=lambda value: [str(value)],
)


@dataclass(frozen=True, slots=True)
class RobotOptions:
    """Sensors, drive and tyres of the robot, and the state of its world."""

    scanner: str = "default"
    """Model of both scanners: sick_lms200, sick_lms200_cm, sick_lms111, hokuyo_utm30lx; by default an LMS1xx."""
    inertial: str = "default"
    """Model of the inertial unit: xsens_mti630, bosch_bmi088; by default a small MEMS unit."""
    effects: bool = False
    """Simulate beam effects: mixed pixels, dark and slanting surfaces, glass."""
    sun: float = 0.0
    """Daylight as a share of full sun, for the beam effects; 0 is indoors."""
    firmware: bool = False
    """Report wheel speeds as the P3-AT's own controller does, in ten packets a second."""
    uneven_tyres: bool = False
    """Use the tyre radii identified on a real P3-AT, which differ between left and right."""
    alive: bool = False
    """Simulate walking people, swinging doors and pushed carts."""
    rearranged: int | None = None
    """Seed by which furniture has moved since the map was made; unless given, it has not."""
    arm: Annotated[str | None, _ONE_OR_NONE] = None
    """Carry an arm: s2, or the path of a table like its; --arm alone is s2."""
    arm_mount: str = "bracket"
    """Where the arm is mounted: bracket, ahead of the front bumper, or plate, on the top plate."""
    arm_speed: float = 0.2
    """Largest speed of the robot while the arm is off its stow pose [m/s]; 0 for no such limit."""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.arm_speed) and self.arm_speed >= 0.0):
            raise SettingError(f"arm-speed must be >= 0 m/s, got {self.arm_speed:g}")

    def world(
        self,
        scene: str,
        seed: int = 0,
        extras: tuple[Extra, ...] = (),
        *,
        spare_boxes: tuple[tuple[float, float, float], ...] = (),
        spare_people: int = 0,
        parcels: tuple[Parcel, ...] = (),
    ) -> World:
        """Build a scene with this robot.

        Args:
            scene: Name of a scene, or path of a scene folder, a floor plan or an MJCF file.
            seed: Seed of the times at which people and doors move.
            extras: What comes into the world at its time.
            spare_boxes: Sizes of boxes that can be put into it while it runs [m].
            spare_people: Number of people that can.
            parcels: Small boxes that lie loose in it.

        Raises:
            SimulationError: If the scene is unknown or cannot be built.
        """
        from robot_sim import P3AT, WorldOptions, load_world
        from robot_sim.robot.imperfections import MANDOW_2007

        robot = P3AT()
        if self.uneven_tyres:
            robot = replace(robot, imperfections=MANDOW_2007)
        options = WorldOptions(
            alive=self.alive,
            rearranged=self.rearranged,
            timing=seed,
            extras=extras,
            spare_boxes=spare_boxes,
            spare_people=spare_people,
            parcels=parcels,
            arm=self.arm,
            arm_mount=self.arm_mount,
        )
        return load_world(scene, robot=robot, options=options)

    def simulation(self, slips: Sequence[SlipFault] = ()) -> SimulationConfig:
        """Return the settings of a simulation with these sensors and this drive.

        Args:
            slips: Injected faults of the encoders.

        Raises:
            SensorError: If there is no sensor of that name; the message lists those there are.
        """
        from robot_sim import DriveConfig, FirmwareConfig, SimulationConfig, sensor_suite

        suite = sensor_suite(self.scanner, self.inertial, realistic=self.effects, sun=self.sun)
        firmware = FirmwareConfig() if self.firmware else None
        return SimulationConfig(
            drive=DriveConfig(slips=tuple(slips), firmware=firmware),
            scanners=suite.scanners,
            inertial=suite.inertial,
        )


def check_slip_times(times: Sequence[float]) -> None:
    """Raise a SettingError unless all times of slip bursts [s] are finite and >= 0."""
    if not all(math.isfinite(t) and t >= 0.0 for t in times):
        raise SettingError(f"slip must hold times >= 0 s, got {tuple(times)}")


def slip_bursts(times: Sequence[float]) -> tuple[SlipFault, ...]:
    """Return faults of the encoders: at each time [s], wheels that spin at twice their speed for a second."""
    from localization.types import SECOND
    from robot_sim import SlipFault

    return tuple(SlipFault(round(t * SECOND), SECOND, 2.0) for t in times)
