"""The frames of one client on their way to the protocol: large ones wait for a thread, others pass."""

from __future__ import annotations

import asyncio
import logging
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from teleop.rosbridge.framing.large_frames import LARGE_FRAME
from teleop.rosbridge.protocol.large_frame_work import PreparedFrame
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.rosbridge.server.work_thread import WorkThread

_LOG: Final = logging.getLogger(__name__)

_FRAME_BYTES: Final = 512
"""Memory of a frame that waits, besides its content [bytes]."""


@dataclass(frozen=True, slots=True)
class _Frame:
    content: str | bytes
    arrived: int
    reassembled: bool
    names: frozenset[str] | None = None
    """What it concerns; None if that may be anything."""

    @property
    def size(self) -> int:
        return len(self.content) + _FRAME_BYTES


class ClientFrames:
    """Owns the frames of a client that wait for the work on a large one.

    A large frame holds up only what its sender sends later to the same topic, service or action.
    """

    def __init__(
        self, protocol: Protocol, client: int, thread: WorkThread | None, now: Callable[[], int]
    ) -> None:
        """Begin with nothing waiting.

        Args:
            protocol: Processes the frames.
            client: The client.
            thread: Works on large frames; without one, all are processed at once.
            now: Returns the protocol's time [ns].
        """
        self._protocol, self._client, self._thread, self._now = protocol, client, thread, now
        self._waiting: deque[_Frame] = deque()
        self._waiting_bytes = 0
        self._room = protocol.limits.bytes * protocol.limits.burst
        self._working: asyncio.Task[None] | None = None

    def take(self, content: str | bytes, arrived: int) -> None:
        """Process a frame that arrived at ``arrived`` [ns], or have it wait."""
        self._take(content, arrived, reassembled=False)

    def close(self) -> None:
        """Drop what waits, since the client has left."""
        self._waiting.clear()
        if self._working is not None:
            self._working.cancel()

    def _take(self, content: str | bytes, arrived: int, *, reassembled: bool) -> None:
        frame = _Frame(content, arrived, reassembled)
        if self._thread is None or not (self._waiting or len(content) >= LARGE_FRAME):
            self._process(frame, content)
            return
        names = self._protocol.concerns(content)
        if self._held(names) or self._work_on(frame) is not None:
            self._wait(_Frame(content, arrived, reassembled, names))
        else:
            self._process(frame, content)

    def _held(self, names: frozenset[str] | None) -> bool:
        """Return whether something waits that must be processed before."""
        return any(
            names is None or frame.names is None or not names.isdisjoint(frame.names)
            for frame in self._waiting
        )

    def _wait(self, frame: _Frame) -> None:
        if self._waiting_bytes + frame.size > self._room:
            self._protocol.refuse_waiting(self._client, frame.size, self._now())
            return
        self._waiting.append(frame)
        self._waiting_bytes += frame.size
        if self._working is None:
            self._working = asyncio.create_task(self._work())

    async def _work(self) -> None:
        while self._waiting:
            frame = self._waiting[0]
            try:
                self._process(frame, await self._prepared(frame))
            except Exception:
                # A defect of the host must not end the client's connection.
                _LOG.exception("a large frame of client %d failed", self._client)
            self._waiting.popleft()
            self._waiting_bytes -= frame.size
            await asyncio.sleep(0)  # lets other clients run
        self._working = None

    async def _prepared(self, frame: _Frame) -> str | bytes | PreparedFrame:
        work = self._work_on(frame)
        if work is None or self._thread is None:
            return frame.content
        return await self._thread.run(self._client, len(frame.content), work)

    def _work_on(self, frame: _Frame) -> Callable[[], PreparedFrame] | None:
        return self._protocol.prepare(
            self._client, frame.content, frame.arrived, admitted=frame.reassembled
        )

    def _process(self, frame: _Frame, content: str | bytes | PreparedFrame) -> None:
        if frame.reassembled:
            assert not isinstance(content, bytes)
            self._protocol.receive_deferred(
                self._client, content, self._now(), arrived=frame.arrived
            )
            return
        self._protocol.receive(self._client, content, self._now(), arrived=frame.arrived)
        for message in self._protocol.deferred(self._client):
            self._take(message, frame.arrived, reassembled=True)
