"""The standard's services: what they do, and what they answer where they do nothing."""

from __future__ import annotations

import asyncio
from typing import Any

import numpy as np
import pytest

from robot_sim import TICK_NS
from teleop.robot.world_control.results import Feature
from tests.teleop.scenario.standard.support import Desk, pose


def spawn(name: str, x: float, y: float, uri: str = "box_0.6x0.6x1", **more: Any) -> dict[str, Any]:
    return {
        "name": name,
        "entity_resource": {"uri": uri},
        "initial_pose": {"pose": pose(x, y)},
        **more,
    }


async def ticks(desk: Desk, count: int) -> None:
    """Let the loop run until so many ticks have passed, which they do one a turn."""
    for _ in range(3 * count):
        if desk.stepped.stamp >= count * TICK_NS:
            return
        await asyncio.sleep(0)
    raise AssertionError("nothing is stepped")


def test_features_say_what_is_offered(shared_desk: Desk) -> None:
    features = shared_desk.call("get_simulator_features")["features"]
    assert features["features"] == sorted(int(f) for f in Feature)
    assert features["spawn_formats"] == []


def test_step_advances_by_ticks_and_answers_after_their_messages(desk: Desk) -> None:
    desk.send(desk.referee, op="subscribe", topic="/clock")
    desk.received(desk.referee)
    desk.send(desk.referee, op="call_service", service="/sim/step_simulation", args={"steps": 7})
    operations = [o["op"] for o in desk.received(desk.referee)]
    assert operations == ["publish"] * 7 + ["service_response"]
    assert desk.stepped.stamp == 7 * TICK_NS


def test_action_steps_with_feedback_after_each(desk: Desk) -> None:
    desk.send(
        desk.referee,
        op="send_action_goal",
        id="g",
        action="/sim/simulate_steps",
        action_type="simulation_interfaces/action/SimulateSteps",
        args={"steps": 3},
        feedback=True,
    )
    found = desk.received(desk.referee)
    steps = [o["values"] for o in found if o["op"] == "action_feedback"]
    assert [s["completed_steps"] for s in steps] == [1, 2, 3]
    assert [s["remaining_steps"] for s in steps] == [2, 1, 0]
    assert found[-1]["op"] == "action_result"
    assert found[-1]["values"]["result"]["result"] == 1
    assert desk.stepped.stamp == 3 * TICK_NS


def test_goal_can_be_cancelled_and_nothing_else_is_done_meanwhile(desk: Desk) -> None:
    async def run() -> None:
        desk.send(
            desk.referee,
            op="send_action_goal",
            id="g",
            action="/sim/simulate_steps",
            args={"steps": 400},
        )
        await ticks(desk, 5)
        for service, args in (
            ("step_simulation", {"steps": 1}),
            ("reset_simulation", {}),
            ("set_simulation_state", {"state": {"state": 0}}),
        ):
            assert desk.refused(service, **args) == (3, "a step is under way; wait for its end")
        desk.send(desk.referee, op="cancel_action_goal", id="g", action="/sim/simulate_steps")
        for _ in range(5):
            await asyncio.sleep(0)

    asyncio.run(run())
    (result,) = [o for o in desk.received(desk.referee) if o["op"] == "action_result"]
    assert result["status"] == 5  # cancelled
    assert desk.stepped.stamp < 20 * TICK_NS
    desk.done("step_simulation", steps=1)


def test_stepping_ends_when_its_caller_leaves(desk: Desk) -> None:
    async def run() -> None:
        desk.send(
            desk.referee, op="call_service", service="/sim/step_simulation", args={"steps": 400}
        )
        await ticks(desk, 5)
        desk.protocol.disconnect(desk.referee, desk.stepped.stamp)
        for _ in range(5):
            await asyncio.sleep(0)

    asyncio.run(run())
    assert desk.stepped.stamp < 20 * TICK_NS
    desk.referee = desk.connect(desk.access.token)
    desk.done("step_simulation", steps=1)


