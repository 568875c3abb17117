"""``tf2_web_republisher``: transforms between requested frames, for browsers without a tf tree.

Clients request them by the action of ROS 1 or ROS 2, or by the service ``/republish_tfs``. They
receive each transform that has changed enough, at the requested rate.
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
from teleop.rosbridge.messages.message_types import Message
from teleop.rosbridge.protocol.connection import Connection
from teleop.rosbridge.protocol.observers import Observer
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.rosbridge.ros_time import SECOND, nanoseconds, stamp
from teleop.rosbridge.timers import Timer

_NAME: Final = "/tf2_web_republisher"
_SOURCES: Final = ("/tf", "/tf_static")

_RATES: Final = (0.1, 50.0)
"""Lowest and highest update rate [Hz]."""

_DEFAULT_RATE: Final = 10.0
"""Update rate of a request without one [Hz]."""

_DEFAULT_TIMEOUT_NS: Final = 10 * SECOND
"""Time for which a topic of the service exists without subscribers [ns]."""

_MAX_STREAMS: Final = 16
"""Simultaneous requests of one client."""

_MAX_FRAMES: Final = 256
"""Frames of one request."""

_CLIENT_WORK: Final = 2000.0
"""Transforms that are computed for one client [1/s]; further requests are served less often."""

_ANONYMOUS_WORK: Final = 4000.0
"""Transforms that are computed for all clients without a token together, if there are tokens [1/s]."""

_ALL_WORK: Final = 20_000.0
"""Transforms that are computed for all clients [1/s], about a tenth of a core."""


def serve_republisher(protocol: Protocol) -> None:
    """Provide the action and the service; ``/tf`` is monitored only while they are in use."""
    republisher = _Republisher(protocol)
    service_type = "tf2_web_republisher/RepublishTFs"
    protocol.services.serve("/republish_tfs", service_type, republisher.serve)
    action_type = "tf2_web_republisher_interfaces/TFSubscription"
    protocol.actions.serve(_NAME, action_type, republisher.begin)
    serve_actionlib(protocol, _NAME, "tf2_web_republisher/TFSubscription", republisher.begin)
    protocol.observers.add(republisher)


@dataclass(slots=True)
class _Stream:
    """A request, and the transforms sent for it."""

    client: int
    sources: list[str]
    target: str
    angle: float
    """Rotation from which on a transform is sent again [rad]."""

    distance: float
    """Translation from which on a transform is sent again [m]."""

    period: int
    """Time between two updates [ns]."""

    send: Callable[[Message, int], bool]
    """Sends a ``TFArray``; returns whether there was a receiver."""

    abandon: Callable[[int], object] = lambda now: None
    """Called when the client has disconnected."""

    sent: dict[str, Transform] = field(default_factory=dict)
    """The last transform that was sent of each source frame."""

    anonymous: bool = False
    """Whether the client has no token, on a server that knows tokens."""

    timer: Timer | None = None

    @property
    def work(self) -> float:
        """Transforms that are computed for it [1/s]."""
        return len(self.sources) * SECOND / self.period


class _Republisher(Observer):
    def __init__(self, protocol: Protocol) -> None:
        self._protocol = protocol
        self._topics = protocol.topics
        self._timers = protocol.timers
        self._tree = TransformTree()
        self._streams: list[_Stream] = []
        self._number = 0

    def begin(self, goal: Goal) -> None:
        """Execute a goal until it is cancelled."""

        def send(message: Message, now: int) -> bool:
            goal.feedback(message)
            return True

        stream = self._stream(goal.client, goal.request, send)
        goal.on_cancel(goal.canceled)
        goal.on_end(lambda: self._stop(stream))
        self._start(stream, goal.accepted)

    def serve(self, client: int, request: Message, now: int) -> Message:
        """Respond with the name of a topic, which exists while it has subscribers."""
        topic = f"/tf_repub_{self._number}"
        timeout = nanoseconds(request["timeout"])
        timeout = timeout if timeout > 0 else _DEFAULT_TIMEOUT_NS
        last_wanted = now

        def send(message: Message, now: int) -> bool:
            nonlocal last_wanted
            if self._topics.wanted(topic):
                last_wanted = now
                if message["transforms"]:
                    self._topics.publish(topic, message, now)
                return True
            if now - last_wanted >= timeout:
                end()
            return False

        def end() -> None:
            self._stop(stream)
            self._topics.unadvertise(topic)

        def abandon(now: int) -> None:
            nonlocal timeout
            timeout = 0  # other clients may have subscribed; it ends when they have left, too
            if not self._topics.wanted(topic):
                end()

        stream = self._stream(client, request, send)
        stream.abandon = abandon
        self._number += 1
        self._topics.advertise(topic, "tf2_web_republisher/TFArray")
        self._start(stream, now)
        return {"topic_name": topic}

    def disconnected(self, connection: Connection, now: int) -> None:
        """Stop the requests of the client."""
        for stream in list(self._streams):
            if stream.client == connection.id:
                stream.abandon(now)

    def _stream(
        self, client: int, request: Message, send: Callable[[Message, int], bool]
    ) -> _Stream:
        if sum(stream.client == client for stream in self._streams) >= _MAX_STREAMS:
            raise ServiceError(f"a client may have at most {_MAX_STREAMS} requests")
        sources = [frame(source) for source in request["source_frames"]]
        if len(sources) > _MAX_FRAMES:
            raise ServiceError(f"a request may have at most {_MAX_FRAMES} frames")
        rate = request["rate"] if request["rate"] > 0 else _DEFAULT_RATE
        rate = min(max(rate, _RATES[0]), _RATES[1])
        anonymous = self._anonymous(client)
        if sources:  # a request for more than there is room for is served less often
            rate = min(rate, self._room(client, anonymous) / len(sources))
        if rate < _RATES[0]:
            raise ServiceError("too many transforms are requested: cancel other requests first")
        return _Stream(
            client,
            sources,
            frame(request["target_frame"]),
            math.radians(request["angular_thres"]),  # requests contain degrees
            request["trans_thres"],
            int(SECOND / rate),
            send,
            anonymous=anonymous,
        )

    def _anonymous(self, client: int) -> bool:
        access = self._protocol.connections.access(client)
        guarded = self._protocol.authenticator is not None
        return guarded and (access is None or not access.key)

    def _room(self, client: int, anonymous: bool) -> float:
        """Return how many transforms may be computed for a further request [1/s]."""
        own = sum(stream.work for stream in self._streams if stream.client == client)
        room = min(_CLIENT_WORK - own, _ALL_WORK - sum(stream.work for stream in self._streams))
        if anonymous:
            theirs = sum(stream.work for stream in self._streams if stream.anonymous)
            room = min(room, _ANONYMOUS_WORK - theirs)
        return room

    def _start(self, stream: _Stream, now: int) -> None:
        if not self._streams:
            for source in _SOURCES:
                self._topics.monitor(source, "tf2_msgs/TFMessage", self._add)
        self._streams.append(stream)
        # By a timer, as the response with the name of the topic is sent first.
        stream.timer = self._timers.at(now, lambda now: self._update(stream, now))

    def _stop(self, stream: _Stream) -> None:
        if stream.timer is not None:
            stream.timer.cancel()
        if stream in self._streams:
            self._streams.remove(stream)
        if not self._streams:
            self._tree.clear()
            for source in _SOURCES:
                self._topics.unmonitor(source, self._add)

    def _add(self, message: Message, now: int) -> None:
        self._tree.add(message)

    def _update(self, stream: _Stream, now: int) -> None:
        """Send the transforms that have changed, and schedule the next update."""
        stream.timer = self._timers.at(now + stream.period, lambda now: self._update(stream, now))
        changed = {}
        for source in stream.sources:
            transform = self._tree.find(stream.target, source)
            if transform is not None and _has_changed(stream, source, transform):
                changed[source] = transform
        header = {"stamp": stamp(now), "frame_id": stream.target}
        message = {
            "transforms": [
                {"header": header, "child_frame_id": source, "transform": transform.write()}
                for source, transform in changed.items()
            ]
        }
        if stream.send(message, now) and changed:
            stream.sent |= changed


def _has_changed(stream: _Stream, source: str, transform: Transform) -> bool:
    sent = stream.sent.get(source)
    if sent is None:
        return True
    if sent == transform:
        return False
    return transform.distance(sent) >= stream.distance or transform.angle(sent) >= stream.angle
