"""Body of a skid-steer robot as a MuJoCo specification, and the parameters of its wheel contacts.

``base_link`` lies at the centre of rotation on the floor plane, x forward, z up (REP 105). The contact
parameters replace MuJoCo's defaults, with which a skid-steer robot hops and turns at half its rate: a
soft normal, slow friction damping and explicit pairs between each wheel and each drivable surface. With
them the yaw-rate ratio chi is that of the closed form for Coulomb friction.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Final

import mujoco

from robot_sim.arm.arm_table import ArmTable
from robot_sim.arm.body import add_arm
from robot_sim.collision_bits import (
    FLOOR_BIT as FLOOR_BIT,
    OBSTACLE_BIT as OBSTACLE_BIT,
    ROBOT_GROUP as ROBOT_GROUP,
)
from robot_sim.errors import ArmError
from robot_sim.robot.contact_sensors import add_contact_sensors
from robot_sim.robot.platforms import P3AT
from robot_sim.robot.skid_steer_parameters import REFERENCE_HALF_WIDTH, REFERENCE_HULL, SkidSteer
from robot_sim.robot.underbody import HULL_FRICTION, add_underbody

WHEELS: Final = ("front_left", "front_right", "rear_left", "rear_right")
"""Names of wheel joints and actuators, in the order in which rates are commanded."""
SIDES: Final = ("left", "right", "left", "right")
"""Side of each of ``WHEELS``."""

HEADROOM: Final = 0.6
"""Height above which geoms can be seen but not collided with [m]; the robot is lower."""

SERVO_STIFFNESS: Final = 300.0
"""Stiffness of the position-integrating velocity servo that models the wheel's PID [N m/rad]."""
SERVO_DAMPING: Final = 20.0
"""Damping of that servo [N m s/rad]; the whole gain of a servo without integral term."""
SERVO_LAG: Final = 0.01
"""Time constant of a servo without integral term [s]."""

NORMAL_IMPEDANCE: Final = 0.08
"""Impedance of the contacts' soft normal: at 0.1 a speed step overshoots at 4 ms, at 0.05 nothing
is gained."""
FRICTION_TO_NORMAL: Final = 200.0
"""Impedance ratio of friction for a P3-AT: holds it on slopes with less than 1 mm/s of creep."""
FRICTION_TIME: Final = 0.67
"""Time constant of friction over the fastest slip [s per m/s]. A contact that slides opens at a
speed in proportion to slip over this time; at 0.6 and below a spinning Husky lifts itself off the
ground."""

TYRE_HALF_LENGTH: Final = 0.005
"""Half the straight part of the capsule that touches the floor [m]: a narrow contact."""

_SLIDING = {"group": ROBOT_GROUP, "priority": 1, "friction": HULL_FRICTION}
"""Friction of the hull, which has priority over that of the other geom."""
_FRONT = {"front": 1.0, "rear": -1.0}
_SIDE = {"left": 1.0, "right": -1.0}


def set_physics(spec: mujoco.MjSpec, *, timestep: float, arm: bool = False) -> None:
    """Set the solver up for the contact parameters; ``timestep`` in [s], stable up to 0.005; ``arm`` for a robot with one."""
    option = spec.option
    option.timestep = timestep
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    # With as few constraints as four wheels have, a step takes a fifth to a quarter less than with
    # Newton's method. It is less symmetric: 30 s straight ahead end 0.1 mm to the side. Out of an arm's jaws a box creeps
    # with it, and is lost; ``ArmPlant`` uses it while the arm touches nothing.
    option.solver = mujoco.mjtSolver.mjSOL_NEWTON if arm else mujoco.mjtSolver.mjSOL_CG
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.impratio = FRICTION_TO_NORMAL
    # A silent reset to the start would be worse than an error.
    option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET


def friction_time(robot: SkidSteer) -> float:
    """Return the time constant of friction damping that keeps the robot's tyres down [s].

    It is proportional to the slip when the robot spins in place at full motor rate; 0.3 s for a P3-AT.
    """
    return FRICTION_TIME * robot.fastest_slip


