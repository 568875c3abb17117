"""The topic /turtle_control: the thesis's commands, each sender's in its own order."""

from __future__ import annotations

import math
from typing import Any

import pytest

from teleop.rosbridge.errors import ServiceError
from teleop.rosbridge.graph.deferred_response import DeferredResponse
from tests.teleop.robot.steps.support import StepClient, StepRig


def listener(rig: StepRig) -> StepClient:
    client = rig.connect()
    client.send(op="subscribe", topic="/turtle_control/result", type="std_msgs/String")
    return client


def test_commands_of_the_thesis_are_driven_in_order_and_answered(rig: StepRig) -> None:
    client = listener(rig)
    for text in (
        '{"distance": "0.1"}',
        '{"angle": "15"}',
        '{"movement": "up"}',
        '{"movement": "right"}',
        '{"movement": "down"}',
    ):
        client.control(text)
    before = rig.drive.simulation.truth().map_from_base
    rig.until(lambda: len(client.answers()) == 3)
    answers = client.answers()
    assert [a["outcome"] for a in answers] == ["done"] * 3
    assert [(a["distance"], a["angle"]) for a in answers] == [(0.1, 0), (0, -15), (-0.1, 0)]
    assert answers[0]["driven_distance"] == pytest.approx(0.1, abs=0.002)
    assert answers[1]["driven_angle"] == pytest.approx(-15.0, abs=0.3)
    assert {a["client"] for a in answers} == {client.name}
    after = rig.drive.simulation.truth().map_from_base
    assert math.degrees(math.remainder(after.yaw - before.yaw, math.tau)) == pytest.approx(
        -15, abs=0.5
    )


def test_sizes_are_each_senders_own_and_end_with_its_connection(rig: StepRig) -> None:
    one, two = listener(rig), listener(rig)
    one.control('{"distance": 0.02}')
    two.control('{"movement": "up"}')
    assert 'send {"distance": 0.5} first' in two.errors()[0]
    one.control('{"movement": "up"}')
    rig.until(one.answers)
    assert one.answers() == two.answers()
    one.leave()
    again = listener(rig)
    again.control('{"movement": "up"}')
    assert "needs the length of a step" in again.errors()[0]


def test_invalid_command_is_answered_by_a_status_to_its_sender_only(rig: StepRig) -> None:
    one, two = listener(rig), listener(rig)
    one.control('{"movement": "sideways"}')
    rig.tick()
    assert "movement must be one of up, down, left, right, got 'sideways'" in one.errors()[0]
    assert not two.errors()
    assert not two.answers()


def test_too_many_commands_are_refused_in_one_line(rig: StepRig) -> None:
    client = listener(rig)
    client.control('{"distance": 0.01}')
    for _ in range(101):
        client.control('{"movement": "up"}')
    assert len(client.errors()) == 1
    assert "100 commands wait already" in client.errors()[0]


def test_photograph_without_a_camera_is_refused_and_the_next_command_goes_on(rig: StepRig) -> None:
    client = listener(rig)
    client.control('{"distance": 0.02, "action": "photo", "movement": "up"}')
    rig.until(lambda: len(client.answers()) == 2)
    photo, step = client.answers()
    assert (photo["action"], photo["outcome"]) == ("photo", "refused")
    assert "no camera" in photo["message"]
    assert step["outcome"] == "done"


@pytest.mark.parametrize("later", [False, True])
def test_photograph_is_taken_at_rest_between_the_steps_around_it(rig: StepRig, later: bool) -> None:
    taken: list[tuple[int, float]] = []
    pending: list[DeferredResponse] = []

    def photo(client: int, request: dict[str, Any], now: int) -> dict[str, Any] | DeferredResponse:
        taken.append((client, float(rig.drive.simulation.truth().twist.linear[0])))
        if not later:
            return {"success": True, "message": "photo0.jpg"}
        pending.append(DeferredResponse())
        return pending[-1]

    rig.protocol.services.serve("/camera/photo", "std_srvs/srv/Trigger", photo)
    client = listener(rig)
    client.control('{"distance": 0.05, "movement": "up"}')
    client.control('{"action": "photo"}')
    client.control('{"movement": "down"}')
    rig.until(lambda: taken)
    assert taken[0][0] == client.number
    assert abs(taken[0][1]) < 0.01
    assert len(client.answers()) == (1 if later else 2)
    if later:
        assert rig.tick(5).steps.moving is None
        pending[0].complete({"success": True, "message": "photo0.jpg"})
    rig.until(lambda: len(client.answers()) == 3)
    assert [a.get("action") for a in client.answers()] == [None, "photo", None]
    assert client.answers()[1]["message"] == "photo0.jpg"


def test_photograph_that_fails_is_refused_with_the_reason(rig: StepRig) -> None:
    def photo(client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
        raise ServiceError("the disk is full")

    rig.protocol.services.serve("/camera/photo", "std_srvs/srv/Trigger", photo)
    client = listener(rig)
    client.control('{"action": "photo"}')
    assert client.answers()[0]["outcome"] == "refused"
    assert client.answers()[0]["message"] == "the disk is full"


def test_nothing_behind_a_step_that_was_stopped_is_done(rig: StepRig) -> None:
    client = listener(rig)
    client.control('{"distance": 1, "movement": "up"}')
    client.control('{"action": "photo"}')
    client.control('{"movement": "down"}')
    rig.tick(30)
    client.call("/teleop/estop")
    rig.tick(2)
    assert [a["outcome"] for a in client.answers()] == ["e_stop"] * 3
    assert "not begun" in client.answers()[2]["message"]
