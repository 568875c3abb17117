"""Limits on commands that are old when they arrive: the robot slows down, then stops listening."""

from __future__ import annotations

from dataclasses import dataclass

from teleop.errors import SettingError

_SECOND = 1_000_000_000
"""A second [ns]; not imported, for the command line offers these limits without numpy."""


@dataclass(frozen=True, slots=True)
class StaleLimits:
    """Ages of commands at their arrival [ns] from which the robot takes care; 0 switches a limit off.

    People steer by what they see: on a link that takes long, the picture and the command are both old.
    """

    slow: int = _SECOND // 2
    """Age above which the robot drives slower [ns]: the slower, the closer the age is to ``refuse``."""
    refuse: int = _SECOND
    """Age above which commands are refused, and the robot stops [ns]."""

    def __post_init__(self) -> None:
        if self.slow < 0 or self.refuse < 0:
            raise SettingError("the ages of commands must be >= 0 s; 0 switches a limit off")
        if self.refuse and self.slow > self.refuse:
            raise SettingError(
                f"commands are refused at an age of {self.refuse / _SECOND:g} s, so they cannot slow the robot"
                f" from {self.slow / _SECOND:g} s on"
            )

    def refusal(self, age: int) -> str | None:
        """Return why commands of this age [ns] are refused; None if they are not."""
        if not self.refuse or age <= self.refuse:
            return None
        return (
            f"commands arrive {age / _SECOND:.1f} s late, the way back to you included, and"
            f" {self.refuse / _SECOND:g} s is the limit: release the stick, and wait for a faster link"
        )

    def speed_share(self, age: int) -> float:
        """Return the share of the requested speed, 0 to 1, at which commands of this age [ns] drive.

        It falls from 1 at ``slow`` to 0 at ``refuse``, so that the robot is at rest when it must stop. If
        nothing is refused, it is what keeps the distance driven within an age the same as at ``slow``.
        """
        if not self.slow or age <= self.slow:
            return 1.0
        if not self.refuse:
            return self.slow / age
        return max(0.0, (self.refuse - age) / max(1, self.refuse - self.slow))