def test_stepped_robot_is_paused_and_nothing_else(shared_desk: Desk) -> None:
    assert shared_desk.call("get_simulation_state")["state"] == {"state": 2}
    paused = {"state": {"state": 2}}
    assert shared_desk.refused("set_simulation_state", **paused) == (101, "it is PAUSED already")
    for state in (0, 1, 3, 7):
        answer = shared_desk.refused("set_simulation_state", state={"state": state})
        assert answer == (0, f"state {state} cannot be set here; those that can: PAUSED")


def test_reset_of_parts_leaves_the_rest(desk: Desk) -> None:
    start = desk.simulation.truth().map_from_base.position
    desk.done("spawn_entity", **spawn("crate", 22.0, 3.0))
    desk.done("set_entity_state", entity="robot", state={"pose": pose(18.5, 8.2)}, set_pose=True)
    desk.done("step_simulation", steps=5)
    desk.done("reset_simulation", scope=2)
    assert np.allclose(desk.simulation.truth().map_from_base.position[:2], start[:2])
    assert desk.call("get_entities")["entities"] == ["robot", "crate"]
    desk.done("reset_simulation", scope=4)
    assert desk.call("get_entities")["entities"] == ["robot"]
    assert desk.stepped.stamp == 5 * TICK_NS


def test_reset_names_what_stands_at_the_start(desk: Desk) -> None:
    x, y = desk.simulation.truth().map_from_base.position[:2].tolist()
    desk.done("set_entity_state", entity="robot", state={"pose": pose(18.5, 8.2)})
    desk.done("spawn_entity", **spawn("crate", x, y))
    code, text = desk.refused("reset_simulation", scope=2)
    assert (code, "would stand inside spare_box_1" in text) == (4, True)


def test_robot_is_an_entity_that_can_be_put_elsewhere(desk: Desk) -> None:
    info = desk.done("get_entity_info", entity="robot")["info"]
    assert info["category"] == {"category": 1}
    turned = pose(18.5, 8.2, w=0.0, z=1.0)
    desk.done("set_entity_state", entity="robot", state={"pose": turned}, set_pose=True)
    desk.done("step_simulation", steps=10)
    state = desk.done("get_entity_state", entity="robot")["state"]
    assert state["header"]["frame_id"] == "map"
    assert state["pose"]["position"]["x"] == pytest.approx(18.5, abs=0.01)
    assert abs(state["pose"]["orientation"]["z"]) == pytest.approx(1.0, abs=1e-3)
    assert abs(state["twist"]["linear"]["x"]) < 0.01


def test_only_the_parts_that_are_asked_for_are_set(desk: Desk) -> None:
    before = desk.simulation.truth().map_from_base.position.tobytes()
    state = {"pose": pose(18.5, 8.2)}
    desk.done("set_entity_state", entity="robot", state=state, set_twist=True)
    assert desk.simulation.truth().map_from_base.position.tobytes() == before


