"""roslibpy as it is published drives each interface of the arm, with messages as MoveIt Servo and ros_control send them.

Prints a line of JSON for each interface: its name, and what is wrong or null. Time passes by ``/sim/step`` alone.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any

import roslibpy

JOINTS = [f"arm_joint_{n}" for n in range(1, 6)]
ros = roslibpy.Ros("127.0.0.1", int(sys.argv[1]))
newest: dict[str, dict[str, Any]] = {}


def message(kind: str, topic: str, **values: Any) -> None:
    """Publish a message, from a publisher that is there from then on."""
    if topic not in publishers:
        publishers[topic] = roslibpy.Topic(ros, topic, kind)
        publishers[topic].advertise()
    publishers[topic].publish(roslibpy.Message(values))


def ask(service: str, kind: str, **values: Any) -> dict[str, Any]:
    """Call a service and wait."""
    made = roslibpy.Service(ros, service, kind)
    return dict(made.call(roslibpy.ServiceRequest(values), timeout=60))


def step(ticks: int = 1) -> None:
    """Let time pass."""
    ask("/sim/step", "farsteer_msgs/srv/Step", ticks=ticks)


def watch(topic: str, kind: str) -> None:
    roslibpy.Topic(ros, topic, kind).subscribe(lambda got: newest.__setitem__(topic, dict(got)))


def state() -> dict[str, Any]:
    """Return the arm's newest state."""
    return newest["/arm/state"]


def stamped(frame: str = "base_link", tick: int = 0) -> dict[str, Any]:
    return {"stamp": {"sec": 100, "nanosec": 20_000_000 * tick}, "frame_id": frame}


