"""Preparation of a user's MJCF file for the robot: attributes, options and collision bits.

A geom is drivable if it has ``user="MU"`` or ``user="MU_LONG MU_LAT ROLLING"``. A file needs no more than
that attribute and a site or body named ``spawn``. Everything else in it is kept: bodies
with joints move, doors hang on their hinges, materials and lights stay.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import mujoco

from robot_sim.actors.actor_bodies import MovingBody
from robot_sim.arm.arm_table import ArmTable
from robot_sim.errors import WorldError
from robot_sim.robot.bumper_geom import add_bumper
from robot_sim.robot.drivable_surfaces import drivable_geoms
from robot_sim.robot.mujoco_body import FLOOR_BIT, OBSTACLE_BIT, ROBOT_GROUP, add_robot, set_physics
from robot_sim.robot.skid_steer_parameters import SkidSteer

_SHIFT: Final = 2
"""Number of bits by which the file's own collision bits are shifted, past the two that we use."""
_BITS: Final = 0x0FFFFFFF
"""Mask of the collision bits that are kept: shifted, they stay below the movers' bit."""
_SPARE_GROUP: Final = 4
"""Group for the file's geoms that are in the robot's own group, which its scanners ignore."""
_LISTED: Final = 12
_RECIPE: Final = ("timestep", "integrator", "solver", "cone", "impratio")
"""Options on which the wheels' contact parameters depend; they are overridden."""
_ENUMS: Final = {
    "integrator": mujoco.mjtIntegrator,
    "solver": mujoco.mjtSolver,
    "cone": mujoco.mjtCone,
}
_HEEDED: Final = ("gravity", "wind", "density", "viscosity", "magnetic")
"""Options that are taken from the file."""
_CRIPPLING: Final = {
    "contact": mujoco.mjtDisableBit.mjDSBL_CONTACT,
    "constraint": mujoco.mjtDisableBit.mjDSBL_CONSTRAINT,
    "gravity": mujoco.mjtDisableBit.mjDSBL_GRAVITY,
    "actuation": mujoco.mjtDisableBit.mjDSBL_ACTUATION,
    "sensor": mujoco.mjtDisableBit.mjDSBL_SENSOR,
}
"""Flags that disable parts of the physics without which the robot cannot drive."""


@dataclass(frozen=True, slots=True, eq=False)
class MjcfModel:
    """A user's file compiled with the robot in it."""

    model: mujoco.MjModel
    """The compiled model."""
    surfaces: tuple[str, ...]
    """Names of the drivable geoms."""
    notes: tuple[str, ...]
    """Settings of the file that were overridden or ignored, one line each."""


def compile_mjcf(
    path: Path,
    robot: SkidSteer,
    *,
    timestep: float,
    bodies: Sequence[MovingBody] = (),
    arm: ArmTable | None = None,
    mount: str = "bracket",
) -> MjcfModel:
    """Read a file, add the robot to it, and compile both.

    Args:
        path: Path of the MJCF file.
        robot: Robot to add.
        timestep: Physics time step [s].
        bodies: Bodies to add that come at their time.
        arm: The arm that the robot carries, if it does.
        mount: Where.

    Raises:
        WorldError: the file cannot be read or compiled (the message includes MuJoCo's), nothing in it
            is drivable, or it uses a name of a part of the robot.
        ArmError: the arm has no such mount, or is not made for this robot.
    """
    if not path.is_file():
        raise WorldError(f"there is no file {str(path)!r}")
    try:
        child = mujoco.MjSpec.from_file(str(path))
    except ValueError as error:
        raise WorldError(_one_line(error)) from None
    _name_geoms(child)
    surfaces = _surfaces(child)
    _refuse_our_names(child, robot, arm, mount)
    spec = mujoco.MjSpec()
    set_physics(spec, timestep=timestep, arm=arm is not None)
    notes = [*_take_options(child, spec), *_prepare_geoms(child), *_leave_out(child)]
    # Attached, the file keeps its own defaults and compiler settings, and the robot is free of them.
    spec.attach(child, prefix="", frame=spec.worldbody.add_frame())
    for body in bodies:
        body.add_to(spec)
    add_robot(spec, surfaces=surfaces, robot=robot, arm=arm, mount=mount)
    if not all(body.hard for body in bodies):
        add_bumper(spec, robot)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            model = spec.compile()
        except ValueError as error:
            raise WorldError(_one_line(error)) from None
    notes += [_one_line(w.message) for w in caught if "empty prefix" not in str(w.message)]
    return MjcfModel(model, surfaces, tuple(notes))


def _one_line(error: object) -> str:
    return " ".join(str(error).split())


def _name_geoms(spec: mujoco.MjSpec) -> None:
    """Name unnamed geoms, because messages and contact pairs refer to names."""
    taken = {geom.name for geom in spec.geoms}
    for number, geom in enumerate(spec.geoms):
        if not geom.name:
            name = f"{geom.parent.name}_geom_{number}"
            while name in taken:
                name += "_"
            taken.add(name)
            geom.name = name


