from __future__ import annotations

import re
from pathlib import Path

import pytest

from teleop.rosbridge.errors import TypeNameError
from teleop.rosbridge.messages.message_types import short_name
from teleop.rosbridge.messages.type_registry import TypeRegistry
from tests.teleop.rosbridge.support import REGISTRY, ROOT


@pytest.mark.parametrize(
    "name", ["sensor_msgs/Joy", "sensor_msgs/msg/Joy", "sensor_msgs/joy", "SENSOR_MSGS/MSG/JOY"]
)
def test_spellings_of_a_type_have_one_canonical_name(name: str) -> None:
    assert REGISTRY.resolve(name) == "sensor_msgs/msg/Joy"
    assert name in REGISTRY
    service = name.lower().replace("sensor_msgs", "std_srvs").replace("joy", "Trigger")
    assert REGISTRY.resolve_service(service.replace("msg/", "srv/")) == "std_srvs/srv/Trigger"


def test_unknown_types_are_answered_with_similar_names() -> None:
    with pytest.raises(TypeNameError, match="did you mean sensor_msgs/PointCloud2"):
        REGISTRY.resolve("sensor_msgs/PointClud2")
    with pytest.raises(TypeNameError, match=r"did you mean .*example_interfaces/Fibonacci"):
        REGISTRY.resolve_action("example_interface/Fibonaci")


@pytest.mark.parametrize("name", ["", "Joy", "/", "a" * 1_000_000, "sensor_msgs/", "é/ü"])
def test_invalid_type_names_are_rejected_in_one_line(name: str) -> None:
    with pytest.raises(TypeNameError) as caught:
        REGISTRY.resolve(name)
    assert len(str(caught.value)) < 200
    assert name not in REGISTRY or name == ""


def test_farsteer_types_are_read_from_their_folder() -> None:
    ours = {short_name(name) for name in REGISTRY if name.startswith("farsteer_msgs/")}
    folder = ROOT / "assets" / "farsteer_msgs"
    messages = {f"farsteer_msgs/{path.stem}" for path in (folder / "msg").glob("*.msg")}
    parts = [f"{a}{b}" for a in ("Action", "") for b in ("Feedback", "Goal", "Result")]
    actions = {
        f"farsteer_msgs/{path.stem}{part}"
        for path in (folder / "action").glob("*.action")
        for part in ("Action", *parts)
    }
    assert len(messages) > 10
    assert len(actions) > 10
    assert ours == messages | actions
    step = REGISTRY.service("farsteer_msgs/Step")
    assert [field.name for field in step.request.fields] == ["ticks"]
    assert [field.name for field in step.response.fields] == ["success", "message", "stamp"]


def test_empty_messages_have_no_field() -> None:
    assert REGISTRY["std_msgs/Empty"].fields == ()
    assert REGISTRY.service("std_srvs/Empty").request.fields == ()


def test_folders_without_definitions_are_rejected(tmp_path: Path) -> None:
    with pytest.raises(TypeNameError, match=r"no .msg, .srv or .action files"):
        TypeRegistry([tmp_path])
    with pytest.raises(TypeNameError, match="is not a folder"):
        TypeRegistry([tmp_path / "nope"])


def test_packages_of_messages_services_and_actions_can_be_added(tmp_path: Path) -> None:
    for package, part, name, text in (
        ("lamp_msgs", "msg", "Lamp.msg", "bool on\nother_msgs/Color color  # of another package\n"),
        ("lamp_msgs", "srv", "Switch.srv", "bool on\r\n---\r\nbool done\r\n"),
        ("lamp_msgs", "action", "Dim.action", "float32 goal\n---\n---\nLamp now\n"),
        ("other_msgs", "", "Color.msg", "uint8 RED=255\nuint8 red\n"),
        ("other_msgs", "", "README.md", "no definition"),
    ):
        folder = tmp_path / package / part
        folder.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, newline="")
    registry = TypeRegistry([tmp_path])
    assert registry["lamp_msgs/Lamp"].names == {"on", "color"}
    assert registry["other_msgs/color"].constants == (("RED", "255"),)
    assert registry.service("lamp_msgs/srv/Switch").response.names == {"done"}
    dim = registry.action("lamp_msgs/action/Dim")
    assert [list(part.names) for part in (dim.goal, dim.result, dim.feedback)] == [
        ["goal"],
        [],
        ["now"],
    ]
    assert registry["lamp_msgs/DimActionFeedback"].names == {"header", "status", "feedback"}
    assert TypeRegistry([tmp_path / "other_msgs"])["other_msgs/Color"].names == {"red"}


