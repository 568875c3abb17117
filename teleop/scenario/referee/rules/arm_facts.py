"""What the rules of an arm know of it besides its ticks: its table, and how near poses of it are to anything."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol

from localization.geometry import FloatArray
from robot_sim import Simulation
from robot_sim.arm.clearance import Clearance
from robot_sim.arm.kinematics import Kinematics
from teleop.robot.arm.arm_fit import ArmFit


class Mirror(Protocol):
    """A second arm that follows."""

    cut_since: int | None
    """When its line was unplugged last [ns]; None if it is plugged in."""
    plugged_since: int
    """When it was plugged in last [ns]."""
    said: str
    """State that the robot published last, such as ``lost``."""


class ArmFacts:
    """Looks at the simulated arm with an eye of its own, which nothing of the robot's control can shut."""

    def __init__(self, simulation: Simulation, fit: ArmFit, mirror: Mirror | None = None) -> None:
        """Take the simulation of a robot with an arm, and the second arm if there is one."""
        self.mirror = mirror
        self.table, self.kinematics = fit.table, Kinematics(fit.table)
        self._simulation, self._clearance = simulation, Clearance(fit.table, fit.mount)

    def distances(self, poses: Iterable[FloatArray], within: float) -> list[float]:
        """Return how near each pose (5,) [rad] is to anything that stands there now [m]; ``within`` if that is more."""
        arm = self._simulation.arm
        assert arm is not None
        arm.show(self._clearance, arm.reading.held)
        return [self._clearance.distance(pose, within) for pose in poses]