def add_robot(
    spec: mujoco.MjSpec,
    surfaces: Iterable[str],
    robot: SkidSteer | None = None,
    arm: ArmTable | None = None,
    mount: str = "bracket",
) -> None:
    """Add a robot (a P3-AT by default) at the origin, with wheels that touch the named floor geoms.

    The friction of a surface is its geom's ``user`` attribute, ``MU_LONG MU_LAT``, or else the robot's.

    Args:
        spec: Specification of the world, with its floors.
        surfaces: Names of the geoms that it drives on.
        robot: Its parameters.
        arm: The arm that it carries, if it does.
        mount: Where, a key of the arm's ``mounts``.

    Raises:
        ArmError: The arm has no such mount, or is not made for this robot.
    """
    robot = robot or P3AT()
    base = spec.worldbody.add_body(name="base_link")
    base.add_freejoint(name="base_link")
    base.add_site(name="imu_link", pos=robot.imu_mount.position)
    _add_hull(base, robot)
    add_underbody(base, robot, group=ROBOT_GROUP, floor_bit=FLOOR_BIT)
    surfaces = tuple(surfaces)
    # Slower friction creeps more on slopes, stiffer friction less: the two cancel.
    spec.option.impratio = FRICTION_TO_NORMAL * friction_time(robot) / 0.3
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
    add_contact_sensors(spec, "base_link", WHEELS)
    if arm is not None:
        if robot.name != P3AT().name:
            raise ArmError(f"arm {arm.name!r} has mounts for a p3at only, not for a {robot.name}")
        add_arm(spec, base, arm, mount)


def _battery_position(robot: SkidSteer) -> tuple[float, float, float]:
    """Return the position of the batteries that balances the scanners, plus the offset of the mass.

    They can slide in their bay, because chi falls when the centre of mass is off the wheels' centre.
    """
    payload_moment = robot.scanner_mass * sum(m.position[0] for m in robot.mounts.values())
    lever = robot.mass / robot.battery_mass
    dx, dy, dz = robot.imperfections.com_offset
    floor = robot.clearance + 0.06 * (robot.height - robot.clearance) / REFERENCE_HULL
    return -payload_moment / robot.battery_mass + lever * dx, lever * dy, floor + lever * dz


def _add_hull(base: mujoco.MjsBody, robot: SkidSteer) -> None:
    """Add chassis, batteries, plate and scanners: the masses, and the shapes that collide."""
    box, cylinder = mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_CYLINDER
    hull = {**_SLIDING, "contype": OBSTACLE_BIT, "conaffinity": OBSTACLE_BIT}
    # Under the chassis the underbody touches the ground.
    both = OBSTACLE_BIT | FLOOR_BIT
    deck = {**_SLIDING, "contype": both, "conaffinity": both}
    inside = {"group": ROBOT_GROUP, "contype": 0, "conaffinity": 0}
    half_width, half_height = robot.inner_half_width, 0.5 * (robot.height - robot.clearance)
    long, wide = robot.length_scale, half_width / REFERENCE_HALF_WIDTH
    tall = half_height / (0.5 * REFERENCE_HULL)
    base.add_geom(
        name="chassis",
        type=box,
        pos=(0.0, 0.0, robot.clearance + half_height),
        size=(0.5 * robot.length, half_width, half_height),
        mass=robot.chassis_mass,
        rgba=(0.75, 0.1, 0.1, 1.0),
        **hull,
    )
    base.add_geom(
        name="batteries",
        type=box,
        pos=_battery_position(robot),
        size=(0.10 * long, 0.12 * wide, 0.05 * tall),
        mass=robot.battery_mass,
        **inside,
    )
    base.add_geom(
        name="plate",
        type=box,
        pos=(0.0, 0.0, robot.height + 0.03),
        size=(0.22 * long, 0.18 * wide, 0.005),
        mass=robot.plate_mass,
        rgba=(0.1, 0.1, 0.1, 1.0),
        **deck,
    )
    for scanner, mount in robot.mounts.items():
        base.add_geom(
            name=f"{scanner}_housing",
            type=cylinder,
            pos=mount.position,
            quat=mount.quaternion_wxyz,
            size=(0.05, 0.06, 0.0),
            mass=robot.scanner_mass,
            rgba=(0.2, 0.3, 0.6, 1.0),
            **deck,
        )


