"""Body of an arm as a MuJoCo specification: links, jaws and motors, in the robot's model.

Each joint has a servo that holds a set-point, with a torque of at most what the table's supply gives at stall. Its gain
is that torque over its dead band: a servo gives all it has at an error that its electronics just notice. Between two
ticks the set-point moves at an even rate, which is the motor's command; ``ArmPlant`` gives it.
"""

from __future__ import annotations

import math
from typing import Final

import mujoco

from robot_sim.arm.arm_table import JOINTS, ArmTable, Gripper, Joint
from robot_sim.arm.arm_touch import add_contact_counter
from robot_sim.arm.parts import ARM_BASE, JAWS, ArmBody, Solid, arm_bodies, inertial
from robot_sim.collision_bits import ARM_BIT, FLOOR_BIT, MOVER_BIT, OBSTACLE_BIT, ROBOT_GROUP

STOW: Final = "arm_stow"
"""Name of the numbers in a model that are the angles of the folded arm."""
STOP: Final = math.radians(3.0)
"""Way from a joint's limit, which its pulses do not exceed, to its mechanical stop [rad]; chosen."""
ROTOR_TIME: Final = 0.025
"""Time constant of a servo's motor with nothing on it [s], chosen: rotors of 1e-8 to 6e-8 kg m^2 behind gears of 250."""
JAW_STIFFNESS: Final = 1000.0
"""Gain of the gripper's servo [N/m]: all of its force at an error of 3 mm; chosen."""
JAW_ROTOR: Final = 0.05
"""Mass of the gripper's drive, as felt at a jaw [kg]; chosen."""
_DAMPING_RATIO: Final = 1.0
"""Damping of the set-points, over the critical one of the outstretched arm."""
_RIGID: Final = (0.008, 1.0)
"""Time constant [s] and damping ratio of what couples the jaws: two steps of the physics."""
_SPIN: Final = (0.005, 0.0001)
"""Friction of pads against spinning and rolling [m]: MuJoCo's."""
_COLOURS: Final = {
    "tube": (0.85, 0.85, 0.82, 1.0),
    "servo": (0.12, 0.12, 0.14, 1.0),
    "palm": (0.20, 0.30, 0.60, 1.0),
    "finger": (0.20, 0.30, 0.60, 1.0),
    "pad": (0.10, 0.10, 0.10, 1.0),
}


def add_arm(spec: mujoco.MjSpec, base: mujoco.MjsBody, table: ArmTable, mount: str) -> None:
    """Add an arm to a robot.

    Its parts collide with obstacles, the ground, movers and the vehicle. The gripper, the wrist and the forearm collide
    with the upper arm and what is below it, except for the neighbour; nothing else of the arm collides with itself.

    Args:
        spec: Specification that contains the robot.
        base: Its ``base_link``.
        table: The arm.
        mount: Where it is mounted, a key of the table's ``mounts``.

    Raises:
        ArmError: If there is no such mount; the message lists those there are.
    """
    place = table.mount(mount)
    bodies: dict[str, mujoco.MjsBody] = {}
    for part in arm_bodies(table):
        pose = place if part.name == ARM_BASE else part.pose
        parent = bodies.get(part.parent, base)
        body = bodies[part.name] = parent.add_body(
            name=part.name, pos=pose.position, quat=pose.quaternion_wxyz
        )
        if not part.solids:
            continue
        _set_inertia(body, part)
        reaches_back = part.name not in (ARM_BASE, *(link.name for link in table.links[1:3]))
        for number, solid in enumerate(part.solids):
            _add_solid(
                body, f"{part.name}_{solid.name}_{number}", solid, table.gripper, reaches_back
            )
        if part.slide is not None:
            _add_slide(body, part, table.gripper)
        if part.joint is not None:
            _add_hinge(spec, body, part.joint, table)
    _couple_jaws(spec, table.gripper)
    add_contact_counter(spec)
    spec.add_numeric(name=STOW, data=table.poses["stow"], size=JOINTS)


def arm_top(table: ArmTable, mount: str) -> float:
    """Return the greatest height that an arm reaches above the ground under the vehicle [m].

    Raises:
        ArmError: If there is no such mount.
    """
    upright, *others = table.joints
    shoulder = table.mount(mount).position[2] + table.links[0].length + upright.d
    return float(shoulder + sum(joint.a + joint.d for joint in others))


