"""Parameters of real robots with their sources: Pioneer 3-AT, Husky A200, Jackal."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from robot_sim.robot.skid_steer_parameters import SkidSteer


@dataclass(frozen=True, slots=True)
class P3AT(SkidSteer):
    """Pioneer 3-AT.

    Sources: [U] MobileRobots/amr-ros-config ``pioneer3at.urdf`` with its comments (parts as weighed),
    [A] ARIA parameters ``p3at-sh.p``, [W] Webots ``Pioneer3at.proto``. [D] stands for
    the makers' data sheets as quoted by others; these were not at hand.
    """

    name: str = "p3at"
    """Name of the platform."""
    wheel_radius: float = 0.111
    """Radius of an unloaded wheel [m]; source [U]."""
    wheel_half_width: float = 0.0375
    """Half the width of a wheel [m]; source [U]."""
    track: float = 0.394
    """Distance between the left and the right contacts [m]; source [U]."""
    wheelbase: float = 0.269
    """Distance between the front and the rear axle [m]; source [U]."""
    wheel_mass: float = 1.4
    """Mass of one wheel [kg]; source [U]."""
    chassis_mass: float = 14.2
    """Mass without wheels, batteries, plate and scanners [kg]: 18.6 kg without batteries, less four
    wheels [U]; 1.2 kg more make the 27 kg it rolls with."""
    battery_mass: float = 7.2
    """Mass of the batteries, which slide in their bay to balance the scanners [kg]: three of 2.4
    kg. [U]"""
    plate_mass: float = 0.5
    """Mass of top plate and mast [kg]: top plate of 0.1 kg [U] and the mast that carries the
    scanners."""
    scanner_mass: float = 1.1
    """Mass of one scanner [kg]: one SICK LMS1xx. [D]"""
    length: float = 0.508
    """Length of the chassis [m]; source [W]."""
    clearance: float = 0.06
    """Height of the chassis' underside above the floor [m]; source [D]."""
    height: float = 0.277
    """Height of the chassis' top above the floor [m]; source [W]."""
    swing_radius: float = 0.34
    """Radius of the circle in which the robot turns in place [m]; source [D]."""
    wheel_torque: float = 12.0
    """Torque limit of one wheel [N m]: turning in place on tile asks for 3."""
    wheel_rate: float = 7.2
    """Rate limit of one wheel [rad/s]: 0.8 m/s at the rim, the brochure's maximum."""
    rotor_inertia: float = 0.02
    """Inertia of a motor's rotor, reflected through the gear [kg m^2]: chosen."""
    friction: float = 0.7
    """Coulomb coefficient of the tyres on a surface that declares none, the same in both
    directions: indoor floors."""
    tyre_deflection: float = 0.00105
    """Deflection of the loaded contacts in the model [m], measured at rest."""


HUSKY: Final = SkidSteer(
    name="husky",
    wheel_radius=0.1651,  # [H], as are the next four
    wheel_half_width=0.05715,
    track=0.5708,
    wheelbase=0.512,
    wheel_mass=2.637,
    chassis_mass=34.034,  # 46.034 kg [H], less the batteries
    battery_mass=12.0,  # chosen share of the above
    plate_mass=0.5,  # as on the P3-AT
    scanner_mass=1.1,  # as on the P3-AT
    length=0.9874,  # [H]
    clearance=0.13228,  # wheel radius less the wheels' offset of 0.03282 m from the bottom plate [H]
    height=0.37978,  # 0.2475 m above that [H]
    swing_radius=0.6,  # half the diagonal of 0.99 by 0.67 m
    wheel_torque=40.0,  # chosen: turning in place on concrete asks for 15
    wheel_rate=6.1,  # 1 m/s at the rim, the maker's maximum
    rotor_inertia=0.05,  # chosen
    friction=0.7,  # as the P3-AT's
    tyre_deflection=0.00109,
)
"""Clearpath Husky A200 with the same two scanners on a mast.

Sources: [H] ``husky_description/urdf/husky.urdf.xacro`` and ``wheel.urdf.xacro``, [C]
``husky_control/config/control.yaml``, both of the public repository husky/husky.
"""

JACKAL: Final = SkidSteer(
    name="jackal",
    wheel_radius=0.098,  # [J], as are the next four
    wheel_half_width=0.02,
    track=0.37559,
    wheelbase=0.262,
    wheel_mass=0.477,
    chassis_mass=12.523,  # 16.523 kg [J], less the battery
    battery_mass=4.0,  # chosen share of the above
    plate_mass=0.5,  # as on the P3-AT
    scanner_mass=1.1,  # as on the P3-AT
    length=0.42,  # [J]
    clearance=0.0635,  # wheel radius less the wheels' offset of 0.0345 m from the bottom plate [J]
    height=0.2475,  # 0.184 m above that [J]
    swing_radius=0.33,  # half the diagonal of 0.51 by 0.43 m
    wheel_torque=12.0,  # chosen: turning in place on concrete asks for 2
    wheel_rate=20.4,  # 2 m/s at the rim [C]
    rotor_inertia=0.02,  # chosen
    friction=0.7,  # as the P3-AT's
    tyre_deflection=0.00117,
)
"""Clearpath Jackal with the same two scanners on a mast.

Sources: [J] ``jackal_description/urdf/jackal.urdf.xacro``, [C]
``jackal_control/config/control.yaml``, both of the public repository jackal/jackal.
"""

PLATFORMS: Final[Mapping[str, SkidSteer]] = MappingProxyType(
    {robot.name: robot for robot in (P3AT(), HUSKY, JACKAL)}
)
"""Robots by name."""
