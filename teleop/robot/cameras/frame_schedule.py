"""The times at which a camera's frames are due, by robot time alone."""

from __future__ import annotations

from localization.types import SECOND
from robot_sim import TICK_NS


def frame_due(stamp: int, rate: float) -> bool:
    """Return whether a frame is due after a tick.

    Frames are due at the first tick at or after each multiple of their period, so that their mean rate is right
    although a tick is 20 ms; at rates above 50 Hz every tick has one.

    Args:
        stamp: Robot time after the tick [ns].
        rate: Frames per second [Hz].
    """
    return int(stamp * rate / SECOND) > int((stamp - TICK_NS) * rate / SECOND)