def _add_wheel(spec: mujoco.MjSpec, base: mujoco.MjsBody, wheel: str, robot: SkidSteer) -> None:
    end, side = wheel.split("_")
    radius = robot.wheel_radius * robot.imperfections.radius_scale(side)
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
        frictionloss=robot.imperfections.stiction,
        # Nearly hard, because otherwise a wheel that should stick would creep.
        solimp_friction=(0.999, 0.999, 0.001, 0.5, 2.0),
    )
    across = (math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0)
    # A narrow capsule touches the floor; its caps bulge, so a cylinder collides with furniture.
    body.add_geom(
        name=f"{wheel}_tyre",
        type=mujoco.mjtGeom.mjGEOM_CAPSULE,
        size=(radius, TYRE_HALF_LENGTH, 0.0),
        quat=across,
        mass=0.0,
        group=ROBOT_GROUP,
        contype=0,
        conaffinity=0,
    )
    body.add_geom(
        name=f"{wheel}_hull",
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=(radius, robot.wheel_half_width, 0.0),
        quat=across,
        mass=robot.wheel_mass,
        rgba=(0.15, 0.15, 0.15, 1.0),
        contype=OBSTACLE_BIT,
        conaffinity=OBSTACLE_BIT,
        **_SLIDING,
    )
    _add_servo(spec, wheel, robot)


def _add_servo(spec: mujoco.MjSpec, wheel: str, robot: SkidSteer) -> None:
    servo = spec.add_actuator(
        name=wheel,
        target=wheel,
        trntype=mujoco.mjtTrn.mjTRN_JOINT,
        ctrlrange=(-robot.wheel_rate, robot.wheel_rate),
        forcerange=(-robot.wheel_torque, robot.wheel_torque),
        ctrllimited=True,
        forcelimited=True,
    )
    if robot.imperfections.integral_control:
        servo.set_to_intvelocity(kp=SERVO_STIFFNESS, kv=SERVO_DAMPING)
        servo.actlimited = True
        servo.actrange = (-1e6, 1e6)
        return
    # Its activation is the lagged commanded rate: torque = kv (commanded rate - rate).
    servo.dyntype = mujoco.mjtDyn.mjDYN_FILTEREXACT
    servo.dynprm[0] = SERVO_LAG
    servo.gaintype = mujoco.mjtGain.mjGAIN_FIXED
    servo.gainprm[0] = SERVO_DAMPING
    servo.biastype = mujoco.mjtBias.mjBIAS_AFFINE
    servo.biasprm[2] = -SERVO_DAMPING


def _add_tyre_contact(spec: mujoco.MjSpec, wheel: str, surface: str, robot: SkidSteer) -> None:
    mu_lat, mu_long = _friction_of(spec.geom(surface), robot)
    pair = spec.add_pair(name=f"{wheel}_on_{surface}")
    pair.geomname1 = f"{wheel}_tyre"
    pair.geomname2 = surface
    pair.condim = 3
    # A capsule's contact frame has its first tangent along the capsule, which is across the wheel.
    pair.friction = (mu_lat, mu_long, 0.002, 0.0001, 0.0001)
    pair.solref = (0.019, 1.0)
    pair.solimp = (NORMAL_IMPEDANCE, NORMAL_IMPEDANCE, 0.001, 0.5, 2.0)
    pair.solreffriction = (friction_time(robot), 1.0)


def _friction_of(ground: mujoco.MjsGeom, robot: SkidSteer) -> tuple[float, float]:
    """Return the friction across and along the wheel; except on planes both are their mean.

    MuJoCo aligns a capsule's contact frame with the capsule on planes only.
    """
    user = [float(v) for v in ground.userdata]
    mu_long = user[0] if user and user[0] > 0.0 else robot.friction
    mu_lat = user[1] if len(user) > 1 and user[1] > 0.0 else mu_long
    if ground.type == mujoco.mjtGeom.mjGEOM_PLANE:
        return mu_lat, mu_long
    even = 0.5 * (mu_lat + mu_long)
    return even, even
