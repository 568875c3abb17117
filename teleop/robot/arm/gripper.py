"""The gripper: an opening and a force, from a trigger or a goal; what it reached, and what it holds."""

from __future__ import annotations

from typing import Final

from robot_sim.arm.arm_table import Gripper
from teleop.robot.arm.goal_results import Grip

_REACHED: Final = 0.001
"""Distance from the wanted opening within which it is reached [m]."""
_STILL: Final = 0.002
"""Rate below which the jaws stand [m/s]: a fortieth of their own."""
_STALL_TIME: Final = 0.3
"""Time for which jaws that have not reached it must stand [s]; they start within two ticks."""
_CATCH: Final = 0.1
"""Share of the way by which a trigger may be off when it takes the jaws over."""


class GripperControl:
    """Owns what is wanted of the jaws; nothing that ends a command of the arm opens them."""

    def __init__(self, gripper: Gripper, tick: float) -> None:
        """Begin closed, with the gripper's own force, as the arm's body does.

        Args:
            gripper: The gripper.
            tick: Time between two calls of ``measure`` [s].
        """
        self._gripper, self._tick = gripper, tick
        self.opening = 0.0
        """Wanted [m]."""
        self.force = gripper.force
        """Largest force of the jaws together [N]."""
        self.rate = 0.0
        """Change of the opening in the last tick [m/s]."""
        self.grip = Grip(0.0, 0.0)
        """What was measured."""
        self._still = 0.0
        self._caught = False
        self._trigger: float | None = None

    @property
    def share(self) -> float:
        """Wanted opening over the widest."""
        return self.opening / self._gripper.opening

    def aim(self, opening: float, force: float = 0.0) -> None:
        """Begin to move to an opening [m] with a force [N], 0 for the gripper's own."""
        self.opening, self.force = opening, force or self._gripper.force
        self._still, self._caught, self._trigger = 0.0, False, None

    def pull(self, trigger: float) -> None:
        """Follow a trigger, 0 open to 1 closed, from the moment at which it agrees with the jaws or passes them.

        A hand that takes an arm over may have its trigger anywhere, and what the jaws hold must not fall for that.
        """
        closed = 1.0 - self.share
        before = trigger if self._trigger is None else self._trigger
        self._trigger = trigger
        passed = (before - closed) * (trigger - closed) <= 0.0
        self._caught = self._caught or passed or abs(trigger - closed) <= _CATCH
        if self._caught:
            self.opening, self.force = (1.0 - trigger) * self._gripper.opening, self._gripper.force
            self._still = 0.0

    def let_go(self) -> None:
        """Note that no trigger leads it any more."""
        self._caught, self._trigger = False, None

    def stop(self) -> None:
        """Stay where it is; jaws that press go on pressing, so that nothing falls."""
        self.let_go()
        if not self.grip.force:
            self.opening = self.grip.opening

    def measure(self, opening: float, force: float) -> Grip:
        """Take what was measured in a tick; return the gripper's state.

        Args:
            opening: Distance between the pads [m].
            force: Of the jaws together on what is between them [N].
        """
        self.rate = (opening - self.grip.opening) / self._tick
        reached = abs(opening - self.opening) <= _REACHED
        still = abs(self.rate) < _STILL and not reached
        self._still = self._still + self._tick if still else 0.0
        self.grip = Grip(opening, force, self._still >= _STALL_TIME - 1e-9, reached)
        return self.grip
