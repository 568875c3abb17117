"""What the rules of an arm know of it besides its ticks: its table, and how near poses of it are to anything."""

from __future__ import annotations

from collections.abc import Iterable

from localization.geometry import FloatArray
from robot_sim import Simulation
from robot_sim.arm.clearance import Clearance
from robot_sim.arm.kinematics import Kinematics
from teleop.robot.arm.arm_fit import ArmFit


class ArmFacts:
    """Looks at the simulated arm with an eye of its own, which nothing of the robot's control can shut."""

    def __init__(self, simulation: Simulation, fit: ArmFit) -> None:
        """Take the simulation of a robot with an arm."""
        self.table, self.kinematics = fit.table, Kinematics(fit.table)
        self._simulation, self._clearance = simulation, Clearance(fit.table, fit.mount)

    def distances(self, poses: Iterable[FloatArray], within: float) -> list[float]:
        """Return how near each pose (5,) [rad] is to anything that stands there now [m]; ``within`` if that is more."""
        arm = self._simulation.arm
        assert arm is not None
        arm.show(self._clearance, arm.reading.held)
        return [self._clearance.distance(pose, within) for pose in poses]