@pytest.mark.parametrize("text", ["float32 goal\n---\nbool x", "---\n---\n---\n", ""])
def test_action_definitions_have_three_parts(text: str) -> None:
    with pytest.raises(TypeNameError, match="an action's definition must contain 2 lines '---'"):
        TypeRegistry().add_action("odd_msgs/Odd", text)


def test_fields_of_unknown_types_are_rejected_on_loading(tmp_path: Path) -> None:
    (tmp_path / "Odd.msg").write_text("nowhere_msgs/Nothing thing\n")
    with pytest.raises(TypeNameError, match=r"field thing .* unknown type nowhere_msgs/Nothing"):
        TypeRegistry([tmp_path])


def test_definitions_are_read_behind_a_mark_of_utf_8_and_named_if_they_are_no_text(
    tmp_path: Path,
) -> None:
    (tmp_path / "Odd.msg").write_text("float64 angle  # [°]\n", encoding="utf-8-sig")
    registry = TypeRegistry([tmp_path])
    assert registry[f"{tmp_path.name}/Odd"].names == {"angle"}
    (tmp_path / "Odd.msg").write_text("float64 angle  # [°]\n", encoding="iso-8859-1")
    with pytest.raises(TypeNameError, match=r"cannot read .*/Odd\.msg: it is no text in UTF-8"):
        TypeRegistry([tmp_path])


@pytest.mark.parametrize("line", ["float64", "[] x", "uint8 = 3", "---", "float64 x;", "int8 a-b"])
def test_invalid_definitions_are_rejected_by_their_line(line: str) -> None:
    with pytest.raises(TypeNameError, match=f"Odd cannot be parsed at '{re.escape(line)}';"):
        TypeRegistry().add(
            "odd_msgs/Odd", f"float64 y\n# the wrong one:\n{line}  # as it is\nbool z"
        )


def test_invalid_services_are_rejected() -> None:
    with pytest.raises(TypeNameError, match="---"):
        TypeRegistry().add_service("odd_msgs/Odd", "bool a\nbool b")


@pytest.mark.parametrize(
    ("kind", "fields"),
    [  # as the packages of ROS 2 define them; what a client sends has these names, in any order
        ("control_msgs/JointJog", "header joint_names displacements velocities duration"),
        ("moveit_msgs/ServoStatus", "code message"),
        (
            "moveit_msgs/PositionIKRequest",
            "group_name robot_state constraints avoid_collisions"
            " ik_link_name pose_stamped ik_link_names pose_stamped_vector timeout",
        ),
        (
            "moveit_msgs/RobotState",
            "joint_state multi_dof_joint_state attached_collision_objects is_diff",
        ),
        (
            "control_msgs/FollowJointTrajectoryGoal",
            "trajectory multi_dof_trajectory path_tolerance"
            " component_path_tolerance goal_tolerance component_goal_tolerance goal_time_tolerance",
        ),
    ],
)
def test_types_of_arms_have_the_fields_of_their_packages(kind: str, fields: str) -> None:
    assert [field.name for field in REGISTRY[kind].fields] == fields.split()
    assert REGISTRY.nested_messages(kind) >= 1, "each of its fields is of a known type"


def test_an_action_and_a_message_may_share_a_name() -> None:
    assert [f.name for f in REGISTRY["control_msgs/GripperCommand"].fields] == [
        "position",
        "max_effort",
    ]
    goal = REGISTRY.action("control_msgs/GripperCommand").goal
    assert [(f.name, f.kind) for f in goal.fields] == [
        ("command", "control_msgs/msg/GripperCommand")
    ]
