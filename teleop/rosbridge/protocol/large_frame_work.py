"""The work on a large frame that needs no state of the protocol, so that a thread can do it."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from dataclasses import dataclass

from teleop.rosbridge.errors import FrameError, RosbridgeError
from teleop.rosbridge.framing.json_frames import gc_paused
from teleop.rosbridge.framing.large_frames import LargeFrameReader, PayloadField
from teleop.rosbridge.framing.operation_fields import Operation
from teleop.rosbridge.graph.client_completion import CompletedAhead
from teleop.rosbridge.graph.topics import Topics
from teleop.rosbridge.messages.type_registry import TypeRegistry

_STAMPED = ("publish", "call_service", "send_action_goal")
"""Operations whose payload may contain the present time."""


@dataclass(frozen=True, slots=True)
class PreparedFrame:
    """A large frame with the operation in it, of which the message is completed and encoded."""

    frame: str | bytes
    operation: Operation | None = None
    error: FrameError | None = None
    """Why there is no operation."""

    def __len__(self) -> int:
        return len(self.frame)


class LargeFrameWork:
    """Reads large frames, completes their messages and encodes them for their subscribers.

    Of the state of the protocol it reads names, types and subscriptions only. What has changed of
    those before the frame is processed costs the work again, but not the result.
    """

    def __init__(
        self,
        reader: LargeFrameReader,
        payloads: Mapping[str, PayloadField],
        topics: Topics,
        registry: TypeRegistry,
    ) -> None:
        self._reader = reader
        self._payloads = payloads
        self._topics = topics
        self._registry = registry

    def prepare(self, frame: str | bytes, now: int) -> PreparedFrame:
        """Return a frame with its operation; ``now`` [ns] is the time at which it arrived."""
        with gc_paused(len(frame)):
            return self._prepare(frame, now)

    def _prepare(self, frame: str | bytes, now: int) -> PreparedFrame:
        try:
            operation = self._reader.read(frame)
        except FrameError as error:
            return PreparedFrame(frame, error=error)
        payload = self._payloads.get(operation["op"])
        part = None if payload is None else operation.get(payload.part)
        if payload is not None and isinstance(part, dict):
            kind = payload.find(operation[payload.name])
            if kind is not None:
                stamp = now if operation["op"] in _STAMPED else None
                ahead = CompletedAhead.of(self._registry, kind, part, stamp)
                if operation["op"] == "publish":
                    self._encode(operation["topic"], ahead, now)
                operation = {**operation, payload.part: ahead}
        return PreparedFrame(frame, operation)

    def _encode(self, name: str, ahead: CompletedAhead, now: int) -> None:
        topic = self._topics.find(name)
        if topic is None or ahead.message is None or topic.kind is not ahead.kind:
            return
        ahead.publication = self._topics.publication(topic, ahead.message, now)
        for variant in {
            subscription.variant for subscription in list(topic.subscriptions.values())
        }:
            with contextlib.suppress(RosbridgeError):  # raised again where it is reported
                ahead.publication.frame(*variant)