def fold_arm(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Put the arm of a model, if it has one, into its stow pose, with closed jaws; positions are not propagated."""
    number = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_NUMERIC, STOW)
    if number < 0:
        return
    start = int(model.numeric_adr[number])
    stow = model.numeric_data[start : start + JOINTS]
    # The links are one chain: their joints follow each other.
    base = int(model.body(ARM_BASE).id)
    first = int(model.jnt_qposadr[model.body_jntadr[base + 1]])
    data.qpos[first : first + JOINTS] = stow


def _set_inertia(body: mujoco.MjsBody, part: ArmBody) -> None:
    """Set mass and inertia from the part's own sum, so that the URDF has the same ones to the last digits."""
    whole = inertial(part)
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = whole.tensor
    body.explicitinertial = True
    body.mass, body.ipos = whole.mass, whole.centre
    body.fullinertia = (xx, yy, zz, xy, xz, yz)


def _add_solid(
    body: mujoco.MjsBody, name: str, solid: Solid, gripper: Gripper, reaches_back: bool
) -> None:
    touches = OBSTACLE_BIT | FLOOR_BIT
    if solid.shape == "cylinder":
        radius, length = solid.size
        kind, half = mujoco.mjtGeom.mjGEOM_CYLINDER, [radius, 0.5 * length, 0.0]
    else:
        kind, half = mujoco.mjtGeom.mjGEOM_BOX, [0.5 * side for side in solid.size]
    geom = body.add_geom(
        name=name,
        type=kind,
        pos=solid.pose.position,
        quat=solid.pose.quaternion_wxyz,
        size=half,
        mass=0.0,
        group=ROBOT_GROUP,
        contype=touches if reaches_back else touches | ARM_BIT,
        conaffinity=MOVER_BIT | ARM_BIT if reaches_back else MOVER_BIT,
        rgba=_COLOURS[solid.name],
    )
    if solid.name == "pad":
        # With priority the pad's own contact parameters are used.
        geom.priority = 1
        geom.friction = (gripper.pad_friction, *_SPIN)
        geom.solref = (gripper.pad_solref, 1.0)


def _add_hinge(spec: mujoco.MjSpec, body: mujoco.MjsBody, joint: Joint, table: ArmTable) -> None:
    stall = joint.servo.torque(table.supply)
    body.add_joint(
        name=joint.name,
        type=mujoco.mjtJoint.mjJNT_HINGE,
        axis=(0.0, 0.0, 1.0),
        limited=True,
        range=(math.degrees(joint.lower - STOP), math.degrees(joint.upper + STOP)),
        armature=ROTOR_TIME * stall / joint.servo.speed,
    )
    servo = spec.add_actuator(
        name=joint.name,
        target=joint.name,
        trntype=mujoco.mjtTrn.mjTRN_JOINT,
        forcelimited=True,
        forcerange=(-stall, stall),
    )
    servo.set_to_intvelocity(kp=stall / dead_angle(table, joint), dampratio=_DAMPING_RATIO)
    servo.actlimited = True
    servo.actrange = (joint.lower - STOP, joint.upper + STOP)


def dead_angle(table: ArmTable, joint: Joint) -> float:
    """Return the angle of a servo's dead band [rad]."""
    pulses = table.pulses
    return joint.servo.dead_band / (pulses.longest - pulses.shortest) * (joint.upper - joint.lower)


def _add_slide(body: mujoco.MjsBody, part: ArmBody, gripper: Gripper) -> None:
    body.add_joint(
        name=part.name,
        type=mujoco.mjtJoint.mjJNT_SLIDE,
        axis=part.slide,
        limited=True,
        range=(0.0, 0.5 * gripper.opening),
        armature=JAW_ROTOR,
    )


def _couple_jaws(spec: mujoco.MjSpec, gripper: Gripper) -> None:
    """Drive both jaws by one motor, whose position is the opening, so that they stay in the middle."""
    left, right = JAWS
    jaws = spec.add_tendon(name=gripper.joint)
    for jaw in JAWS:
        jaws.wrap_joint(jaw, 1.0)
    coupling = spec.add_equality(
        name=gripper.joint,
        type=mujoco.mjtEq.mjEQ_JOINT,
        objtype=mujoco.mjtObj.mjOBJ_JOINT,
        name1=right,
        name2=left,
        solref=_RIGID,
    )
    coupling.data[:2] = (0.0, 1.0)
    # The same force acts on both jaws.
    limit = 0.5 * gripper.force
    servo = spec.add_actuator(
        name=gripper.joint,
        target=gripper.joint,
        trntype=mujoco.mjtTrn.mjTRN_TENDON,
        forcelimited=True,
        forcerange=(-limit, limit),
    )
    servo.set_to_intvelocity(kp=JAW_STIFFNESS, dampratio=_DAMPING_RATIO)
    servo.actlimited = True
    servo.actrange = (-gripper.opening, 2.0 * gripper.opening)
