"""How much of a large message a client is sent: all of it, or as few parts as its link carries in time."""

from __future__ import annotations

from typing import Final

from teleop.rosbridge.ros_time import MILLISECOND

CARRIED_IN: Final = 50 * MILLISECOND
"""Time that a large message may take of a link beyond the way's own delay [ns]: what comes behind it waits so long, and
one delay and 50 ms is what an e-stop may take."""

COARSEST: Final = 12
"""Largest level of detail: a 64th of the parts."""

_LARGEST_CUT: Final = 0.25
_SLOWEST_CUT: Final = 0.9
"""Smallest change of the share to the worse: a link that carries messages just in time is not tried out."""
_RECOVERY: Final = 1.03
"""Change of the share with each message that is carried in time: twice as much in 24 messages."""


class Detail:
    """Follows how long the messages of one subscription take, and says how much of the next one to send."""

    def __init__(self) -> None:
        self._share = 1.0

    def carried(self, lag: int) -> None:
        """Note that a message waited and was carried for so long [ns], beyond the way's own delay."""
        if lag > CARRIED_IN:
            change = min(max(CARRIED_IN / lag, _LARGEST_CUT), _SLOWEST_CUT)
        elif lag < CARRIED_IN // 2:
            change = _RECOVERY
        else:
            change = 1.0
        self._share = min(max(self._share * change, share_of(COARSEST)), 1.0)

    @property
    def level(self) -> int:
        """The level of detail, 0 for everything; clients of one level share a message."""
        level = 0
        while share_of(level) > self._share * 1.0001:
            level += 1
        return level


def share_of(level: int) -> float:
    """Return the share of the parts of a message that a level leaves: half of them every two levels."""
    return float(0.5 ** (level / 2))