def pose(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> dict[str, Any]:
    return {"position": {"x": x, "y": y, "z": z}, "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}}


def moved(mode: str, send: Callable[[int], None], ticks: int = 25) -> str | None:
    """Send for some ticks; return what is wrong unless the arm moved by that."""
    before = state()["wanted"]
    for tick in range(ticks):
        send(tick)
        step()
    now = state()
    step(80)  # silence ends it, and a pause of a second is over
    if now["mode"] != mode:
        return f"mode {now['mode']}: {now['reason']}"
    way = max(abs(a - b) for a, b in zip(now["wanted"], before, strict=True))
    return None if way > 0.01 else f"moved by {way} only"


def jog(tick: int) -> None:
    # As moveit_servo's servo_keyboard_input.cpp: all joints are named, and one has a velocity.
    velocities = [0.0, 0.5, 0.8, 0.0, 0.0]
    header = stamped(tick=tick)
    message(
        "control_msgs/msg/JointJog",
        "/servo_node/delta_joint_cmds",
        header=header,
        joint_names=JOINTS,
        velocities=velocities,
        duration=0.0,
    )


def twist(tick: int) -> None:
    zero = {"x": 0.0, "y": 0.0, "z": 0.0}
    message(
        "geometry_msgs/msg/TwistStamped",
        "/servo_node/delta_twist_cmds",
        header=stamped(tick=tick),
        twist={"linear": {**zero, "z": 0.05}, "angular": zero},
    )


def lead(tick: int) -> None:
    tip = state()["tip"]["position"]
    # Of base_link: the bracket is 0.29 m ahead and 0.20 m up.
    goal = pose(tip["x"] + 0.29, tip["y"] + 0.03, tip["z"] + 0.20)
    message(
        "geometry_msgs/msg/PoseStamped",
        "/servo_node/pose_target_cmds",
        header=stamped(tick=tick),
        pose=goal,
    )


def hand(tick: int) -> None:
    message(
        "farsteer_msgs/msg/Hand",
        "/arm/hand",
        header=stamped("arm_base", tick),
        pose=pose(y=-0.002 * tick),
        engaged=tick > 1,
        tracked=True,
    )


def joined(tick: int) -> None:
    header = stamped("arm_base", tick)
    grip = int(tick > 1)
    message("sensor_msgs/msg/Joy", "/arm/joy", header=header, axes=[0.0], buttons=[grip])
    message(
        "geometry_msgs/msg/PoseStamped",
        "/arm/hand_pose",
        header=header,
        pose=pose(y=0.002 * tick),
    )


def goal(action: str, kind: str, values: dict[str, Any]) -> dict[str, Any]:
    """Send a goal and step until its result has come; return it."""
    results: SimpleQueue[Any] = SimpleQueue()
    client = roslibpy.ActionClient(ros, action, kind)
    client.send_goal(roslibpy.Goal(values), results.put, lambda feedback: None, results.put)
    for _ in range(400):
        step(5)
        if not results.empty():
            return dict(results.get())
    raise TimeoutError(action)


def points(*angles: list[float]) -> dict[str, Any]:
    """Return a trajectory as ros_control's and MoveIt's are: from where the arm stands."""
    return {
        "joint_names": JOINTS,
        "points": [
            {"positions": each, "time_from_start": {"sec": n, "nanosec": 0}}
            for n, each in enumerate(angles)
        ],
    }


def trajectory() -> str | None:
    here = state()["wanted"]
    there = [here[0] + 0.2, *here[1:]]
    message(
        "trajectory_msgs/msg/JointTrajectory",
        "/arm_controller/joint_trajectory",
        **points(here, there),
    )
    step(100)
    way = abs(state()["wanted"][0] - there[0])
    return None if way < 0.01 else f"{way} rad off: {state()['reason']}"


def follow() -> str | None:
    here = state()["wanted"]
    there = [here[0] - 0.2, *here[1:]]
    values = {
        "trajectory": points(here, there),
        "goal_tolerance": [{"name": JOINTS[0], "position": 0.1}],
        "goal_time_tolerance": {"sec": 1, "nanosec": 0},
    }
    found = goal(
        "/arm_controller/follow_joint_trajectory",
        "control_msgs/action/FollowJointTrajectory",
        values,
    )
    return None if found["values"]["error_code"] == 0 else str(found)


def grip() -> str | None:
    command = {"command": {"position": 0.04, "max_effort": 4.0}}
    found = goal("/gripper_controller/gripper_cmd", "control_msgs/action/GripperCommand", command)
    return None if found["values"]["reached_goal"] else str(found)


def move() -> str | None:
    found = goal("/arm/move", "farsteer_msgs/action/ArmMove", {"name": "ready"})
    return None if found["values"]["outcome"] == "done" else str(found)


def confirm() -> str | None:
    """Run a move that goes on only while it is confirmed."""
    results: SimpleQueue[Any] = SimpleQueue()
    client = roslibpy.ActionClient(ros, "/arm/move", "farsteer_msgs/action/ArmMove")
    values = {"angles": [0.3, *state()["wanted"][1:]], "hold_to_run": True}
    client.send_goal(roslibpy.Goal(values), results.put, lambda feedback: None, results.put)
    step(50)
    if not results.empty() or abs(state()["wanted"][0] - 0.3) < 0.01:
        return "moved without being confirmed"
    for _ in range(200):
        message("std_msgs/msg/Bool", "/arm/confirm", data=True)
        step(5)
        if not results.empty():
            found = dict(results.get())
            return None if found["values"]["outcome"] == "done" else str(found)
    return f"did not end: {state()['reason']}"


def mirror() -> str | None:
    watch("/arm/mirror", "farsteer_msgs/msg/ArmMirror")
    degrees = [57.29577951308232 * angle for angle in state()["angles"]]
    for _ in range(10):
        message("std_msgs/msg/Float64MultiArray", "/arm/mirror_degrees", data=[*degrees, 0.0])
        step()
    return None if newest["/arm/mirror"]["state"] == "following" else str(newest["/arm/mirror"])


def kinematics() -> str | None:
    joints = {"joint_state": {"name": JOINTS, "position": state()["wanted"]}}
    found = ask(
        "/compute_fk",
        "moveit_msgs/srv/GetPositionFK",
        header={"frame_id": "base_link"},
        fk_link_names=["tool0"],
        robot_state=joints,
    )
    stamped_pose = found["pose_stamped"][0]
    request = {"group_name": "arm", "pose_stamped": stamped_pose, "robot_state": joints}
    back = ask("/compute_ik", "moveit_msgs/srv/GetPositionIK", ik_request=request)
    angles = back["solution"]["joint_state"]["position"]
    off = max(abs(a - b) for a, b in zip(angles, state()["wanted"], strict=True))
    return None if off < 1e-6 else f"{off} rad off"


def later(service: str) -> str | None:
    """Call a service that answers once the arm has done it."""
    answers: SimpleQueue[Any] = SimpleQueue()
    made = roslibpy.Service(ros, service, "std_srvs/srv/Trigger")
    made.call(roslibpy.ServiceRequest(), answers.put, answers.put)
    for _ in range(400):
        step(5)
        if not answers.empty():
            found = dict(answers.get())
            return None if found["success"] else str(found)
    return "no answer"


def way_out() -> str | None:
    """There is nothing to get out of, which it says."""
    found = later("/arm/way_out")
    return None if found is not None and "nothing" in found else str(found)


def switch() -> str | None:
    kind = "moveit_msgs/srv/ServoCommandType"
    good = ask("/servo_node/switch_command_type", kind, command_type=0)["success"]
    return None if good else "refused"


def pause() -> str | None:
    both = [ask("/servo_node/pause_servo", "std_srvs/srv/SetBool", data=d) for d in (True, False)]
    return None if all(each["success"] for each in both) else str(both)


def file() -> str | None:
    kind = "file_server/srv/GetBinaryFile"
    found = ask("/file_server/get_file", kind, name="package://farsteer/robot.urdf")
    return None if found["value"] else "empty"


def came(topic: str) -> str | None:
    return None if newest.get(topic) else "nothing came"


CHECKS: list[tuple[str, Callable[[], str | None]]] = [
    ("/servo_node/delta_joint_cmds", lambda: moved("jog", jog)),
    ("/servo_node/delta_twist_cmds", lambda: moved("twist", twist)),
    ("/servo_node/pose_target_cmds", lambda: moved("pose", lead)),
    ("/arm/hand", lambda: moved("hand", hand)),
    ("/arm/hand_pose", lambda: moved("hand", joined)),
    ("/arm/joy", lambda: moved("hand", joined)),
    ("/arm_controller/joint_trajectory", trajectory),
    ("/arm_controller/follow_joint_trajectory", follow),
    ("/gripper_controller/gripper_cmd", grip),
    ("/arm/move", move),
    ("/arm/confirm", confirm),
    ("/arm/mirror_degrees", mirror),
    ("/compute_fk", kinematics),
    ("/compute_ik", kinematics),
    ("/arm/way_out", way_out),
    ("/arm/stow", lambda: later("/arm/stow")),
    ("/servo_node/switch_command_type", switch),
    ("/servo_node/pause_servo", pause),
    ("/file_server/get_file", file),
]
OUTPUTS = {
    "/arm/state": "farsteer_msgs/msg/ArmState",
    "/arm/info": "farsteer_msgs/msg/ArmInfo",
    "/servo_node/status": "moveit_msgs/msg/ServoStatus",
    "/arm/joint_degrees": "std_msgs/msg/Float64MultiArray",
    "/arm/servo_pulses": "std_msgs/msg/UInt16MultiArray",
    "/arm/feedback": "sensor_msgs/msg/JoyFeedbackArray",
    "/joint_states": "sensor_msgs/msg/JointState",
    "/robot_description": "std_msgs/msg/String",
}
publishers: dict[str, roslibpy.Topic] = {}


def say(name: str, problem: str | None) -> None:
    sys.stdout.write(json.dumps([name, problem]) + "\n")
    sys.stdout.flush()


def main() -> None:
    ros.run(20)
    for topic, kind in OUTPUTS.items():
        watch(topic, kind)
    step(10)
    for name, check in CHECKS:
        try:
            problem = check()
        except Exception as error:
            problem = repr(error)
        say(name, problem)
    for topic in (*OUTPUTS, "/arm/mirror"):
        say(topic, came(topic))
    ros.terminate()


if __name__ == "__main__":
    main()
