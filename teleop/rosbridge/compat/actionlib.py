"""Actions of the host by the topics of ROS 1's actionlib, for clients without ROS 2 actions."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

from teleop.rosbridge.errors import OperationError, RosbridgeError
from teleop.rosbridge.graph.goals import Goal, GoalHandler, GoalStatus
from teleop.rosbridge.messages.message_types import Message, short_name
from teleop.rosbridge.protocol.connection import Connection
from teleop.rosbridge.protocol.observers import Observer
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.rosbridge.ros_time import MILLISECOND, SECOND, nanoseconds, stamp

_PERIOD_NS: Final = 200 * MILLISECOND
"""Period of the status topic while a goal is active: 5 Hz, as in actionlib [ns]."""

_RETENTION_NS: Final = 5 * SECOND
"""Time for which an ended goal remains in the status topic, as in actionlib [ns]."""

_MAX_GOALS: Final = 64
"""Simultaneous goals; further ones are rejected."""


class _Status(IntEnum):
    """Values of ``actionlib_msgs/GoalStatus``."""

    ACTIVE = 1
    PREEMPTED = 2
    SUCCEEDED = 3
    ABORTED = 4
    REJECTED = 5
    PREEMPTING = 6


_ENDS: Final = {
    GoalStatus.SUCCEEDED: _Status.SUCCEEDED,
    GoalStatus.CANCELED: _Status.PREEMPTED,
    GoalStatus.ABORTED: _Status.ABORTED,
}


def serve_actionlib(protocol: Protocol, name: str, type: str, handler: GoalHandler) -> None:
    """Provide an action by ``name/goal``, ``cancel``, ``status``, ``feedback`` and ``result``.

    The goals of a client that disconnects are cancelled. An empty cancel message cancels all goals
    of its sender, but not those of others.

    Args:
        protocol: Protocol to which the topics are added.
        name: Name of the action.
        type: Action type, such as ``actionlib_tutorials/Fibonacci``.
        handler: Starts executing each goal, and ends it later.
    """
    protocol.observers.add(_Actionlib(protocol, name.rstrip("/"), type, handler))


@dataclass(slots=True)
class _Entry:
    """A goal and its observer, which publishes feedback and result."""

    server: _Actionlib
    client: int
    identity: Message
    """The ``actionlib_msgs/GoalID``."""

    status: _Status = _Status.ACTIVE
    text: str = ""
    goal: Goal | None = None
    expires: int | None = None
    """Time at which the ended goal is removed [ns]; None while it is active."""

    def feedback(self, values: Message) -> None:
        self.server.publish("feedback", self, values)

    def done(self, status: GoalStatus, values: Message, text: str) -> None:
        self.status, self.text = _ENDS[status], text
        self.server.end(self, values)

    @property
    def message(self) -> Message:
        """The ``actionlib_msgs/GoalStatus``."""
        preempting = self.goal is not None and self.goal.cancelling
        status = _Status.PREEMPTING if preempting else self.status
        return {"goal_id": self.identity, "status": int(status), "text": self.text}


class _Actionlib(Observer):
    def __init__(self, protocol: Protocol, name: str, type: str, handler: GoalHandler) -> None:
        self._timers = protocol.timers
        self._topics = protocol.topics
        self._name = name
        self._handler = handler
        self._entries: dict[str, _Entry] = {}
        self._numbers = itertools.count(1)
        self._publishing = False
        prefix = short_name(protocol.registry.resolve_action(type))
        topics = protocol.topics
        topics.subscribe(f"{name}/goal", f"{prefix}ActionGoal", self._accept)
        topics.subscribe(f"{name}/cancel", "actionlib_msgs/GoalID", self._cancel)
        topics.advertise(f"{name}/status", "actionlib_msgs/GoalStatusArray", latch=True)
        topics.advertise(f"{name}/feedback", f"{prefix}ActionFeedback")
        topics.advertise(f"{name}/result", f"{prefix}ActionResult")
        self._publish_statuses()

    def disconnected(self, connection: Connection, now: int) -> None:
        """Cancel the goals of the client."""
        for entry in list(self._entries.values()):
            if entry.client == connection.id:
                _cancel_active(entry)

    def publish(self, topic: str, entry: _Entry, values: Message) -> None:
        """Publish feedback or a result."""
        message = {"header": self._header(), "status": entry.message, topic: values}
        self._topics.publish(f"{self._name}/{topic}", message, self._timers.now)

    def end(self, entry: _Entry, values: Message) -> None:
        """Publish the result of an ended goal, and keep it in the statuses for a while."""
        entry.expires = self._timers.now + _RETENTION_NS
        self._publish_statuses()
        self.publish("result", entry, values)

    def _accept(self, client: int, message: Message, now: int) -> None:
        identity = dict(message["goal_id"])
        if not identity["id"]:
            identity["id"] = f"{self._name}-{next(self._numbers)}"
        if identity["stamp"] == stamp(0):
            identity["stamp"] = stamp(now)
        if identity["id"] in self._entries:
            return
        if len(self._entries) >= _MAX_GOALS:
            raise OperationError(f"{self._name} accepts at most {_MAX_GOALS} goals at a time")
        entry = self._entries[identity["id"]] = _Entry(self, client, identity)
        entry.goal = Goal(client, message["goal"], now, entry)
        try:
            self._handler(entry.goal)
        except RosbridgeError as error:
            entry.goal = None
            entry.status, entry.text = _Status.REJECTED, str(error)
            self.end(entry, {})
            return
        self._publish_statuses()
        if not self._publishing:
            self._publishing = True
            self._timers.at(now + _PERIOD_NS, self._publish_periodically)

    def _cancel(self, client: int, message: Message, now: int) -> None:
        identity, until = message["id"], message["stamp"]
        for entry in list(self._entries.values()):
            named = bool(identity) and entry.identity["id"] == identity
            older = until != stamp(0) and nanoseconds(entry.identity["stamp"]) <= nanoseconds(until)
            every = not identity and until == stamp(0)
            if named or (entry.client == client and (older or every)):
                _cancel_active(entry)

    def _publish_periodically(self, now: int) -> None:
        """Publish the statuses again and again while there are goals."""
        for name, entry in list(self._entries.items()):
            if entry.expires is not None and entry.expires <= now:
                del self._entries[name]
        self._publish_statuses()
        self._publishing = bool(self._entries)
        if self._publishing:
            self._timers.at(now + _PERIOD_NS, self._publish_periodically)

    def _publish_statuses(self) -> None:
        statuses = [entry.message for entry in self._entries.values()]
        message = {"header": self._header(), "status_list": statuses}
        self._topics.publish(f"{self._name}/status", message, self._timers.now)

    def _header(self) -> Message:
        return {"stamp": stamp(self._timers.now), "frame_id": ""}


def _cancel_active(entry: _Entry) -> None:
    if entry.goal is not None and entry.goal.active:
        entry.goal.cancel()
