"""What the test suites of rosbridge clients expect to find behind a server, besides the standard.

Sources: ``tests/`` in the source distribution of roslibpy 2.1.0, ``test/`` of roslibjs. Where their
actions need time, so that a goal can be cancelled, a step takes half a second here.
"""

from __future__ import annotations

from typing import Final

from teleop.rosbridge.compat.actionlib import serve_actionlib
from teleop.rosbridge.errors import ServiceError
from teleop.rosbridge.graph.goals import Goal
from teleop.rosbridge.messages.message_types import Message
from teleop.rosbridge.protocol.protocol import Protocol

_STEP_NS: Final = 500_000_000
_HIGHEST_ORDER: Final = 44
"""The last Fibonacci number that an int32 holds is the 47th, and two are given."""


def serve_fixtures(protocol: Protocol) -> None:
    """Offer the topics, services and actions that client suites use."""
    protocol.advertise("/listener", "std_msgs/String", latch=True)
    protocol.publish("/listener", {"data": "Hello, World"}, 0)
    protocol.serve("/add_two_ints", "rospy_tutorials/AddTwoInts", _add)
    protocol.advertise("/tf_static", "tf2_msgs/TFMessage", latch=True)
    frame = {"header": {"frame_id": "world"}, "child_frame_id": "turtle1"}
    protocol.publish("/tf_static", {"transforms": [frame]}, 0)
    # The tutorials of the two ROS count differently: by the numbers given, and by those added.
    protocol.serve_action(
        "/fibonacci", "example_interfaces/Fibonacci", lambda goal: _Fibonacci(protocol, goal, 1)
    )
    serve_actionlib(
        protocol,
        "/fibonacci",
        "actionlib_tutorials/Fibonacci",
        lambda goal: _Fibonacci(protocol, goal, 0),
    )


def _add(client: int, request: Message, now: int) -> Message:
    total = request["a"] + request["b"]
    if not -(2**63) <= total < 2**63:
        raise ServiceError("the sum is out of range")
    return {"sum": total}


class _Fibonacci:
    """Counts up, a step at a time, and tells of each."""

    def __init__(self, protocol: Protocol, goal: Goal, fewer: int) -> None:
        self._protocol = protocol
        self._goal = goal
        self._steps = goal.request["order"] - fewer
        if not 0 <= self._steps <= _HIGHEST_ORDER:
            raise ServiceError(f"an order is 0 to {_HIGHEST_ORDER}, got {goal.request['order']}")
        self._sequence = [0, 1]
        goal.on_cancel(lambda: goal.canceled({"sequence": self._sequence}))
        protocol.at(goal.accepted, self._step)

    def _step(self, now: int) -> None:
        if not self._goal.active:
            return
        if self._steps == 0:
            self._goal.succeed({"sequence": self._sequence})
            return
        self._steps -= 1
        self._sequence.append(self._sequence[-1] + self._sequence[-2])
        self._goal.feedback({"sequence": self._sequence})
        self._protocol.at(now + _STEP_NS, self._step)
