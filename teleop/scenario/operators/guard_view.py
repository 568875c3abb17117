"""What an operator does whom the guard has stopped: it goes slowly where the guard says that there is room."""

from __future__ import annotations

from typing import Any, Final

from localization.types import SECOND, Twist
from teleop.scenario.operators.wire import Wire

_PATIENCE: Final = SECOND
"""Time for which a stop is waited out, as for a person who walks past [ns]."""

_DETOUR: Final = 2 * SECOND
"""Time for which it then goes another way [ns]: 0.3 m, or 46 degrees."""

_CREEP: Final = 0.15
"""Speed of that [m/s]: what the guard grants where nothing is seen."""

_TURN: Final = 0.4
"""Turn rate of that [rad/s]."""


class GuardView:
    """Remembers the guard's newest verdict, and since when it has stopped the operator."""

    def __init__(self, wire: Wire) -> None:
        """Subscribe to the guard."""
        self._verdict: dict[str, Any] = {}
        self._stopped_since: int | None = None
        self._detour, self._until = Twist.planar(0.0, 0.0), 0
        wire.subscribe("/teleop/guard", "farsteer_msgs/Guard", self._take)

    def around(self, wanted: Twist, now: int) -> Twist:
        """Return what leads on from where the guard refuses what is wanted; that itself where it does not.

        Args:
            wanted: The velocity that leads to the goal.
            now: Robot time [ns].
        """
        if now < self._until:
            return self._detour
        if self._verdict.get("state") != "stopped":
            self._stopped_since = None
            return wanted
        self._stopped_since = now if self._stopped_since is None else self._stopped_since
        if now - self._stopped_since < _PATIENCE:
            return wanted
        self._stopped_since = None
        self._detour, self._until = self._free_way(wanted), now + _DETOUR
        return self._detour

    def _free_way(self, wanted: Twist) -> Twist:
        ahead, turn = float(wanted.linear[0]), float(wanted.angular[2])
        ways = ["forward"] if ahead > 0.0 else []
        ways += ["backward", *(("left", "right") if turn >= 0.0 else ("right", "left"))]
        free = next((way for way in ways if self._verdict[way]), "")
        speed = _CREEP * ((free == "forward") - (free == "backward"))
        return Twist.planar(speed, _TURN * ((free == "left") - (free == "right")))

    def _take(self, message: dict[str, Any]) -> None:
        self._verdict = message
