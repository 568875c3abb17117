"""A hub's pictures as a video track; the encoder takes the newest when it is ready, and skips the others."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Final

import numpy as np
from aiortc import MediaStreamTrack
from aiortc.mediastreams import MediaStreamError
from av import VideoFrame

from teleop.pictures.picture import Picture
from teleop.pictures.picture_hub import Watch

_CLOCK_RATE: Final = 90_000
"""Ticks in a second of the clock of video (RFC 3551)."""

_SECOND: Final = 1_000_000_000

_CHECK_PERIOD: Final = 1_000_000_000
"""Time of the robot between two checks whether a viewer may go on watching [ns]."""


class PictureTrack(MediaStreamTrack):
    """Raw colours of a camera, dated by the robot's time."""

    kind = "video"

    def __init__(self, watch: Watch, may_go_on: Callable[[], bool]) -> None:
        """Show a watch's pictures.

        Args:
            watch: A watch of a raw format; its owner closes it.
            may_go_on: Returns whether the viewer may go on watching; asked once a second.
        """
        super().__init__()
        self._watch, self._may_go_on = watch, may_go_on
        self._first: int | None = None
        self._checked: int | None = None
        self._last = -1

    async def recv(self) -> VideoFrame:
        """Return the newest picture that was not returned.

        Raises:
            MediaStreamError: If the viewer may not go on watching.
        """
        picture = await self._watch.next()
        if self._checked is None or not 0 <= picture.stamp - self._checked < _CHECK_PERIOD:
            self._checked = picture.stamp
            if not self._may_go_on():
                self.stop()
        if self.readyState != "live":
            raise MediaStreamError
        return self._frame(picture)

    def _frame(self, picture: Picture) -> VideoFrame:
        rows = np.frombuffer(picture.data, np.uint8).reshape(picture.height, picture.width, 3)
        frame = VideoFrame.from_ndarray(rows, format="rgb24")
        if self._first is None:
            self._first = picture.stamp
        # Time that began anew goes on by a tick: encoders take no picture before the last.
        ticks = (picture.stamp - self._first) * _CLOCK_RATE // _SECOND
        self._last = max(ticks, self._last + 1)
        frame.pts, frame.time_base = self._last, Fraction(1, _CLOCK_RATE)
        return frame
