"""roslibpy as it is published, with its callbacks in a thread of its own."""

from __future__ import annotations

import sys
from queue import SimpleQueue
from typing import Any

import roslibpy

from tests.teleop.scenario.clients.programs.steering import (
    CONTROL,
    POSE,
    STATE,
    judged,
    towards,
    twist,
)


def drive(host: str, port: int) -> int:
    ros = roslibpy.Ros(host=host, port=port)
    ros.run(timeout=20)
    over: SimpleQueue[int] = SimpleQueue()
    state: dict[str, Any] = {}
    control: dict[str, Any] = {}
    commands = roslibpy.Topic(ros, "/cmd_vel", "geometry_msgs/Twist")
    commands.advertise()

    def know(message: dict[str, Any]) -> None:
        state.update(message)
        if message["phase"] == "over":
            over.put(judged(message))

    def steer(message: dict[str, Any]) -> None:
        if state and control:
            commands.publish(roslibpy.Message(twist(*towards(state, control, message))))

    roslibpy.Topic(ros, STATE, "farsteer_msgs/ScenarioState").subscribe(know)
    roslibpy.Topic(ros, CONTROL, "farsteer_msgs/TeleopState").subscribe(control.update)
    roslibpy.Topic(ros, POSE, "geometry_msgs/PoseWithCovarianceStamped").subscribe(steer)
    status = over.get(timeout=60)
    ros.terminate()
    return status


if __name__ == "__main__":
    sys.exit(drive(sys.argv[1], int(sys.argv[2])))
