"""Which arm a robot carries, where, and how exactly it stands."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from localization.geometry import FloatArray
from localization.types import Pose
from robot_sim.arm.arm_table import ArmTable, load_arm

if TYPE_CHECKING:  # the gateway loads no simulation
    from robot_sim import World


@dataclass(frozen=True, slots=True)
class ArmFit:
    """An arm on a robot."""

    table: ArmTable
    """The arm."""
    mount: str
    """Name of the place where it is mounted, among those of the table."""

    @classmethod
    def of(cls, world: World) -> ArmFit | None:
        """Return the arm of the robot in a world; None if it carries none."""
        return None if world.arm is None else cls(world.arm, world.arm_mount)

    @classmethod
    def named(cls, name: str | None, mount: str) -> ArmFit | None:
        """Return an arm by its name, or the path of its table; None for None.

        Raises:
            ArmError: If there is no such arm, or its file is invalid.
        """
        return None if name is None else cls(load_arm(name), mount)

    @property
    def base_from_arm_base(self) -> Pose:
        """Where its base is on the robot."""
        return self.table.mounts[self.mount]


def unfelt(table: ArmTable) -> FloatArray:
    """Return the angle (5,) by which a servo may be off without knowing: its dead band and half of its play [rad]."""
    pulses = table.pulses
    share = np.array([j.servo.dead_band for j in table.joints]) / (pulses.longest - pulses.shortest)
    ranges = np.subtract(table.upper, table.lower)
    half_play: FloatArray = 0.5 * np.array([joint.servo.play for joint in table.joints])
    return share * ranges + half_play
