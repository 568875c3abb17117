"""Which arm a robot carries, and where."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

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
