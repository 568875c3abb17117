"""``tf2_web_republisher``: transforms worked out here, for browsers that hold no tree of them.

Browsers ask by the action of ROS 1 or of ROS 2 or by the service ``/republish_tfs``, for frames to
be told of in another frame. They hear of each that has moved enough, at the rate they asked for.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

from teleop.rosbridge.compat.actionlib import serve_actionlib
from teleop.rosbridge.compat.transform_tree import Transform, TransformTree, frame
from teleop.rosbridge.errors import ServiceError
from teleop.rosbridge.graph.goals import Goal
from teleop.rosbridge.messages.message_completion import stamp
from teleop.rosbridge.messages.message_types import Message
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.rosbridge.timers import Timer

_NAME: Final = "/tf2_web_republisher"
_SOURCES: Final = ("/tf", "/tf_static")
_SECOND: Final = 1_000_000_000

_RATES: Final = (0.1, 50.0)
"""Slowest and fastest updates [Hz]."""

_DEFAULT_RATE: Final = 10.0
_DEFAULT_TIMEOUT_NS: Final = 10 * _SECOND
"""For which a topic of the service waits for its subscriber."""

_MOST_STREAMS: Final = 16
"""Of one client."""

_MOST_FRAMES: Final = 256
"""Of one stream."""


def serve_republisher(protocol: Protocol) -> None:
    """Offer the action and the service; while nobody uses them, nothing is listened to."""
    republisher = _Republisher(protocol)
    protocol.serve("/republish_tfs", "tf2_web_republisher/RepublishTFs", republisher.serve)
    kind = "tf2_web_republisher_interfaces/TFSubscription"
    protocol.serve_action(_NAME, kind, republisher.begin)
    serve_actionlib(protocol, _NAME, "tf2_web_republisher/TFSubscription", republisher.begin)


@dataclass(slots=True)
class _Stream:
    """What one request asks for, and what it has been told."""

    client: int
    sources: list[str]
    target: str
    angle: float
    """Turn that is worth telling [rad]."""

    distance: float
    """Way that is worth telling [m]."""

    period: int
    """Between two looks [ns]."""

    send: Callable[[Message, int], bool]
    """Takes a ``TFArray``; returns whether somebody heard it."""

    abandon: Callable[[int], object] = lambda now: None
    """Called when the client has left."""

    told: dict[str, Transform] = field(default_factory=dict)
    timer: Timer | None = None


class _Republisher:
    def __init__(self, protocol: Protocol) -> None:
        self._protocol = protocol
        self._tree = TransformTree()
        self._streams: list[_Stream] = []
        self._number = 0
        protocol.on_disconnect(self._leave)

    def begin(self, goal: Goal) -> None:
        """Carry out a goal: until it is cancelled."""

        def send(message: Message, now: int) -> bool:
            goal.feedback(message)
            return True

        stream = self._stream(goal.client, goal.request, send)
        goal.on_cancel(goal.canceled)
        goal.on_end(lambda: self._stop(stream))
        self._start(stream, goal.accepted)

    def serve(self, client: int, request: Message, now: int) -> Message:
        """Answer with a topic, which there is for as long as somebody subscribes to it."""
        topic = f"/tf_repub_{self._number}"
        wait = request["timeout"]["sec"] * _SECOND + request["timeout"]["nanosec"]
        wait = wait if wait > 0 else _DEFAULT_TIMEOUT_NS
        heard = now

        def send(message: Message, now: int) -> bool:
            nonlocal heard
            if self._protocol.wanted(topic):
                heard = now
                if message["transforms"]:
                    self._protocol.publish(topic, message, now)
                return True
            if now - heard >= wait:
                end(now)
            return False

        def end(now: int) -> None:
            self._stop(stream)
            self._protocol.unadvertise(topic, now)

        def abandon(now: int) -> None:
            nonlocal wait
            wait = 0  # others may have subscribed, and it ends when they have left as well
            if not self._protocol.wanted(topic):
                end(now)

        stream = self._stream(client, request, send)
        stream.abandon = abandon
        self._number += 1
        self._protocol.advertise(topic, "tf2_web_republisher/TFArray")
        self._start(stream, now)
        return {"topic_name": topic}

    def _stream(
        self, client: int, request: Message, send: Callable[[Message, int], bool]
    ) -> _Stream:
        if sum(stream.client == client for stream in self._streams) >= _MOST_STREAMS:
            raise ServiceError(f"at most {_MOST_STREAMS} requests of a client are followed")
        sources = [frame(source) for source in request["source_frames"]]
        if len(sources) > _MOST_FRAMES:
            raise ServiceError(f"at most {_MOST_FRAMES} frames can be asked for")
        rate = request["rate"] if request["rate"] > 0 else _DEFAULT_RATE
        rate = min(max(rate, _RATES[0]), _RATES[1])
        return _Stream(
            client,
            sources,
            frame(request["target_frame"]),
            math.radians(request["angular_thres"]),  # in degrees, as its clients have it
            request["trans_thres"],
            int(_SECOND / rate),
            send,
        )

    def _start(self, stream: _Stream, now: int) -> None:
        if not self._streams:
            for source in _SOURCES:
                self._protocol.monitor(source, "tf2_msgs/TFMessage", self._hear, now)
        self._streams.append(stream)
        # Not at once: the answer, which tells the topic, comes first.
        stream.timer = self._protocol.at(now, lambda now: self._look(stream, now))

    def _stop(self, stream: _Stream) -> None:
        if stream.timer is not None:
            stream.timer.cancel()
        if stream in self._streams:
            self._streams.remove(stream)
        if not self._streams:
            self._tree.clear()
            for source in _SOURCES:
                self._protocol.unmonitor(source, self._hear, self._protocol.now)

    def _leave(self, client: int, now: int) -> None:
        for stream in list(self._streams):
            if stream.client == client:
                stream.abandon(now)

    def _hear(self, message: Message, now: int) -> None:
        self._tree.add(message)

    def _look(self, stream: _Stream, now: int) -> None:
        """Tell what has moved, and look again a period later."""
        stream.timer = self._protocol.at(now + stream.period, lambda now: self._look(stream, now))
        moved = {}
        for source in stream.sources:
            transform = self._tree.find(stream.target, source)
            if transform is not None and self._worth(stream, source, transform):
                moved[source] = transform
        header = {"stamp": stamp(now), "frame_id": stream.target}
        message = {
            "transforms": [
                {"header": header, "child_frame_id": source, "transform": transform.write()}
                for source, transform in moved.items()
            ]
        }
        if stream.send(message, now) and moved:
            stream.told |= moved

    def _worth(self, stream: _Stream, source: str, transform: Transform) -> bool:
        told = stream.told.get(source)
        if told is None:
            return True
        if told == transform:
            return False
        return transform.distance(told) >= stream.distance or transform.angle(told) >= stream.angle
