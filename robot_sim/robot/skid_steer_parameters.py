"""Parameters of a four-wheeled skid-steer robot: dimensions, masses, limits and imperfections."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from localization.types import Pose
from robot_sim.robot.imperfections import AS_DRAWN, Imperfections

_REFERENCE_LENGTH = 0.508
_REFERENCE_HEIGHT = 0.277
"""Length and height of the P3-AT, for which the mast was designed [m]."""
REFERENCE_HALF_WIDTH = 0.1575
"""``inner_half_width`` of the P3-AT, for which plate and batteries were drawn [m]."""
REFERENCE_HULL = 0.217
"""Height of the P3-AT above its clearance, for which the batteries were drawn [m]."""


@dataclass(frozen=True, slots=True)
class SkidSteer:
    """Dimensions, masses and limits of a robot; ``platforms`` has those of real ones.

    Drivetrain, encoders and localiser assume these nominal values. ``imperfections`` are the deviations
    of the physical robot, which only its body and the ground truth have.

    Raises:
        ValueError: a length, mass or limit is not finite and positive.
    """

    name: str
    """Name of the platform."""
    wheel_radius: float
    """Radius of an unloaded wheel [m]."""
    wheel_half_width: float
    """Half the width of a wheel [m]."""
    track: float
    """Distance between the left and the right contacts [m]."""
    wheelbase: float
    """Distance between the front and the rear axle [m]."""
    wheel_mass: float
    """Mass of one wheel [kg]."""
    chassis_mass: float
    """Mass without wheels, batteries, plate and scanners [kg]."""
    battery_mass: float
    """Mass of the batteries, which slide in their bay to balance the scanners [kg]."""
    plate_mass: float
    """Mass of top plate and mast [kg]."""
    scanner_mass: float
    """Mass of one scanner [kg]."""
    length: float
    """Length of the chassis [m]."""
    clearance: float
    """Height of the chassis' underside above the floor [m]."""
    height: float
    """Height of the chassis' top above the floor [m]."""
    swing_radius: float
    """Radius of the circle in which the robot turns in place [m]."""
    wheel_torque: float
    """Torque limit of one wheel [N m]."""
    wheel_rate: float
    """Rate limit of one wheel [rad/s]."""
    rotor_inertia: float
    """Inertia of a motor's rotor, reflected through the gear [kg m^2]."""
    friction: float
    """Coulomb coefficient of the tyres on a surface that declares none, the same in both directions."""
    tyre_deflection: float
    """Deflection of the loaded contacts in the model [m], measured at rest."""
    imperfections: Imperfections = AS_DRAWN
    """Deviations of this robot from the above."""

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            value = getattr(self, name)
            if isinstance(value, float) and not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"robot {self.name!r}: {name} must be > 0, got {value}")
        if self.height <= self.clearance:
            raise ValueError(
                f"robot {self.name!r}: height {self.height} must exceed clearance {self.clearance}"
            )

    @property
    def chi(self) -> float:
        """Commanded over actual yaw rate of a wheel pair turning in place: ``1 + (a/b)^2``.

        At exactly this ratio four Coulomb contacts at (+-a, +-b) make no yaw moment, whatever the speed,
        the load and the coefficient.
        """
        return 1.0 + (self.wheelbase / self.track) ** 2

    @property
    def effective_track(self) -> float:
        """Distance [m] that divides the difference of the rim speeds to give the yaw rate."""
        return self.chi * self.track

    @property
    def fastest_slip(self) -> float:
        """Speed of the contacts over the ground while spinning in place at full wheel rate [m/s]."""
        along, across = 1.0 - 1.0 / self.chi, self.wheelbase / self.track / self.chi
        return math.hypot(along, across) * self.wheel_rate * self.rolling_radius

    @property
    def rolling_radius(self) -> float:
        """Distance rolled per radian [m]: contacts act at half their penetration."""
        return self.wheel_radius - 0.5 * self.tyre_deflection

    @property
    def axle_height(self) -> float:
        """Height of the wheel centres above the floor, under load [m]."""
        scale = 0.5 * (self.imperfections.left_radius + self.imperfections.right_radius)
        return scale * self.wheel_radius - self.tyre_deflection

    @property
    def mass(self) -> float:
        """Total mass [kg]."""
        return (
            4.0 * self.wheel_mass
            + self.chassis_mass
            + self.battery_mass
            + self.plate_mass
            + 2.0 * self.scanner_mass
        )

    @property
    def half_width(self) -> float:
        """Half the width over the wheels [m]."""
        return 0.5 * self.track + self.wheel_half_width

    @property
    def inner_half_width(self) -> float:
        """Half the width of the chassis, which fits between the wheels [m]."""
        return 0.5 * self.track - self.wheel_half_width - 0.002

    @property
    def length_scale(self) -> float:
        """Length over that of a P3-AT, by which parts on the deck are spread."""
        return self.length / _REFERENCE_LENGTH

    @property
    def mounts(self) -> Mapping[str, Pose]:
        """``base_from_scanner`` of each scanner, on a mast as tall as the P3-AT's above the deck.

        On the P3-AT the horizontal one stands where ARIA's ``p3at-sh.p`` has its LMS2xx; the
        vertical one has its x axis at the zenith and sweeps the transverse plane.
        """
        s, deck = self.length_scale, self.height - _REFERENCE_HEIGHT
        return MappingProxyType(
            {
                "laser_horizontal": Pose.from_euler((0.125 * s, 0.0, 0.40 + deck)),
                "laser_vertical": Pose.from_euler(
                    (-0.10 * s, 0.0, 0.45 + deck), pitch=-math.pi / 2
                ),
            }
        )

    @property
    def imu_mount(self) -> Pose:
        """``base_from_imu``: level, near the centre of mass."""
        return Pose.from_euler((0.0, 0.0, 0.15 * self.height / _REFERENCE_HEIGHT))

    @property
    def camera_mount(self) -> Pose:
        """``base_from_camera`` of ``camera_link``: level, just above the front of the horizontal scanner.

        From there neither the scanner nor the deck nor a wheel is in the image of a camera that looks down
        by less than 65 degrees.
        """
        laser = self.mounts["laser_horizontal"].position
        return Pose.from_euler((float(laser[0]) + 0.04, 0.0, float(laser[2]) + 0.11))

    def true_rolling_radius(self, side: str) -> float:
        """Return the true distance per radian of the tyres of a side, ``left`` or ``right`` [m]."""
        scale = self.imperfections.radius_scale(side)
        return scale * self.wheel_radius - 0.5 * self.tyre_deflection
