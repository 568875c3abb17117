"""What the guard says, in words."""

from __future__ import annotations

import math

from teleop.robot.guard.verdict import Near

_SIDES = ("ahead", "to the left", "behind", "to the right")
"""Directions, from ahead on counted to the left."""


def motion_words(forward: float, turn: float) -> str:
    """Return what is driven: "0.3 m/s", of a turn on the spot "0.4 rad/s"."""
    if forward == 0.0 and turn == 0.0:
        return "stopped"
    return f"{abs(forward):.2g} m/s" if forward else f"{abs(turn):.2g} rad/s"


def place_words(near: Near) -> str:
    """Return where the obstacle is: "obstacle 0.9 m ahead"."""
    side = _SIDES[round(math.atan2(near.y, near.x) / (0.5 * math.pi)) % 4]
    how = {"memory": "remembered ", "unseen": "unseen "}.get(near.source, "")
    return f"{how}obstacle {max(near.gap, 0.0):.1f} m {side}"
