"""Steps under the deadman, and steps that the guard stops."""

from __future__ import annotations

import pytest

from localization.types import Pose
from robot_sim import SimulationConfig
from tests.teleop.robot.steps.conftest import Rigs
from tests.teleop.robot.steps.support import StepClient, StepRig, outcome

ARC = {"distance": 0.8, "angle": 0.4, "hold_to_run": True}


def hold(rig: StepRig, client: StepClient, seconds: float) -> None:
    """Hold the deadman with the stick at rest, at 10 Hz."""
    for _ in range(round(10 * seconds)):
        client.joy(held=True)
        rig.tick(5)


def test_arc_under_the_deadman_waits_for_it_and_is_driven_to_its_end(rig: StepRig) -> None:
    client = rig.connect()
    client.goal("a", **ARC)
    assert rig.tick(10).control.twist.linear[0] == 0.0
    hold(rig, client, 6.0)
    result = client.result("a")
    assert outcome(result) == "done"
    values = result["values"]
    assert (values["distance"], values["angle"]) == pytest.approx((0.8, 0.4), abs=0.01)


@pytest.mark.parametrize(
    ("hand", "expected", "words"),
    [
        ("lets go", "released", "the deadman was let go"),
        ("falls silent", "released", "no deadman for 0.5"),
        ("moves the stick", "taken_over", "drives by hand"),
        ("sends a velocity", "taken_over", "drives by hand"),
    ],
)
def test_arc_under_the_deadman_ends_with_the_reason_as_soon_as_the_hand_is_not_there(
    rig: StepRig, hand: str, expected: str, words: str
) -> None:
    client = rig.connect()
    client.goal("a", **ARC)
    client.goal("b", **ARC)
    hold(rig, client, 1.5)
    assert rig.tick().control.twist.linear[0] > 0.2
    match hand:
        case "lets go":
            client.joy(held=False)
        case "moves the stick":
            client.joy(held=True, forward=-0.5)
        case "sends a velocity":
            client.velocity(0.0)
    rig.until(lambda: len(client.results()) == 2, seconds=1.5)
    assert client.results() == [("a", expected), ("b", expected)]
    assert words in client.result("a")["values"]["message"]
    if hand != "moves the stick":
        assert not rig.tick(30).control.twist.linear.any()


def test_deadman_that_was_held_for_one_step_does_not_count_for_a_later_one(rig: StepRig) -> None:
    client = rig.connect()
    client.goal("a", distance=0.05, hold_to_run=True)
    hold(rig, client, 1.5)
    assert client.results() == [("a", "done")]
    client.goal("b", **ARC)
    rig.tick(40)
    assert client.results()[1] == ("b", "released")
    assert client.result("b")["values"]["distance"] == pytest.approx(0.0, abs=0.001)


def test_step_ends_with_the_guards_reason_a_second_after_it_was_stopped(rigs: Rigs) -> None:
    # A wall of the office, 2 m ahead of the bumper.
    rig = rigs(start=Pose.planar(23.8, 3.0, 0.0), config=SimulationConfig(), guard=True)
    client = rig.connect()
    client.goal("a", distance=3.0)
    client.goal("b", distance=0.1)
    record = rig.until(client.results)
    assert client.results() == [("a", "guard"), ("b", "guard")]
    message = client.result("a")["values"]["message"]
    assert message.startswith("stopped: ")
    assert message.endswith("m ahead")
    assert not any(record.condition.bumpers.front)
    assert 1.6 < client.result("a")["values"]["distance"] < 2.0
