"""What control does for the camera: hands over the state of each frame that is asked for."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Final

from localization.types import SECOND
from robot_sim import Simulation
from teleop.robot.cameras.frame_schedule import frame_due
from teleop.robot.real_time.channel import ChannelClosedError
from teleop.robot.real_time.child_process import ChildProcess
from teleop.robot.real_time.process_messages import NEXT_STATE, OTHER, STATE, End, pack, unpack

_LOG: Final = logging.getLogger(__name__)

_LATE: Final = SECOND // 10
"""Time between two ticks from which on some are lost, so that the camera stands back [ns]."""

_REST: Final = SECOND // 5
"""Time without a frame after such a tick: five frames a second; doubled each time that it was not enough [ns]."""

_PAUSE: Final = 5 * SECOND
"""Time between two starts of the camera's process, so that one that fails at once costs little; and the longest rest [ns]."""


class CameraFeed:
    """Owns the camera's process; costs a tick two system calls, and of a frame less than 0.1 ms."""

    def __init__(
        self,
        process: ChildProcess,
        simulation: Simulation,
        rate: float,
        *,
        restart: Callable[[], ChildProcess],
    ) -> None:
        """Take over a process that is ready.

        Args:
            process: The camera's process.
            simulation: What it draws.
            rate: Frames per second [Hz].
            restart: Starts another process.
        """
        self.process: ChildProcess | None = process
        """The camera's process; None for a while after it has ended."""
        self._simulation, self._rate, self._start = simulation, rate, restart
        self._asked = False
        self._started: int | None = None
        self._rest, self._resting_until = 0, 0

    def ticked(self, now: int, gap: int = 0) -> None:
        """Hand the state over if a frame is due and asked for; start a process that has ended again.

        Where ticks come late fewer frames are drawn, five a second and then none for up to five seconds; the
        last one has its age.

        Args:
            now: Reading of the monotonic clock [ns].
            gap: Time since the tick before [ns].
        """
        if gap > _LATE and now >= self._resting_until:
            again = now - self._resting_until < _PAUSE
            self._rest = min(2 * self._rest, _PAUSE) if again and self._rest else _REST
            self._resting_until = now + self._rest
        if self.process is None:
            if self._started is not None and now - self._started < _PAUSE:
                return
            self.process, self._asked, self._started = self._start(), False, now
        try:
            for payload in self.process.channel.receive():
                if payload == NEXT_STATE:
                    self._asked = True
                elif isinstance(value := unpack(payload), Exception):
                    _LOG.error("the camera failed: %s", value)
            rests = now < self._resting_until
            if self._asked and not rests and frame_due(self._simulation.stamp, self._rate):
                self.process.channel.send(pack(STATE, self._simulation.visual_state()))
                self._asked = False
            elif self.process.channel.waiting:
                self.process.channel.flush()
        except ChannelClosedError:
            _LOG.error("the camera has ended: it is started again")
            self.process.kill()
            self.process = None

    def end(self) -> None:
        """End the process."""
        if self.process is not None:
            self.process.end(pack(OTHER, End()))
