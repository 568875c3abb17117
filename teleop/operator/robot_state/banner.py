"""What an operator must see at once, in words: what the banner of the display shows."""

from __future__ import annotations

from dataclasses import dataclass

from teleop.operator.robot_state.alarm_rules import Notice


@dataclass(frozen=True, slots=True)
class Banner:
    """What the banner shows; equal ones need not be drawn again."""

    link: Notice
    """The connection."""
    notices: tuple[Notice, ...]
    """What an operator must know, the worst first."""
    figures: tuple[str, ...]
    """Round trip, rates and the like: up to three lines."""
