"""The Pioneer 3-AT: its numbers, each with its source, and its body as a MuJoCo specification.

``base_link`` lies at the centre of rotation on the floor plane, x forward, z up (REP 105). The
contact recipe replaces MuJoCo's default contacts, under which a skid-steered robot hops and turns
at half its rate: a soft normal, slow friction damping and explicit pairs between each wheel and
each drivable surface. With it the yaw-rate ratio chi is the closed form of Coulomb friction.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

import mujoco

from localization.types import Pose

WHEELS: Final = ("front_left", "front_right", "rear_left", "rear_right")
"""Wheel joints and actuators, in the order in which rates are commanded."""

ROBOT_GROUP: Final = 3
"""Geom group of the robot, which its own lidars look through."""
OBSTACLE_BIT: Final = 1
"""Collision bit of everything a robot can bump into, and of the robot's own hull."""
HEADROOM: Final = 0.6
"""The robot is lower than this [m]: what hangs above can be seen but not bumped into."""
FLOOR_BIT: Final = 2
"""Collision bit of drivable surfaces: the hull lacks it, so that only the wheel pairs touch them."""


@dataclass(frozen=True, slots=True)
class P3AT:
    """Dimensions, masses and limits of the robot.

    Sources: [U] MobileRobots/amr-ros-config ``pioneer3at.urdf`` with its comments (parts as weighed),
    [A] ARIA parameters ``p3at-sh.p``, [W] Webots ``Pioneer3at.proto``. [D] stands for
    the makers' data sheets as quoted by others; these were not at hand.
    """

    wheel_radius: float = 0.111
    """[m], unloaded. [U]"""
    wheel_half_width: float = 0.0375
    """[m]. [U]"""
    track: float = 0.394
    """Distance of the left from the right contacts [m]. [U]"""
    wheelbase: float = 0.269
    """Distance of the front from the rear axle [m]. [U]"""
    wheel_mass: float = 1.4
    """[kg]. [U]"""
    chassis_mass: float = 14.2
    """18.6 kg without batteries, less four wheels [U]; 1.2 kg more make the 27 kg it rolls with [kg]."""
    battery_mass: float = 7.2
    """Three of 2.4 kg [kg]. [U]"""
    plate_mass: float = 0.5
    """Top plate of 0.1 kg [U] and the mast that carries the scanners [kg]."""
    scanner_mass: float = 1.1
    """One SICK LMS1xx [kg]. [D]"""
    length: float = 0.508
    """[m]. [W]"""
    height: float = 0.277
    """Top of the chassis [m]. [W]"""
    swing_radius: float = 0.34
    """Radius of the circle the robot turns in [m]. [D]"""
    wheel_torque: float = 12.0
    """Limit of one wheel [N m]; turning in place on tile asks for 3."""
    wheel_rate: float = 7.2
    """Limit of one wheel [rad/s], 0.8 m/s at the rim, the brochure's maximum."""
    rotor_inertia: float = 0.02
    """Reflected through the gear [kg m^2]."""
    friction: float = 0.7
    """Coulomb coefficient of the tyres on indoor floors, alike in both directions."""
    tyre_deflection: float = 0.00104
    """How far the loaded contacts give in the model below [m], measured at rest."""

    @property
    def chi(self) -> float:
        """Commanded over actual yaw rate of a wheel pair turning in place: ``1 + (a/b)^2``.

        Four Coulomb contacts at (+-a, +-b) make no yaw moment at exactly that ratio, whatever the
        speed, the load and the coefficient (ARIA's own ``DiffConvFactor`` says 1.493).
        """
        return 1.0 + (self.wheelbase / self.track) ** 2

    @property
    def effective_track(self) -> float:
        """Distance [m] that divides the difference of the rim speeds to give the yaw rate."""
        return self.chi * self.track

    @property
    def rolling_radius(self) -> float:
        """Metres rolled per radian: contacts act in the middle of their penetration [m]."""
        return self.wheel_radius - 0.5 * self.tyre_deflection

    @property
    def axle_height(self) -> float:
        """Height of the wheel centres above the floor, under load [m]."""
        return self.wheel_radius - self.tyre_deflection


MOUNTS: Final[Mapping[str, Pose]] = MappingProxyType(
    {
        "laser_horizontal": Pose.from_euler((0.125, 0.0, 0.40)),
        "laser_vertical": Pose.from_euler((-0.10, 0.0, 0.45), pitch=-math.pi / 2),
    }
)
"""``base_from_scanner``. The horizontal one stands where ARIA's ``p3at-sh.p`` has its LMS2xx; the
vertical one has its x axis at the zenith and sweeps the transverse plane."""

IMU_MOUNT: Final = Pose.from_euler((0.0, 0.0, 0.15))
"""``base_from_imu``: level, near the centre of mass."""

_FRONT = {"front": 1.0, "rear": -1.0}
_SIDE = {"left": 1.0, "right": -1.0}


def set_physics(spec: mujoco.MjSpec, *, timestep: float) -> None:
    """Set the solver up for the contact recipe; ``timestep`` in [s], stable up to 0.005."""
    option = spec.option
    option.timestep = timestep
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.impratio = 200.0
    # A robot that silently jumps back to its start is worse than one that stops with an error.
    option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET


