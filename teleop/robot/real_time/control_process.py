"""Control: ticks every 20 ms, and never waits for the gateway or the estimator.

Commands, safety, physics and sensors are here, and nothing that depends on how much clients send. The gateway may
hang or die: for the robot that is the silence of all its drivers.
"""

from __future__ import annotations

import gc
import logging
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from localization.types import SECOND
from teleop import clock
from teleop.robot.drive import Drive
from teleop.robot.inbox import InboxMessage
from teleop.robot.real_time.channel import ChannelClosedError
from teleop.robot.real_time.child_process import ChildProcess
from teleop.robot.real_time.process_messages import (
    DRIVEN,
    ESTIMATED,
    OTHER,
    PREVIEW,
    PREVIEWED,
    End,
    ReadTokens,
    Wanted,
    pack,
    unpack,
)
from teleop.robot.serving.address import Address
from teleop.robot.tick_record import NO_PACING, DriveRecord, EstimateRecord, Pacing, resting

if TYPE_CHECKING:  # imported only where there is a camera
    from teleop.robot.real_time.camera_feed import CameraFeed

_LOG: Final = logging.getLogger(__name__)

_HUNG: Final = 3 * SECOND
"""Time without a sign of life after which the gateway is ended and started again [ns]."""

_STARTING: Final = 60 * SECOND
"""The same while it begins [ns]."""

_BEHIND: Final = SECOND // 2
"""Lag that has to be dropped before falling behind real time is said again [ns]."""

_BRAKING: Final = 3 * SECOND // 2
"""Time for which ticks go on until the robot is at rest [ns]: 0.7 s on level ground; on slopes it creeps."""

_CLOSING: Final = 30.0
"""Time in which the localiser works off what waits for it and completes its log [s]: on a busy machine it is behind."""

_END: Final = pack(OTHER, End())


