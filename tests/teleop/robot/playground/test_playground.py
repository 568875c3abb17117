"""The playground: what clients do to the simulated world, and what stays out of their reach."""

from __future__ import annotations

import json
from collections.abc import Sequence
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from localization.logs.ros_geometry import pose_to_dict
from localization.types import Hint, Pose, WheelSpeeds
from robot_sim import Simulation, World
from teleop.errors import SettingError
from teleop.robot.drive import Drive
from teleop.robot.inbox import EStop, InboxMessage, PoseHint, WorldCall
from teleop.robot.playground.playground import Playground, WorldChoice
from teleop.robot.served_scene import NextRobot, anew
from teleop.robot.serving.address import Address
from teleop.robot.serving.robot_options import RobotOptions
from teleop.robot.serving.serve_config import ServeConfig
from teleop.robot.tick_record import DriveRecord
from teleop.robot.world_control.spares import SPARE_BOXES, SPARE_PEOPLE
from teleop.ros_types import registry
from teleop.rosbridge import Client
from teleop.rosbridge.errors import ServiceCallError
from tests.teleop.robot.served_robots import DRIVER, VIEWER, audited, signed_in
from tests.teleop.robot.sticks import stick
from tests.teleop.support import InRealTime, in_a_loop

NEUTRAL, FULL = stick("anna", 0.0), stick("anna", 0.7)
ELSEWHERE = Pose.from_euler(np.array([22.0, 3.0, 0.0]), yaw=np.pi)