def _surfaces(spec: mujoco.MjSpec) -> tuple[str, ...]:
    for geom in spec.geoms:
        user = [float(v) for v in geom.userdata]
        if not any(user):
            continue
        sound = all(map(math.isfinite, user)) and user[0] > 0.0 <= min(user)
        if not sound or len(user) not in (1, 3):
            values = " ".join(f"{v:g}" for v in user)
            raise WorldError(
                f'geom {geom.name!r}: user must be one number, friction, as in user="0.7", or three,'
                " friction along and across the wheel and rolling resistance, as in"
                f' user="0.7 0.6 0.02", got "{values}"'
            )
    surfaces = tuple(geom.name for geom in drivable_geoms(spec))
    if not surfaces:
        names = [geom.name for geom in spec.geoms]
        listed = ", ".join(names[:_LISTED]) + (", ..." if len(names) > _LISTED else "")
        raise WorldError(
            'no geom is drivable: give what the robot drives on its friction, as in user="0.7";'
            f" there are: {listed or 'no geoms at all'}"
        )
    return surfaces


def _refuse_our_names(
    spec: mujoco.MjSpec, robot: SkidSteer, arm: ArmTable | None, mount: str
) -> None:
    ours = mujoco.MjSpec()
    ours.worldbody.add_geom(name="ground", type=mujoco.mjtGeom.mjGEOM_PLANE, size=(1, 1, 1))
    add_robot(ours, surfaces=("ground",), robot=robot, arm=arm, mount=mount)
    kinds = (
        *("bodies", "joints", "geoms", "sites", "actuators", "sensors"),
        *("tendons", "equalities", "numerics"),
    )
    for kind in kinds:
        taken = {each.name for each in getattr(ours, kind)} - {"world", "ground", ""}
        for each in getattr(spec, kind):
            if each.name in taken:
                singular = {"bodies": "body", "equalities": "equality"}.get(kind, kind[:-1])
                raise WorldError(
                    f"{singular} {each.name!r} has the name of a part of the robot, which joins the"
                    " file: give it another"
                )


def _take_options(child: mujoco.MjSpec, spec: mujoco.MjSpec) -> Iterator[str]:
    """Copy the options that may differ, override the others, and yield a note for each override."""
    usual = mujoco.MjSpec().option
    for key in _RECIPE:
        said, wanted = getattr(child.option, key), getattr(spec.option, key)
        if said != getattr(usual, key) and said != wanted:
            yield f"option {key} is {_option_text(key, wanted)}, not {_option_text(key, said)}: the wheels' contacts rest on it"
        setattr(child.option, key, wanted)
    for key in _HEEDED:
        setattr(spec.option, key, getattr(child.option, key))
    if not child.option.gravity[2] < -0.5:
        x, y, z = child.option.gravity
        raise WorldError(f"gravity must hold the robot down, got {x:g} {y:g} {z:g} m/s^2")
    for name, bit in _CRIPPLING.items():
        if child.option.disableflags & int(bit):
            yield f"flag {name} is enabled: without it nothing drives"
    if child.option.enableflags & int(mujoco.mjtEnableBit.mjENBL_OVERRIDE):
        yield "flag override is disabled: it would replace the wheels' contacts"
    child.option.disableflags = spec.option.disableflags
    child.option.enableflags = spec.option.enableflags


def _option_text(key: str, value: float) -> str:
    """Return an option's value as a file would have it."""
    if key not in _ENUMS:
        return f"{value:g}"
    return str(_ENUMS[key](value).name.rsplit("_", 1)[1].lower())


def _prepare_geoms(spec: mujoco.MjSpec) -> Iterator[str]:
    """Adapt groups and collision bits to ours.

    The file's own bits are only shifted, so that the same pairs collide as before. The robot's hull
    collides with all solid geoms but not with drivable surfaces, on which the other geoms rest.
    """
    drivable = {geom.name for geom in drivable_geoms(spec)}
    moved = 0
    for geom in spec.geoms:
        if geom.group == ROBOT_GROUP:
            geom.group = _SPARE_GROUP
            moved += 1
        if geom.name in drivable:
            geom.contype = geom.conaffinity = FLOOR_BIT
            if geom.type == mujoco.mjtGeom.mjGEOM_MESH:
                yield f"drivable mesh {geom.name!r} is driven on as its convex hull"
        elif geom.contype or geom.conaffinity:
            geom.contype = (geom.contype & _BITS) << _SHIFT
            geom.conaffinity = (geom.conaffinity & _BITS) << _SHIFT | OBSTACLE_BIT | FLOOR_BIT
    if moved:
        yield f"{moved} geoms of group {ROBOT_GROUP}, the robot's own, are in group {_SPARE_GROUP}"


def _leave_out(spec: mujoco.MjSpec) -> Iterator[str]:
    if spec.keys:
        yield "keyframes are left out: they do not include the robot"
    for key in list(spec.keys):
        spec.delete(key)
    if len(spec.actuators):
        yield f"{len(spec.actuators)} actuators of the file get no commands"
    if spec.compiler.settotalmass > 0.0:
        yield "compiler settotalmass is not applied: it would rescale the robot"
