"""The numbers of an arm, from its file in ``assets/arms``: geometry, masses, servos, limits and named poses."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

from localization.types import Pose
from robot_sim.errors import ArmError

KGF_CM: Final = 0.0980665
"""One kgf cm [N m]."""
JOINTS: Final = 5
"""Number of joints of an arm, without its gripper."""

_ALPHAS: Final = (90.0, 0.0, 90.0, -90.0, 0.0)
"""Angles between the axes of joints that turn yaw, shoulder, elbow, wrist roll and wrist pitch [deg]."""

Angles = tuple[float, float, float, float, float]
"""An angle of each joint [rad]."""


@dataclass(frozen=True, slots=True)
class Servo:
    """A hobby servo."""

    like: str
    """The product whose sheet its numbers are from."""
    mass: float
    """Mass [kg]."""
    stall: Mapping[float, float]
    """Stall torque [N m] by supply voltage [V]."""
    speed: float
    """Speed without load [rad/s]."""
    dead_band: float
    """Change of a pulse that it does not follow [s]."""
    play: float
    """Play of its gear, from stop to stop [rad]."""
    size: tuple[float, float, float]
    """Length, width and height of its case [m]."""

    def torque(self, supply: float) -> float:
        """Return the stall torque at a supply voltage [V], between those of the sheet [N m]."""
        (low, weak), *_, (high, strong) = sorted(self.stall.items())
        return weak + (strong - weak) * (supply - low) / (high - low)


@dataclass(frozen=True, slots=True)
class Joint:
    """A joint: a row of the Denavit-Hartenberg table, its limits and its servo."""

    name: str
    """Name, in messages and models."""
    turns: str
    """What it turns, for people."""
    theta: float
    """Angle about z at the joint's zero [rad]."""
    d: float
    """Distance along z [m]."""
    a: float
    """Distance along x [m]."""
    alpha: float
    """Angle about x [rad]."""
    lower: float
    """Smallest angle [rad]."""
    upper: float
    """Largest angle [rad]."""
    servo: Servo
    """What moves it."""


@dataclass(frozen=True, slots=True)
class Link:
    """A link, whose mass acts at half its length."""

    name: str
    """Name of its frame."""
    length: float
    """Length [m]."""
    mass: float
    """Mass [kg], without servos."""
    radius: float
    """Radius of its shape [m]."""


@dataclass(frozen=True, slots=True)
class Pulses:
    """Pulses by which servos are commanded."""

    shortest: float
    """Width of the pulse for the lower limit [s]."""
    longest: float
    """Width of the pulse for the upper limit [s]."""
    frame: float
    """Time between two pulses [s]."""


@dataclass(frozen=True, slots=True)
class Holding:
    """Shares of its stall torque that a servo stands."""

    long: float
    """For as long as one likes."""
    short: float
    """For ``short_time``."""
    short_time: float
    """[s]."""


@dataclass(frozen=True, slots=True)
class MotionLimits:
    """Bounds of every commanded motion of a joint."""

    speed: float
    """[rad/s]."""
    acceleration: float
    """[rad/s^2]."""
    jerk: float
    """[rad/s^3]."""


@dataclass(frozen=True, slots=True)
class Gripper:
    """Two parallel jaws that one servo moves."""

    joint: str
    """Name of the joint; its position is the opening [m]."""
    opening: float
    """Widest distance between the pads [m]."""
    force: float
    """Largest force of the jaws together [N]."""
    speed: float
    """Speed of the opening [m/s]."""
    finger: float
    """Length of a finger up to the tip [m]."""
    jaw_mass: float
    """Mass of a jaw, which the last link's contains [kg]."""
    pad: tuple[float, float, float]
    """Half sizes of a pad ahead, across and up [m]."""
    pad_friction: float
    """Coulomb coefficient of the pads."""
    pad_solref: float
    """Time constant of their contacts [s]."""


@dataclass(frozen=True, slots=True)
class ArmTable:
    """An arm; ``load_arm`` reads one.

    Frames: ``arm_base`` below the base link, x ahead, z up; frame 0 at the base link's upper end; frames 1 to 5 by the
    Denavit-Hartenberg rows; ``tool0`` at the tip, x along the gripper, z up where the arm lies straight ahead (REP 103).
    """

    name: str
    """Name of its file."""
    title: str
    """A line for people."""
    supply: float
    """Supply voltage of its servos [V]."""
    joints: tuple[Joint, ...]
    """The five joints, from the base."""
    links: tuple[Link, ...]
    """The base link and links 1 to 5."""
    pulses: Pulses
    """Pulses of the servos."""
    holding: Holding
    """What the servos stand."""
    motion: MotionLimits
    """Bounds of every commanded motion."""
    gripper: Gripper
    """Its gripper."""
    mounts: Mapping[str, Pose]
    """``base_from_arm_base`` of each place where it can be mounted."""
    poses: Mapping[str, Angles]
    """Named poses; ``stow`` among them."""

    @property
    def mass(self) -> float:
        """Mass of links and servos [kg]."""
        return sum(k.mass for k in self.links) + sum(j.servo.mass for j in self.joints)

    @property
    def lower(self) -> Angles:
        """Smallest angles [rad]."""
        return _five(joint.lower for joint in self.joints)

    @property
    def upper(self) -> Angles:
        """Largest angles [rad]."""
        return _five(joint.upper for joint in self.joints)

    def mount(self, name: str) -> Pose:
        """Return ``base_from_arm_base`` of one of its mounts.

        Raises:
            ArmError: If there is none of this name; the message lists them.
        """
        if name not in self.mounts:
            known = ", ".join(self.mounts)
            raise ArmError(f"no mount {name!r} of arm {self.name!r}; there are: {known}")
        return self.mounts[name]


