"""A server with the topics, services and actions that the test suites of rosbridge clients expect.

Sources: ``tests/`` in the source distribution of roslibpy 2.1.0, ``test/`` of roslibjs. Where an
action must take time, so that a goal can be cancelled, a step takes half a second.
"""

from __future__ import annotations

import asyncio
import sys
from typing import Final

from teleop.rosbridge import Protocol, Server, TypeRegistry
from teleop.rosbridge.compat.actionlib import serve_actionlib
from teleop.rosbridge.compat.standard_services import serve_standard
from teleop.rosbridge.errors import ServiceError
from teleop.rosbridge.graph.goals import Goal
from teleop.rosbridge.messages.message_types import Message
from teleop.rosbridge.ros_time import SECOND
from teleop.rosbridge.timers import Timers

_STEP_NS: Final = SECOND // 2
_MAX_ORDER: Final = 44
"""An int32 holds 47 Fibonacci numbers, of which two are given."""


async def main() -> None:
    """Serve until the end of standard input."""
    protocol = Protocol(TypeRegistry())
    serve_standard(protocol)
    serve_fixtures(protocol)
    async with Server(protocol, port=0) as server:
        print(server.url, flush=True)  # noqa: T201 - read by who has started this
        await asyncio.to_thread(sys.stdin.read)


def serve_fixtures(protocol: Protocol) -> None:
    """Provide the topics, services and actions of the test suites."""
    topics, timers = protocol.topics, protocol.timers
    topics.advertise("/listener", "std_msgs/String", latch=True)
    topics.publish("/listener", {"data": "Hello, World"}, 0)
    protocol.services.serve("/add_two_ints", "rospy_tutorials/AddTwoInts", _add)
    topics.advertise("/tf_static", "tf2_msgs/TFMessage", latch=True)
    frame = {"header": {"frame_id": "world"}, "child_frame_id": "turtle1"}
    topics.publish("/tf_static", {"transforms": [frame]}, 0)
    # The order is the number of terms in the tutorial of ROS 2, and of added terms in ROS 1.
    protocol.actions.serve(
        "/fibonacci", "example_interfaces/Fibonacci", lambda goal: _Fibonacci(timers, goal, 1)
    )
    serve_actionlib(
        protocol,
        "/fibonacci",
        "actionlib_tutorials/Fibonacci",
        lambda goal: _Fibonacci(timers, goal, 0),
    )


def _add(client: int, request: Message, now: int) -> Message:
    total = request["a"] + request["b"]
    if not -(2**63) <= total < 2**63:
        raise ServiceError("the sum is out of range")
    return {"sum": total}


class _Fibonacci:
    """Appends a term per step, with feedback."""

    def __init__(self, timers: Timers, goal: Goal, given: int) -> None:
        self._timers = timers
        self._goal = goal
        self._steps = goal.request["order"] - given
        if not 0 <= self._steps <= _MAX_ORDER:
            raise ServiceError(f"order must be 0 to {_MAX_ORDER}, got {goal.request['order']}")
        self._sequence = [0, 1]
        goal.on_cancel(lambda: goal.canceled({"sequence": self._sequence}))
        timers.at(goal.accepted, self._step)

    def _step(self, now: int) -> None:
        if not self._goal.active:
            return
        if self._steps == 0:
            self._goal.succeed({"sequence": self._sequence})
            return
        self._steps -= 1
        self._sequence.append(self._sequence[-1] + self._sequence[-2])
        self._goal.feedback({"sequence": self._sequence})
        self._timers.at(now + _STEP_NS, self._step)


if __name__ == "__main__":
    asyncio.run(main())
