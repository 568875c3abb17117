"""Whether a client may do what a large frame is for, before any work on its payload."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from teleop.rosbridge.auth.permissions import Act
from teleop.rosbridge.errors import FrameError
from teleop.rosbridge.framing.large_frames import LARGE_FRAME, FrameTarget, LargeFrameReader
from teleop.rosbridge.framing.operation_fields import Operation
from teleop.rosbridge.graph.topics import Topics
from teleop.rosbridge.protocol.connection import Connection

_ACTS: Final[dict[str, Act]] = {
    "publish": "publish",
    "call_service": "call",
    "send_action_goal": "call",
    "service_response": "provide",
    "action_feedback": "provide",
    "action_result": "provide",
}
"""The right that each operation with a large payload takes; a fragment takes none."""


@dataclass(frozen=True, slots=True)
class RefusedFrame:
    """A large frame of a client that may not do what it is for."""

    operation: Operation
    """The operation, without its payload."""

    why: str


class LargeFrameRights:
    """Asks for the right by the fields at the ends of a frame."""

    def __init__(self, reader: LargeFrameReader, topics: Topics) -> None:
        self._reader = reader
        self._topics = topics

    def refused(self, client: Connection, frame: str | bytes) -> RefusedFrame | None:
        """Return the operation that a client may not do; None if it may, or the frame is small."""
        if len(frame) < LARGE_FRAME:
            return None
        try:
            target = self._reader.target(frame)
        except FrameError:
            return None  # raised again where it is reported
        why = self._refusal(client, target)
        return None if why is None else RefusedFrame(target.operation, why)

    def _refusal(self, client: Connection, target: FrameTarget) -> str | None:
        if target.op not in _ACTS:
            return None
        name = target.name.partition("#")[0] if target.op == "call_service" else target.name
        if why := client.refusal(_ACTS[target.op], name):
            return why
        return self._topics.publish_refusal(name) if target.op == "publish" else None