def test_boxes_and_people_are_spawned_moved_seen_and_deleted(desk: Desk) -> None:
    spawnables = desk.done("get_spawnables")["spawnables"]
    assert [s["entity_resource"]["uri"] for s in spawnables] == ["box_0.6x0.6x1", "person"]
    assert spawnables[0]["spawn_bounds"]["points"][0] == {"x": 0.3, "y": 0.3, "z": 1.0}
    assert desk.done("spawn_entity", **spawn("crate", 22.0, 3.0))["entity_name"] == "crate"
    answer = desk.done("spawn_entity", **spawn("", 20.5, 4.0, "person", allow_renaming=True))
    assert answer["entity_name"] == "person_1"
    assert desk.simulation.spares.standing["spare_box_1"].x == 22.0
    assert desk.done("get_entity_info", entity="person_1")["info"]["category"] == {"category": 2}
    desk.done("set_entity_state", entity="crate", state={"pose": pose(22.0, 4.0)}, set_pose=True)
    state = desk.done("get_entity_state", entity="crate")["state"]
    assert state["pose"]["position"] == {"x": 22.0, "y": 4.0, "z": 0.0}
    found = desk.done("get_entities_states", filters={"filter": "^c"})
    assert found["entities"] == ["crate"]
    assert found["states"] == [state]
    for filters, names in (
        ({"categories": [{"category": 1}, {"category": 2}]}, ["robot", "person_1"]),
        ({"tags": {"tags": ["spawned", "box"], "filter_mode": 1}}, ["crate"]),
        ({"tags": {"tags": ["spawned", "x"]}}, ["crate", "person_1"]),
        ({"filter": "_1$"}, ["person_1"]),
    ):
        assert desk.done("get_entities", filters=filters)["entities"] == names
    desk.done("delete_entity", entity="crate")
    assert desk.call("get_entities")["entities"] == ["robot", "person_1"]
    assert desk.refused("delete_entity", entity="robot")[0] == 4
    assert desk.refused("delete_entity", entity="crate")[0] == 2


def test_spawned_box_stands_in_the_robots_way(desk: Desk) -> None:
    x, y = desk.simulation.truth().map_from_base.position[:2].tolist()
    ahead = desk.simulation.truth().map_from_base.apply(np.array([0.8, 0.0, 0.0]))
    desk.done("spawn_entity", **spawn("crate", float(ahead[0]), float(ahead[1])))
    desk.done("step_simulation", steps=20)
    code, text = desk.refused("set_entity_state", entity="crate", state={"pose": pose(x, y)})
    assert (code, "the robot stands there" in text) == (101, True)
    target = {"pose": pose(float(ahead[0]), float(ahead[1]))}
    code, text = desk.refused("set_entity_state", entity="robot", state=target)
    assert (code, "would stand inside spare_box_1" in text) == (101, True)


def test_several_are_spawned_at_once_until_there_are_no_more(desk: Desk) -> None:
    requests = [spawn("", 20.5 + i, 4.0, allow_renaming=True) for i in range(3)]
    answer = desk.call("spawn_entities", spawn_requests=requests)
    assert answer["result"]["result"] == 150
    assert [r["result"]["result"] for r in answer["results"]] == [1, 1, 4]
    assert [r["entity_name"] for r in answer["results"]] == ["box_1", "box_2", ""]
    text = "all 2 of box_0.6x0.6x1 are in the world; delete one of them first"
    assert answer["results"][2]["result"]["error_message"] == text


def test_places_are_named_poses_that_tags_select(desk: Desk) -> None:
    poses = {p["name"]: p for p in desk.done("get_named_poses")["poses"]}
    assert poses["kitchen"]["tags"] == ["navigation_goal"]
    assert poses["kitchen"]["pose"]["position"]["x"] == pytest.approx(3.2)
    starts = desk.done("get_named_poses", tags={"tags": ["spawn"]})["poses"]
    assert {p["name"] for p in starts} == set(desk.simulation.world.spawns)
    assert desk.done("get_current_world")["world"]["name"] == "office"


def robot(**state: Any) -> dict[str, Any]:
    return {"entity": "robot", "state": state}


