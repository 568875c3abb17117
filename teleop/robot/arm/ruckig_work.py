"""Ruckig with what it works with: it has no state of ours, and is let go of before the program ends."""

from __future__ import annotations

import weakref

from ruckig import InputParameter, Ruckig, Trajectory


class RuckigWork:
    """Ruckig for some joints, its input, and the way that it works out."""

    def __init__(self, joints: int) -> None:
        """Make them."""
        self.solver = Ruckig(joints)
        self.given = InputParameter(joints)
        self.path = Trajectory(joints)
        # Those that outlive the interpreter make its bindings print a page of warnings at the end of the program.
        weakref.finalize(self, vars(self).clear)

    def calculate(self) -> float:
        """Work out the way from ``given`` into ``path``; return how long it takes [s].

        Raises:
            RuckigError: If it refuses what is given.
        """
        self.solver.calculate(self.given, self.path)
        return float(self.path.duration)
