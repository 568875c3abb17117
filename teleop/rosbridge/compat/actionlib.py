"""An action of the host by the topics of ROS 1's actionlib, for clients that know no other form."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

from teleop.rosbridge.errors import OperationError, RosbridgeError
from teleop.rosbridge.graph.goals import Goal, GoalHandler, GoalStatus
from teleop.rosbridge.messages.message_completion import stamp
from teleop.rosbridge.messages.message_types import Message, short_name
from teleop.rosbridge.protocol.protocol import Protocol

_PERIOD_NS: Final = 200_000_000
"""Between two statuses while a goal is under way: actionlib's 5 Hz."""

_REMEMBERED_NS: Final = 5_000_000_000
"""For which a goal that has ended is still in the statuses, as in actionlib."""

_MOST: Final = 64
"""Goals at one time; further ones are rejected."""


class _Status(IntEnum):
    """Of ``actionlib_msgs/GoalStatus``."""

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
    """Offer an action under ``name/goal``, ``cancel``, ``status``, ``feedback`` and ``result``.

    A client that leaves has its goals cancelled. An empty cancel ends all goals of its sender, and
    nobody else's.

    Args:
        protocol: Gets the topics.
        name: Of the action.
        type: Of the action, without what actionlib puts behind it: ``actionlib_tutorials/Fibonacci``.
        handler: Is given each goal, and ends it some time.
    """
    _Actionlib(protocol, name.rstrip("/"), type, handler)


@dataclass(slots=True)
class _Entry:
    """A goal, as its sink: what becomes of it goes out on the topics."""

    server: _Actionlib
    client: int
    identity: Message
    """A ``GoalID``."""

    status: _Status = _Status.ACTIVE
    text: str = ""
    goal: Goal | None = None
    until: int | None = None
    """When it is forgotten [ns]; None while it is under way."""

    def feedback(self, values: Message) -> None:
        self.server.say("feedback", self, values)

    def done(self, status: GoalStatus, values: Message, text: str) -> None:
        self.status, self.text = _ENDS[status], text
        self.server.end(self, values)

    @property
    def message(self) -> Message:
        """Its ``GoalStatus``."""
        preempting = self.goal is not None and self.goal.cancelling
        status = _Status.PREEMPTING if preempting else self.status
        return {"goal_id": self.identity, "status": int(status), "text": self.text}


class _Actionlib:
    def __init__(self, protocol: Protocol, name: str, type: str, handler: GoalHandler) -> None:
        self._protocol = protocol
        self._name = name
        self._handler = handler
        self._entries: dict[str, _Entry] = {}
        self._numbers = itertools.count(1)
        self._beating = False
        kind = short_name(protocol.registry.resolve_action(type))
        protocol.listen(f"{name}/goal", f"{kind}ActionGoal", self._goal)
        protocol.listen(f"{name}/cancel", "actionlib_msgs/GoalID", self._cancel)
        protocol.advertise(f"{name}/status", "actionlib_msgs/GoalStatusArray", latch=True)
        protocol.advertise(f"{name}/feedback", f"{kind}ActionFeedback")
        protocol.advertise(f"{name}/result", f"{kind}ActionResult")
        protocol.on_disconnect(self._leave)
        self._tell()

    def say(self, end: str, entry: _Entry, values: Message) -> None:
        """Publish feedback or a result."""
        message = {"header": self._header(), "status": entry.message, end: values}
        self._protocol.publish(f"{self._name}/{end}", message, self._protocol.now)

    def end(self, entry: _Entry, values: Message) -> None:
        """Publish how a goal ended, and remember it for a while."""
        entry.until = self._protocol.now + _REMEMBERED_NS
        self._tell()
        self.say("result", entry, values)

    def _goal(self, client: int, message: Message, now: int) -> None:
        identity = dict(message["goal_id"])
        if not identity["id"]:
            identity["id"] = f"{self._name}-{next(self._numbers)}"
        if identity["stamp"] == stamp(0):
            identity["stamp"] = stamp(now)
        if identity["id"] in self._entries:
            return
        if len(self._entries) >= _MOST:
            raise OperationError(f"{self._name} takes at most {_MOST} goals at one time")
        entry = self._entries[identity["id"]] = _Entry(self, client, identity)
        entry.goal = Goal(client, message["goal"], now, entry)
        try:
            self._handler(entry.goal)
        except RosbridgeError as error:
            entry.goal = None
            entry.status, entry.text = _Status.REJECTED, str(error)
            self.end(entry, {})
            return
        self._tell()
        if not self._beating:
            self._beating = True
            self._protocol.at(now + _PERIOD_NS, self._beat)

    def _cancel(self, client: int, message: Message, now: int) -> None:
        identity, until = message["id"], message["stamp"]
        for entry in list(self._entries.values()):
            named = bool(identity) and entry.identity["id"] == identity
            older = until != stamp(0) and _time(entry.identity["stamp"]) <= _time(until)
            every = not identity and until == stamp(0)
            if named or (entry.client == client and (older or every)):
                self._end(entry)

    def _leave(self, client: int, now: int) -> None:
        for entry in list(self._entries.values()):
            if entry.client == client:
                self._end(entry)

    def _end(self, entry: _Entry) -> None:
        if entry.goal is not None and entry.goal.active:
            entry.goal.cancel()

    def _beat(self, now: int) -> None:
        """Tell the statuses again and again while there is a goal to tell of."""
        for name, entry in list(self._entries.items()):
            if entry.until is not None and entry.until <= now:
                del self._entries[name]
        self._tell()
        self._beating = bool(self._entries)
        if self._beating:
            self._protocol.at(now + _PERIOD_NS, self._beat)

    def _tell(self) -> None:
        statuses = [entry.message for entry in self._entries.values()]
        message = {"header": self._header(), "status_list": statuses}
        self._protocol.publish(f"{self._name}/status", message, self._protocol.now)

    def _header(self) -> Message:
        return {"stamp": stamp(self._protocol.now), "frame_id": ""}


def _time(when: Message) -> tuple[int, int]:
    return when["sec"], when["nanosec"]
