"""Things that move on their own: where each is, as a function of time alone.

A mover cannot react to the robot. That is what makes it possible to ask where it was at the time of
any one beam, in any order, and to get the same answer in the physics and in the casting.
"""

from __future__ import annotations

from typing import Protocol

from localization.types import IntArray
from robot_sim.arrays import FloatArray


class Mover(Protocol):
    """One rigid body that moves as it will: a mocap body of the model, of the mover's name."""

    @property
    def name(self) -> str:
        """Name of the mocap body."""
        ...

    def pose_at(self, times: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return positions (N, 3) in ``map`` [m] and yaws (N,) [rad] at ``times`` (N,) [ns].

        A pure function, defined for every time; the body stays upright.
        """
        ...