class ControlProcess:
    """Owns the drive, and the processes that it feeds."""

    def __init__(
        self,
        drive: Drive,
        gateway: ChildProcess,
        estimator: ChildProcess,
        *,
        restart_gateway: Callable[[], ChildProcess],
        restart_estimator: Callable[[], ChildProcess],
        camera: CameraFeed | None = None,
    ) -> None:
        """Take over the processes: an estimator that is ready, and a gateway that has begun.

        Args:
            drive: The drive.
            gateway: The gateway.
            estimator: The estimator.
            restart_gateway: Starts another gateway.
            restart_estimator: Starts another estimator.
            camera: What feeds the camera; None without one.
        """
        self._drive = drive
        self._start_gateway, self._start_estimator = restart_gateway, restart_estimator
        self.gateway, self.estimator, self.camera = gateway, estimator, camera
        self._inbox: list[InboxMessage] = []
        self._read_tokens = False
        self._alive = self._now = clock.monotonic()
        self._patience = _STARTING
        self._longest_gap = 0
        self._lost_reported = 0
        self._ending = False

    def ready(self) -> Address:
        """Wait until clients can connect; return where.

        Raises:
            Exception: What the server could not begin for.
            ChannelClosedError: If it died.
        """
        address = self.gateway.ready().address
        assert address is not None
        return address

    def post(self, message: InboxMessage) -> None:
        """Have a message that no client sent taken with the next tick."""
        self._inbox.append(message)

    def read_tokens(self) -> None:
        """Have the token file read again with the next tick; may be called in another thread."""
        self._read_tokens = True

    def run(self, stop: threading.Event) -> float:
        """Drive until ``stop`` is set, then brake to rest; return the real-time factor."""
        # What is there now stays: searching it for garbage would take longer than a tick.
        gc.collect()
        gc.freeze()
        lost = elapsed = 0
        try:
            for beat in clock.beats(stop):
                self._longest_gap = max(self._longest_gap, beat.gap)
                self._report_lag(beat.lost)
                lost, elapsed = beat.lost, beat.elapsed
                self.tick(beat.now, Pacing(beat.gap, self._longest_gap, lost, elapsed, beat.now))
                if self._drive.playground is not None and self._drive.playground.next_world:
                    break
            self._brake()
        finally:
            gc.unfreeze()
        return 1.0 - lost / elapsed if elapsed else 1.0

    def _brake(self) -> None:
        """Tick until the robot stands still, whatever clients want; the last command is zero."""
        self._ending = True
        self._drive.server_lost("the robot is shut down")
        stood = False
        for beat in clock.beats(threading.Event()):
            stood_before, stood = stood, resting(self.tick(beat.now))
            # A reading is the mean over its tick: the last one is of a robot that stood all along.
            if (stood and stood_before) or beat.elapsed > _BRAKING:
                return

    def tick(self, now: int, pacing: Pacing = NO_PACING) -> DriveRecord:
        """Make one tick; ``now`` is the reading of the monotonic clock [ns]."""
        self._now = now
        if self._read_tokens:
            self._read_tokens = False
            self._publish(pack(OTHER, ReadTokens()))
        self._receive()
        self._pass_on_estimates()
        inbox, self._inbox = [] if self._ending else self._inbox, []
        record = self._drive.tick(now, inbox, pacing)
        payload = pack(DRIVEN, record)
        self._publish(payload)
        self._send_to_estimator(payload)
        if self.camera is not None:
            self.camera.ticked(now, pacing.gap)
        return record

    def end(self) -> None:
        """End the processes."""
        self.gateway.end(_END)
        if not self.estimator.end(_END, _CLOSING):
            _LOG.error("the localiser did not end within %g s: its log lacks its end", _CLOSING)
        if self.camera is not None:
            self.camera.end()

    def _receive(self) -> None:
        """Take what clients want; start the gateway again if it is gone."""
        try:
            for payload in self.gateway.channel.receive():
                self._alive = self._now
                if payload[:1] == PREVIEW:
                    self._send_to_estimator(payload)
                    continue
                value = unpack(payload)
                if isinstance(value, Wanted):
                    self._patience = _HUNG
                    self._inbox += value.messages
                elif isinstance(value, Exception):
                    _LOG.error("the server cannot begin: %s", value)
        except ChannelClosedError:
            self._restart_gateway("the server has ended")
        if self._now - self._alive > self._patience:
            self._restart_gateway("the server does not answer")

    def _publish(self, payload: bytes) -> None:
        try:
            self.gateway.channel.send(payload)
        except ChannelClosedError:
            self._restart_gateway("the server has ended")

    def _send_to_estimator(self, payload: bytes) -> None:
        try:
            self.estimator.channel.send(payload)
        except ChannelClosedError:
            self._restart_estimator()

    def _pass_on_estimates(self) -> None:
        try:
            newest = None
            for payload in self.estimator.channel.receive():
                if payload[:1] in (ESTIMATED, PREVIEWED):
                    newest = payload if payload[:1] == ESTIMATED else newest
                    self._publish(payload)
                elif isinstance(value := unpack(payload), Exception):
                    _LOG.error("the localiser failed: %s", value)
            # Estimates are passed on unread, unless a step is measured by them or the guard has not read any for long.
            if newest is not None and self._drive.wants_estimate:
                record: EstimateRecord = unpack(newest)
                if record.estimates:
                    self._drive.take_estimate(record.estimate)
        except ChannelClosedError:
            self._restart_estimator()

    def _restart_gateway(self, why: str) -> None:
        if self._ending:
            return
        _LOG.error("%s: the robot brakes, and the server is started again", why)
        self.gateway.kill()
        self._inbox = [message for message in self._inbox if not message.client]
        self._drive.server_lost(why)
        self.gateway = self._start_gateway()
        self._alive, self._patience = self._now, _STARTING

    def _restart_estimator(self) -> None:
        if self._ending:
            return
        _LOG.error("the localiser has ended: it is started again, without a pose")
        self.estimator.kill()
        self.estimator = self._start_estimator()

    def _report_lag(self, lost: int) -> None:
        if lost - self._lost_reported > _BEHIND:
            _LOG.warning(
                "falling behind real time: %.1f s lost so far; this machine is too slow or too busy",
                lost / SECOND,
            )
            self._lost_reported = lost