def moved(pose: Pose) -> dict[str, object]:
    """Return a request that moves the robot."""
    nothing = {part: {"x": 0.0, "y": 0.0, "z": 0.0} for part in ("linear", "angular")}
    header = {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": "map"}
    state = {
        "header": header,
        "pose": pose_to_dict(pose),
        "twist": nothing,
        "acceleration": nothing,
    }
    parts = {f"set_{part}": part == "pose" for part in ("pose", "twist", "acceleration")}
    return {"entity": "robot", "state": state, **parts}


class Played:
    """A robot with a playground, without server and localiser."""

    def __init__(self, world: World) -> None:
        self.simulation = Simulation(world, seed=0)
        self.drive = Drive(self.simulation)
        self.drive.playground = self.playground = Playground(self.simulation)
        self.numbers = count(1)
        self.tick()

    def tick(self, *inbox: InboxMessage) -> DriveRecord:
        return self.drive.tick(self.simulation.stamp, inbox)

    def call(self, service: str, **request: object) -> Any:
        """Call as a client; return the response."""
        number = next(self.numbers)
        tick = self.tick(WorldCall("anna", number, service, json.dumps(request)))
        (answer,) = tick.world_answers
        assert answer.number == number
        return answer.response

    @property
    def x(self) -> float:
        return float(self.simulation.truth().map_from_base.position[0])


@pytest.fixture(scope="module")
def spare_office() -> World:
    return RobotOptions().world("office", spare_boxes=SPARE_BOXES, spare_people=SPARE_PEOPLE)


@pytest.fixture
def played(spare_office: World) -> Played:
    return Played(spare_office)


def wheels(readings: Sequence[object]) -> float:
    (speeds,) = (r for r in readings if isinstance(r, WheelSpeeds))
    return speeds.left


def test_robot_is_carried_and_reset_brings_it_back_with_the_pose_it_knows(played: Played) -> None:
    start = played.x
    assert played.call("SetEntityState", **moved(ELSEWHERE))["result"]["result"] == 1
    assert played.x == pytest.approx(22.0, abs=0.01)
    wall = Pose.from_euler(np.array([-50.0, 3.0, 0.0]), yaw=0.0)
    refused = played.call("SetEntityState", **moved(wall))
    assert "is off the floor" in refused["result"]["error_message"]
    tick = played.tick(WorldCall("anna", 99, "ResetSimulation", json.dumps({"scope": 6})))
    assert played.x == pytest.approx(start, abs=0.01)
    (hint,) = (message for message in tick.inbox if isinstance(message, PoseHint))
    assert hint.hint.map_from_base.position[0] == pytest.approx(start)


def test_no_service_returns_the_true_pose(played: Played) -> None:
    for service in ("GetEntityState", "GetEntitiesStates", "GetEntityInfo"):
        with pytest.raises(KeyError):
            played.call(service, entity="robot")


def test_world_stands_still_while_paused_and_no_command_moves_it_afterwards(
    played: Played,
) -> None:
    for _ in range(30):
        played.tick(NEUTRAL if played.simulation.stamp < 100_000_000 else FULL)
    assert played.call("SetSimulationState", state={"state": 2})["result"]["result"] == 1
    stamp, x = played.simulation.stamp, played.x
    played.tick(EStop("berta"))
    hint = PoseHint("anna", Hint(0, ELSEWHERE, np.zeros((6, 6))))
    for _ in range(10):
        tick = played.tick(FULL, hint)
    assert (tick.stamp, played.x, tick.paused, tick.sensed) == (stamp, x, True, ())
    assert "paused" in tick.control.reason
    assert [r.client for r in tick.rejections] == ["anna"]
    assert tick.control.estop is not None  # the e-stop is obeyed all the same
    assert not [m for m in tick.inbox if isinstance(m, PoseHint)]
    resumed = played.tick(
        WorldCall("anna", 99, "SetSimulationState", json.dumps({"state": {"state": 1}}))
    )
    assert (resumed.stamp > stamp, resumed.paused) == (True, False)
    assert [m for m in resumed.inbox if isinstance(m, PoseHint)]


def test_wheels_slip_now_and_for_as_long_as_asked(played: Played) -> None:
    for _ in range(120):
        before = played.tick(NEUTRAL if played.simulation.stamp < 100_000_000 else FULL)
    assert played.call("PlaygroundSlip", seconds=0.1, factor=3.0)["success"]
    slipping = wheels(played.tick(FULL).sensed)
    assert slipping == pytest.approx(3.0 * wheels(before.sensed), rel=0.1)
    for _ in range(6):
        after = played.tick(FULL)
    assert wheels(after.sensed) == pytest.approx(wheels(before.sensed), rel=0.1)
    for bad in ({"seconds": 61.0, "factor": 2.0}, {"seconds": 1.0, "factor": -1.0}):
        answer = played.call("PlaygroundSlip", **bad)
        assert not answer["success"]
        assert "must be 0 to" in answer["message"]


def test_many_calls_at_once_are_worked_off_over_ticks(played: Played) -> None:
    calls = [WorldCall("anna", n, "GetSimulationState", "{}") for n in range(1, 10)]
    answered = [len(played.tick(*calls).world_answers)]
    answered += [len(played.tick().world_answers) for _ in range(3)]
    assert answered == [3, 3, 3, 0]


def test_another_world_is_wanted_only_if_there_is_one(played: Played) -> None:
    for bad in ({"scene": "atlantis", "rearranged": -1}, {"scene": "", "rearranged": -2}):
        assert not played.call("PlaygroundWorld", people=False, **bad)["success"]
    assert played.playground.next_world is None
    assert played.call("PlaygroundWorld", scene="warehouse", people=True, rearranged=7)["success"]
    wanted = WorldChoice("warehouse", people=True, rearranged=7)
    assert played.playground.next_world == wanted
    address = Address("ws://127.0.0.1:9163", "127.0.0.1", 9163, False, False, False)
    config = ServeConfig(port=0, playground=True, record=Path("r.mcap"), map=Path("m.ply"))
    config = anew(config, NextRobot(wanted, address))
    assert (config.port, config.record, config.map) == (9163, None, None)
    assert (config.robot.alive, config.robot.rearranged) == (True, 7)


def test_playground_in_lockstep_is_refused() -> None:
    with pytest.raises(SettingError, match="--playground is for real time"):
        ServeConfig(playground=True, lockstep=True)


@pytest.mark.long
@pytest.mark.process
@in_a_loop
async def test_operator_plays_over_the_wire_and_a_viewer_does_not(
    in_real_time: InRealTime, tmp_path: Path
) -> None:
    record = tmp_path / "run.mcap"
    played_with = signed_in(
        in_real_time, tmp_path, DRIVER, VIEWER, port=0, playground=True, record=record
    )
    async with played_with as (_, (driver, viewer)):
        assert (await driver.call("/teleop/session"))["may_play"]
        assert not (await viewer.call("/teleop/session"))["may_play"]
        with pytest.raises(ServiceCallError, match="role view may not call"):
            await viewer.call("/playground/slip", {"seconds": 1.0, "factor": 2.0})
        with pytest.raises(ServiceCallError, match="does not exist"):
            await driver.call("/playground/get_entity_state", {"entity": "robot"})
        request = {"entity": "robot", "state": {"pose": pose_to_dict(ELSEWHERE)}}
        carried = await driver.call("/playground/set_entity_state", request)
        assert carried["result"]["result"] == 1
        slow = await driver.call("/playground/link", {"settings": ["delay=0.2"]})
        assert slow["success"]
        wrong = await driver.call("/playground/link", {"settings": ["speed=1"]})
        assert "'speed=1' is no setting" in wrong["message"]
        assert (await driver.call("/playground/link", {"settings": []}))["success"]
    played = [line for line in audited(tmp_path) if line["what"] == "playground"]
    assert [line["service"] for line in played[:2]] == ["SetEntityState", "PlaygroundLink"]
    assert {line["holder"] for line in played} == {"driver"}
    assert b"/playground/calls" in record.read_bytes()


@pytest.mark.long
@pytest.mark.process
@in_a_loop
async def test_robot_without_a_playground_offers_none_of_it(in_real_time: InRealTime) -> None:
    async with (
        in_real_time() as address,
        Client(address.url, registry=registry()) as client,
    ):
        assert not (await client.call("/teleop/session"))["may_play"]
        with pytest.raises(ServiceCallError, match="does not exist"):
            await client.call("/playground/slip", {"seconds": 1.0, "factor": 2.0})