def arm_names() -> tuple[str, ...]:
    """Return the names of the arms that come with the project."""
    return tuple(sorted(path.stem for path in _folder().glob("*.toml")))


@cache
def load_arm(name: str = "s2") -> ArmTable:
    """Read an arm.

    Args:
        name: Name of an arm that comes with the project, or the path of a file like theirs.

    Raises:
        ArmError: If there is no such arm, or its file is invalid; the message names the field.
    """
    path = Path(name) if name.endswith(".toml") else _folder() / f"{name}.toml"
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        known = ", ".join(arm_names())
        raise ArmError(
            f"no arm {name!r}; there are: {known}, or the path of a .toml file"
        ) from None
    try:
        return _table(tomllib.loads(text))
    except tomllib.TOMLDecodeError as error:
        raise ArmError(f"{path}: {error}") from None
    except KeyError as error:
        raise ArmError(f"{path}: {error.args[0]} is missing") from None
    except (TypeError, ValueError, AttributeError) as error:
        raise ArmError(f"{path}: {error}") from None


def _folder() -> Path:
    package = Path(__file__).parents[2]
    installed = package / "teleop" / "assets" / "arms"
    return installed if installed.is_dir() else package / "assets" / "arms"


def _table(given: Mapping[str, Any]) -> ArmTable:
    servos = {name: _servo(values) for name, values in given["servos"].items()}
    joints = tuple(_joint(values, servos) for values in given["joints"])
    if len(joints) != JOINTS:
        raise ValueError(f"joints: an arm has {JOINTS}, got {len(joints)}")
    names = ("arm_base", *(f"arm_link_{n}" for n in range(1, JOINTS + 1)))
    links = given["links"]
    sizes = zip(names, links["length"], links["mass"], links["radius"], strict=True)
    gripper = dict(given["gripper"])
    pulses = given["pulses"]
    table = ArmTable(
        name=str(given["name"]),
        title=str(given["title"]),
        supply=_positive("supply", given["supply"]),
        joints=joints,
        links=tuple(Link(n, *(_positive(f"links of {n}", v) for v in rest)) for n, *rest in sizes),
        pulses=Pulses(1e-6 * pulses["shortest"], 1e-6 * pulses["longest"], pulses["frame"]),
        holding=Holding(**given["holding"]),
        motion=MotionLimits(**given["motion"]),
        gripper=Gripper(**{**gripper, "pad": tuple(gripper["pad"])}),
        mounts=MappingProxyType({n: Pose.from_euler(tuple(p)) for n, p in given["mounts"].items()}),
        poses=MappingProxyType({n: _degrees(n, p) for n, p in given["poses"].items()}),
    )
    _check(table)
    return table


def _check(table: ArmTable) -> None:
    """Raise a ValueError that names the field if the numbers contradict each other."""
    if "stow" not in table.poses:
        raise ValueError("poses: stow is missing")
    _, upright, upper, forearm, wrist, hand = (link.length for link in table.links)
    lengths = (upright, 0.0), (0.0, upper), (0.0, 0.0), (forearm + wrist, 0.0), (0.0, hand)
    for joint, alpha, (d, a) in zip(table.joints, _ALPHAS, lengths, strict=True):
        if not joint.lower < joint.upper:
            raise ValueError(f"{joint.name}: lower must be below upper")
        # The inverse kinematics are of this kind of arm alone.
        for name, value, needed in (("d", joint.d, d), ("a", joint.a, a)):
            if abs(value - needed) > 1e-9:
                raise ValueError(f"{joint.name}: {name} must be {needed:g} m, as the links have it")
        if abs(math.degrees(joint.alpha) - alpha) > 1e-9:
            raise ValueError(f"{joint.name}: alpha must be {alpha:g} deg")
    for name, angles in table.poses.items():
        for joint, angle in zip(table.joints, angles, strict=True):
            if not joint.lower <= angle <= joint.upper:
                raise ValueError(f"poses: {name} has {joint.name} at {math.degrees(angle):g} deg")


def _servo(given: Mapping[str, Any]) -> Servo:
    stall = {float(volts): KGF_CM * torque for volts, torque in given["stall"].items()}
    if len(stall) < 2:
        raise ValueError("servos: stall needs torques at two voltages")
    return Servo(
        like=str(given["like"]),
        mass=_positive("mass of a servo", given["mass"]),
        stall=MappingProxyType(stall),
        speed=math.radians(_positive("speed of a servo", given["speed"])),
        dead_band=1e-6 * given["dead_band"],
        play=math.radians(given["play"]),
        size=tuple(given["size"]),
    )


def _joint(given: Mapping[str, Any], servos: Mapping[str, Servo]) -> Joint:
    if given["servo"] not in servos:
        raise ValueError(f"{given['name']}: no servo {given['servo']!r} in servos")
    angles = {k: math.radians(given[k]) for k in ("theta", "alpha", "lower", "upper")}
    lengths = {k: float(given[k]) for k in ("d", "a")}
    servo = servos[given["servo"]]
    return Joint(str(given["name"]), str(given["turns"]), servo=servo, **angles, **lengths)


def _positive(name: str, value: float) -> float:
    if not (math.isfinite(value) and value > 0.0):
        raise ValueError(f"{name} must be > 0, got {value}")
    return float(value)


def _degrees(name: str, angles: Any) -> Angles:
    if len(angles) != JOINTS:
        raise ValueError(f"poses: {name} must have {JOINTS} angles, got {len(angles)}")
    return _five(math.radians(angle) for angle in angles)


def _five(values: Any) -> Angles:
    first, second, third, fourth, fifth = values
    return first, second, third, fourth, fifth