ONE = {"linear": {"x": 1.0}}
BOX = {"type": 3, "points": [{"x": 0}, {"x": 1}]}
NOT_OFFERED = "is not offered; GetSimulatorFeatures says what is"
PARTS = "of the scopes only STATE, SPAWNED can be reset here"
REFUSED: list[tuple[str, dict[str, Any], int, str]] = [
    ("set_entity_state", {"entity": "robbot"}, 2, "no entity 'robbot'; did you mean robot?"),
    ("set_entity_state", {"entity": "x"}, 2, "no entity 'x'; there are: robot"),
    ("set_entity_state", robot(pose=pose(7.5, 5.5)), 101, "would stand inside workshop_office"),
    ("set_entity_state", robot(pose=pose(99.0, 8.0)), 101, "is off the floor, which reaches from 0, 0"),
    ("set_entity_state", robot(pose=pose(18.5, 8.2, w=0.0)), 101, "quaternion"),
    ("set_entity_state", robot(header={"frame_id": "odom"}, pose=pose(18.5, 8.2)), 101, "must be map or empty"),
    ("set_entity_state", robot(twist=ONE) | {"set_twist": True}, 4, "its twist must be 0"),
    ("set_entity_state", robot(acceleration=ONE) | {"set_acceleration": True}, 4, "must be 0"),
    ("set_entity_state", robot(pose={"orientation": {"w": 0.8, "x": 0.6}}), 101, "roll and pitch must be 0"),
    ("spawn_entity", spawn("robot", 22, 3), 101, "an entity is named 'robot' already; give another, or set allow_renaming"),
    ("spawn_entity", spawn("", 22, 3), 102, "the name is empty"),
    ("spawn_entity", spawn("a b", 22, 3), 102, "a name has up to 64 letters"),
    ("spawn_entity", spawn("<b>", 22, 3, allow_renaming=True), 102, "a name has up to 64 letters"),
    ("spawn_entity", {"name": "a", "entity_resource": {"resource_string": "<sdf/>"}}, 103, "resource_string is not read"),
    ("spawn_entity", {"name": "a"}, 104, "no uri; there are: box_0.6x0.6x1, person"),
    ("spawn_entity", spawn("a", 22, 3, "tree"), 2, "nothing has the uri 'tree'; there are: box_0.6x0.6x1, person"),
    ("spawn_entity", spawn("a", 22, 3, entity_namespace="/a"), 105, "leave the namespace empty"),
    ("spawn_entity", spawn("a", 99, 3), 109, "is off the floor"),
    ("spawn_entity", spawn("a", 24.2, 3.0), 109, "the robot stands there, at x 24.20, y 3.00"),
    ("get_entities", {"filters": {"filter": "("}}, 4, "the filter is no regular expression"),
    ("get_entities", {"filters": {"filter": "a" * 201}}, 4, "at most 200 characters"),
    ("get_entities", {"filters": {"bounds": BOX}}, 0, "cannot be selected by bounds"),
    ("reset_simulation", {"scope": 0}, 0, PARTS),
    ("reset_simulation", {"scope": 1}, 0, PARTS),
    ("reset_simulation", {"scope": 255}, 0, PARTS),
    ("reset_simulation", {"scope": 8}, 0, "scope 8 has bits that are not known here"),
    ("step_simulation", {"steps": 0}, 4, "steps must be 1 to 500, got 0"),
    ("step_simulation", {"steps": 501}, 4, "steps must be 1 to 500, got 501"),
    ("load_world", {"world_resource": {"uri": "corridor"}}, 0, NOT_OFFERED),
    ("unload_world", {}, 0, NOT_OFFERED),
    ("get_available_worlds", {}, 0, NOT_OFFERED),
    ("set_entity_info", {"entity": "robot"}, 0, NOT_OFFERED),
    ("get_entity_bounds", {"entity": "robot"}, 0, NOT_OFFERED),
    ("get_named_pose_bounds", {"name": "spawn"}, 0, NOT_OFFERED),
]  # fmt: skip


@pytest.mark.parametrize(("service", "args", "code", "text"), REFUSED)
def test_what_cannot_be_done_is_refused_with_the_standards_code_and_changes_nothing(
    shared_desk: Desk, service: str, args: dict[str, Any], code: int, text: str
) -> None:
    before = shared_desk.simulation.truth().map_from_base.position.tobytes()
    found = shared_desk.refused(service, **args)
    assert found[0] == code
    assert text in found[1]
    assert shared_desk.simulation.truth().map_from_base.position.tobytes() == before
    assert shared_desk.call("get_entities")["entities"] == ["robot"]
