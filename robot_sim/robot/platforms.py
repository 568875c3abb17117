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


@dataclass(frozen=True, slots=True)
class Husky(SkidSteer):
    """Clearpath Husky A200 with the same two scanners on a mast.

    Sources: [H] ``husky_description/urdf/husky.urdf.xacro`` and ``wheel.urdf.xacro``, [C]
    ``husky_control/config/control.yaml``, both of the public repository husky/husky.
    """

    name: str = "husky"
    """Name of the platform."""
    wheel_radius: float = 0.1651
    """Radius of an unloaded wheel [m]; source [H]."""
    wheel_half_width: float = 0.05715
    """Half the width of a wheel [m]; source [H]."""
    track: float = 0.5708
    """Distance between the left and the right contacts [m]; source [H]."""
    wheelbase: float = 0.512
    """Distance between the front and the rear axle [m]; source [H]."""
    wheel_mass: float = 2.637
    """Mass of one wheel [kg]; source [H]."""
    chassis_mass: float = 34.034
    """Mass without wheels, batteries, plate and scanners [kg]: 46.034 kg [H], less the batteries."""
    battery_mass: float = 12.0
    """Mass of the batteries, which slide in their bay to balance the scanners [kg]: chosen share of
    the above."""
    plate_mass: float = 0.5
    """Mass of top plate and mast [kg]: as on the P3-AT."""
    scanner_mass: float = 1.1
    """Mass of one scanner [kg]: as on the P3-AT."""
    length: float = 0.9874
    """Length of the chassis [m]; source [H]."""
    clearance: float = 0.13228
    """Height of the chassis' underside above the floor [m]: wheel radius less the wheels' offset of
    0.03282 m from the bottom plate. [H]"""
    height: float = 0.37978
    """Height of the chassis' top above the floor [m]: 0.2475 m above that. [H]"""
    swing_radius: float = 0.6
    """Radius of the circle in which the robot turns in place [m]: half the diagonal of 0.99 by 0.67
    m."""
    wheel_torque: float = 40.0
    """Torque limit of one wheel [N m]: chosen: turning in place on concrete asks for 15."""
    wheel_rate: float = 6.1
    """Rate limit of one wheel [rad/s]: 1 m/s at the rim, the maker's maximum."""
    rotor_inertia: float = 0.05
    """Inertia of a motor's rotor, reflected through the gear [kg m^2]: chosen."""
    friction: float = 0.7
    """Coulomb coefficient of the tyres on a surface that declares none, the same in both
    directions: as the P3-AT's."""
    tyre_deflection: float = 0.00109
    """Deflection of the loaded contacts in the model [m], measured at rest."""


@dataclass(frozen=True, slots=True)
class Jackal(SkidSteer):
    """Clearpath Jackal with the same two scanners on a mast.

    Sources: [J] ``jackal_description/urdf/jackal.urdf.xacro``, [C]
    ``jackal_control/config/control.yaml``, both of the public repository jackal/jackal.
    """

    name: str = "jackal"
    """Name of the platform."""
    wheel_radius: float = 0.098
    """Radius of an unloaded wheel [m]; source [J]."""
    wheel_half_width: float = 0.02
    """Half the width of a wheel [m]; source [J]."""
    track: float = 0.37559
    """Distance between the left and the right contacts [m]; source [J]."""
    wheelbase: float = 0.262
    """Distance between the front and the rear axle [m]; source [J]."""
    wheel_mass: float = 0.477
    """Mass of one wheel [kg]; source [J]."""
    chassis_mass: float = 12.523
    """Mass without wheels, batteries, plate and scanners [kg]: 16.523 kg [J], less the battery."""
    battery_mass: float = 4.0
    """Mass of the batteries, which slide in their bay to balance the scanners [kg]: chosen share of
    the above."""
    plate_mass: float = 0.5
    """Mass of top plate and mast [kg]: as on the P3-AT."""
    scanner_mass: float = 1.1
    """Mass of one scanner [kg]: as on the P3-AT."""
    length: float = 0.42
    """Length of the chassis [m]; source [J]."""
    clearance: float = 0.0635
    """Height of the chassis' underside above the floor [m]: wheel radius less the wheels' offset of
    0.0345 m from the bottom plate. [J]"""
    height: float = 0.2475
    """Height of the chassis' top above the floor [m]: 0.184 m above that. [J]"""
    swing_radius: float = 0.33
    """Radius of the circle in which the robot turns in place [m]: half the diagonal of 0.51 by 0.43
    m."""
    wheel_torque: float = 12.0
    """Torque limit of one wheel [N m]: chosen: turning in place on concrete asks for 2."""
    wheel_rate: float = 20.4
    """Rate limit of one wheel [rad/s]: 2 m/s at the rim. [C]"""
    rotor_inertia: float = 0.02
    """Inertia of a motor's rotor, reflected through the gear [kg m^2]: chosen."""
    friction: float = 0.7
    """Coulomb coefficient of the tyres on a surface that declares none, the same in both
    directions: as the P3-AT's."""
    tyre_deflection: float = 0.00117
    """Deflection of the loaded contacts in the model [m], measured at rest."""


HUSKY: Final = Husky()
JACKAL: Final = Jackal()
PLATFORMS: Final[Mapping[str, SkidSteer]] = MappingProxyType(
    {robot.name: robot for robot in (P3AT(), HUSKY, JACKAL)}
)
"""Robots by name."""