def add_robot(spec: mujoco.MjSpec, surfaces: Iterable[str], robot: P3AT | None = None) -> None:
    """Add the robot, standing at the origin, with wheels that touch the named floor geoms."""
    robot = robot or P3AT()
    base = spec.worldbody.add_body(name="base_link")
    base.add_freejoint(name="base_link")
    base.add_site(name="imu_link", pos=IMU_MOUNT.position)
    _add_hull(base, robot)
    surfaces = tuple(surfaces)
    for wheel in WHEELS:
        _add_wheel(spec, base, wheel, robot)
        for surface in surfaces:
            _add_tyre_contact(spec, wheel, surface, robot)
    spec.add_sensor(
        name="accelerometer",
        type=mujoco.mjtSensor.mjSENS_ACCELEROMETER,
        objtype=mujoco.mjtObj.mjOBJ_SITE,
        objname="imu_link",
    )


def _add_hull(base: mujoco.MjsBody, robot: P3AT) -> None:
    """Chassis, batteries, plate and scanners: what has mass, and what bumps into furniture."""
    box, cylinder = mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_CYLINDER
    hull = {"group": ROBOT_GROUP, "contype": OBSTACLE_BIT, "conaffinity": OBSTACLE_BIT}
    inside = {"group": ROBOT_GROUP, "contype": 0, "conaffinity": 0}
    inner_half_width = 0.5 * robot.track - robot.wheel_half_width - 0.002
    base.add_geom(
        name="chassis",
        type=box,
        pos=(0.0, 0.0, 0.5 * (0.06 + robot.height)),
        size=(0.5 * robot.length, inner_half_width, 0.5 * (robot.height - 0.06)),
        mass=robot.chassis_mass,
        rgba=(0.75, 0.1, 0.1, 1.0),
        **hull,
    )
    # The batteries slide in their bay until they balance the scanners: chi falls when the centre of
    # mass leaves the wheels' centre.
    payload_moment = robot.scanner_mass * sum(m.position[0] for m in MOUNTS.values())
    base.add_geom(
        name="batteries",
        type=box,
        pos=(-payload_moment / robot.battery_mass, 0.0, 0.12),
        size=(0.10, 0.12, 0.05),
        mass=robot.battery_mass,
        **inside,
    )
    base.add_geom(
        name="plate",
        type=box,
        pos=(0.0, 0.0, robot.height + 0.03),
        size=(0.22, 0.18, 0.005),
        mass=robot.plate_mass,
        rgba=(0.1, 0.1, 0.1, 1.0),
        **hull,
    )
    for scanner, mount in MOUNTS.items():
        base.add_geom(
            name=f"{scanner}_housing",
            type=cylinder,
            pos=mount.position,
            quat=mount.quaternion_wxyz,
            size=(0.05, 0.06, 0.0),
            mass=robot.scanner_mass,
            rgba=(0.2, 0.3, 0.6, 1.0),
            **hull,
        )


def _add_wheel(spec: mujoco.MjSpec, base: mujoco.MjsBody, wheel: str, robot: P3AT) -> None:
    end, side = wheel.split("_")
    body = base.add_body(
        name=wheel,
        pos=(
            _FRONT[end] * 0.5 * robot.wheelbase,
            _SIDE[side] * 0.5 * robot.track,
            robot.axle_height,
        ),
    )
    body.add_joint(
        name=wheel,
        type=mujoco.mjtJoint.mjJNT_HINGE,
        axis=(0.0, 1.0, 0.0),
        armature=robot.rotor_inertia,
    )
    across = (math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0)
    # A narrow capsule touches the floor; its caps bulge, so a cylinder meets the furniture.
    body.add_geom(
        name=f"{wheel}_tyre",
        type=mujoco.mjtGeom.mjGEOM_CAPSULE,
        size=(robot.wheel_radius, 0.005, 0.0),
        quat=across,
        mass=0.0,
        group=ROBOT_GROUP,
        contype=0,
        conaffinity=0,
    )
    body.add_geom(
        name=f"{wheel}_hull",
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=(robot.wheel_radius, robot.wheel_half_width, 0.0),
        quat=across,
        mass=robot.wheel_mass,
        rgba=(0.15, 0.15, 0.15, 1.0),
        group=ROBOT_GROUP,
        contype=OBSTACLE_BIT,
        conaffinity=OBSTACLE_BIT,
    )
    motor = spec.add_actuator(
        name=wheel,
        target=wheel,
        trntype=mujoco.mjtTrn.mjTRN_JOINT,
        ctrlrange=(-robot.wheel_rate, robot.wheel_rate),
        forcerange=(-robot.wheel_torque, robot.wheel_torque),
        ctrllimited=True,
        forcelimited=True,
    )
    motor.set_to_intvelocity(kp=SERVO_STIFFNESS, kv=SERVO_DAMPING)
    motor.actlimited = True
    motor.actrange = (-1e6, 1e6)


SERVO_STIFFNESS: Final = 300.0
"""Of the position-integrating velocity servo that stands for the wheel's PID [N m/rad]."""
SERVO_DAMPING: Final = 20.0
"""[N m s/rad]."""


def _add_tyre_contact(spec: mujoco.MjSpec, wheel: str, surface: str, robot: P3AT) -> None:
    pair = spec.add_pair(name=f"{wheel}_on_{surface}")
    pair.geomname1 = f"{wheel}_tyre"
    pair.geomname2 = surface
    pair.condim = 3
    pair.friction = (robot.friction, robot.friction, 0.002, 0.0001, 0.0001)
    pair.solref = (0.02, 1.0)
    pair.solimp = (0.1, 0.1, 0.001, 0.5, 2.0)
    pair.solreffriction = (0.3, 1.0)
