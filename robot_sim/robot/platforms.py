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
    wheel_radius: float = 0.111
    """[U]"""
    wheel_half_width: float = 0.0375
    """[U]"""
    track: float = 0.394
    """[U]"""
    wheelbase: float = 0.269
    """[U]"""
    wheel_mass: float = 1.4
    """[U]"""
    chassis_mass: float = 14.2
    """18.6 kg without batteries, less four wheels [U]; 1.2 kg more make the 27 kg it rolls with."""
    battery_mass: float = 7.2
    """Three of 2.4 kg. [U]"""
    plate_mass: float = 0.5
    """Top plate of 0.1 kg [U] and the mast that carries the scanners."""
    scanner_mass: float = 1.1
    """One SICK LMS1xx. [D]"""
    length: float = 0.508
    """[W]"""
    clearance: float = 0.06
    """[D]"""
    height: float = 0.277
    """[W]"""
    swing_radius: float = 0.34
    """[D]"""
    wheel_torque: float = 12.0
    """Turning in place on tile asks for 3."""
    wheel_rate: float = 7.2
    """0.8 m/s at the rim, the brochure's maximum."""
    rotor_inertia: float = 0.02
    """Chosen."""
    friction: float = 0.7
    """Indoor floors."""
    tyre_deflection: float = 0.00105


@dataclass(frozen=True, slots=True)
class Husky(SkidSteer):
    """Clearpath Husky A200 with the same two scanners on a mast.

    Sources: [H] ``husky_description/urdf/husky.urdf.xacro`` and ``wheel.urdf.xacro``, [C]
    ``husky_control/config/control.yaml``, both of the public repository husky/husky.
    """

    name: str = "husky"
    wheel_radius: float = 0.1651
    """[H]"""
    wheel_half_width: float = 0.05715
    """[H]"""
    track: float = 0.5708
    """[H]"""
    wheelbase: float = 0.512
    """[H]"""
    wheel_mass: float = 2.637
    """[H]"""
    chassis_mass: float = 34.034
    """46.034 kg [H], less the batteries."""
    battery_mass: float = 12.0
    """Chosen share of the above."""
    plate_mass: float = 0.5
    """As on the P3-AT."""
    scanner_mass: float = 1.1
    """As on the P3-AT."""
    length: float = 0.9874
    """[H]"""
    clearance: float = 0.13228
    """Wheel radius less the wheels' offset of 0.03282 m from the bottom plate. [H]"""
    height: float = 0.37978
    """0.2475 m above that. [H]"""
    swing_radius: float = 0.6
    """Half the diagonal of 0.99 by 0.67 m."""
    wheel_torque: float = 40.0
    """Chosen: turning in place on concrete asks for 15."""
    wheel_rate: float = 6.1
    """1 m/s at the rim, the maker's maximum."""
    rotor_inertia: float = 0.05
    """Chosen."""
    friction: float = 0.7
    """As the P3-AT's."""
    tyre_deflection: float = 0.00109


@dataclass(frozen=True, slots=True)
class Jackal(SkidSteer):
    """Clearpath Jackal with the same two scanners on a mast.

    Sources: [J] ``jackal_description/urdf/jackal.urdf.xacro``, [C]
    ``jackal_control/config/control.yaml``, both of the public repository jackal/jackal.
    """

    name: str = "jackal"
    wheel_radius: float = 0.098
    """[J]"""
    wheel_half_width: float = 0.02
    """[J]"""
    track: float = 0.37559
    """[J]"""
    wheelbase: float = 0.262
    """[J]"""
    wheel_mass: float = 0.477
    """[J]"""
    chassis_mass: float = 12.523
    """16.523 kg [J], less the battery."""
    battery_mass: float = 4.0
    """Chosen share of the above."""
    plate_mass: float = 0.5
    """As on the P3-AT."""
    scanner_mass: float = 1.1
    """As on the P3-AT."""
    length: float = 0.42
    """[J]"""
    clearance: float = 0.0635
    """Wheel radius less the wheels' offset of 0.0345 m from the bottom plate. [J]"""
    height: float = 0.2475
    """0.184 m above that. [J]"""
    swing_radius: float = 0.33
    """Half the diagonal of 0.51 by 0.43 m."""
    wheel_torque: float = 12.0
    """Chosen: turning in place on concrete asks for 2."""
    wheel_rate: float = 20.4
    """2 m/s at the rim. [C]"""
    rotor_inertia: float = 0.02
    """Chosen."""
    friction: float = 0.7
    """As the P3-AT's."""
    tyre_deflection: float = 0.00117


HUSKY: Final = Husky()
JACKAL: Final = Jackal()
PLATFORMS: Final[Mapping[str, SkidSteer]] = MappingProxyType(
    {robot.name: robot for robot in (P3AT(), HUSKY, JACKAL)}
)
"""Robots by name."""
