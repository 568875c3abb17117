"""The action /move over the real protocol: one result for each goal, in order, and the wheels stop."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from localization.maps.cloud import Cloud
from localization.types import Pose
from robot_sim import SimulationConfig, World
from robot_sim.drive.motor_controller import FirmwareConfig
from teleop.link.command_age import RoundTrips
from teleop.robot.drive import Drive
from teleop.robot.inbox import StepGoal
from teleop.robot.steps.step_queue import MAX_STEPS
from teleop.robot.tick_record import DriveRecord
from tests.teleop.robot.steps.conftest import Rigs
from tests.teleop.robot.steps.support import StepClient, StepRig, outcome


def driven(before: Pose, after: Pose) -> tuple[float, float]:
    """Return what a robot truly drove ahead [m], and turned [rad]."""
    way = after.position[:2] - before.position[:2]
    ahead = float(way @ (math.cos(before.yaw), math.sin(before.yaw)))
    return ahead, math.remainder(after.yaw - before.yaw, math.tau)


def at_rest(record: DriveRecord) -> bool:
    twist = record.control.twist
    return not (twist.linear.any() or twist.angular.any())


def pose_of(rig: StepRig) -> Pose:
    return rig.drive.simulation.truth().map_from_base


@pytest.mark.parametrize(
    "step",
    [
        {"distance": 0.5},
        {"distance": -0.1},
        {"distance": 0.6, "speed": 0.7},
        {"angle": math.radians(15)},
        {"angle": -math.pi / 2, "speed": 1.5},
        {"distance": 0.8, "angle": 0.9},
        {"distance": -0.4, "angle": 0.5, "speed": 0.6},
        {"distance": 0.01, "angle": 2.0},  # nearly a turn on the spot: both ends must be met
        {"distance": -0.001, "angle": -1.5, "speed": 0.001},
    ],
    ids=str,
)
def test_step_ends_where_it_should_with_the_robot_at_rest(
    rig: StepRig, step: dict[str, float]
) -> None:
    client, before = rig.connect(), pose_of(rig)
    client.goal("a", **step)
    record = rig.until(client.results)
    assert at_rest(record)
    result = client.result("a")
    assert (result["status"], outcome(result)) == (4, "done")
    true = driven(before, pose_of(rig))
    wanted = (step.get("distance", 0.0), step.get("angle", 0.0))
    length, angle = wanted
    if length and angle:  # an arc ends ahead by the sine of its angle
        wanted = (length * math.sin(angle) / angle, angle)
    # An encoder's scale is off by 0.3 % (one sigma), and MuJoCo's wheels creep by a millimetre.
    assert true == pytest.approx(wanted, abs=0.004 if 0.0 in wanted else 0.03)
    for name in step.keys() & {"distance", "angle"}:
        assert result["values"][name] == pytest.approx(step[name], abs=0.004)
    assert 0.5 < result["values"]["duration"] < 5.0
    assert np.abs(record.truth.twist.linear).max() < 0.01


def test_step_of_a_controller_that_reports_ten_times_a_second_ends_where_it_should(
    rigs: Rigs,
) -> None:
    config = SimulationConfig(scanners=())
    config = replace(config, drive=replace(config.drive, firmware=FirmwareConfig()))
    rig = rigs(config=config)
    client, before = rig.connect(), pose_of(rig)
    client.goal("a", distance=0.5)
    rig.until(client.results)
    assert outcome(client.result("a")) == "done"
    assert driven(before, pose_of(rig))[0] == pytest.approx(0.5, abs=0.02)


def test_feedback_says_who_waits_behind_how_many_and_how_far_the_first_has_gone(
    rig: StepRig,
) -> None:
    client = rig.connect()
    for identity in "abc":
        client.goal(identity, distance=0.1)
    rig.tick(30)
    feedback = [o for o in client.received if o["op"] == "action_feedback"]
    ahead = {o["id"]: o["values"]["ahead"] for o in feedback if o["values"]["state"] == "waiting"}
    assert ahead == {"b": 1, "c": 2}
    moved = [o["values"]["distance"] for o in feedback if o["values"]["state"] == "moving"]
    assert moved == sorted(moved)
    assert 0.01 < moved[-1] <= 0.1
    rig.until(lambda: len(client.results()) == 3)
    assert client.results() == [("a", "done"), ("b", "done"), ("c", "done")]


def test_somebody_elses_robot_is_refused_by_name_and_free_two_seconds_after_the_last_step(
    rig: StepRig,
) -> None:
    one, two = rig.connect(), rig.connect()
    one.goal("a", distance=0.05)
    rig.tick()
    two.goal("b", distance=0.05)
    rig.tick(2)
    result = two.result("b")
    assert (result["status"], outcome(result)) == (6, "refused")
    assert result["values"]["message"] == f"{one.name} drives; call /teleop/take_over"
    rig.until(one.results)
    assert rig.tick(90).control.controller == one.name
    assert rig.tick(15).control.controller == ""
    two.goal("c", distance=0.05)
    rig.until(lambda: len(two.results()) == 2)
    assert two.results()[1] == ("c", "done")


@pytest.mark.parametrize(
    ("interruption", "expected"),
    [
        ("e-stop", "e_stop"),
        ("take-over", "taken_over"),
        ("own take-over", "taken_over"),
        ("own velocity", "taken_over"),
        ("own zero velocity", "taken_over"),
    ],
)
def test_interruption_ends_all_steps_at_once_in_order(
    rig: StepRig, interruption: str, expected: str
) -> None:
    client, other = rig.connect(), rig.connect()
    for identity in "abc":
        client.goal(identity, distance=1.0)
    client.cancel("b")
    assert abs(float(rig.tick(40).truth.twist.linear[0])) > 0.2
    match interruption:
        case "e-stop":
            other.call("/teleop/estop")
        case "take-over":
            other.call("/teleop/take_over")
        case "own take-over":
            client.call("/teleop/take_over")
        case "own velocity":
            client.velocity(0.1)
        case _:
            client.velocity(0.0)
    record = rig.tick(1)
    assert client.results() == [("a", expected), ("b", "cancelled"), ("c", expected)]
    assert record.steps.moving is None
    if interruption != "own velocity":
        assert at_rest(record)
        assert np.abs(rig.tick(40).truth.twist.linear).max() < 0.01


def test_steps_are_refused_while_the_e_stop_is_latched_and_driven_after_its_reset(
    rig: StepRig,
) -> None:
    client = rig.connect()
    client.call("/teleop/estop")
    client.goal("a", distance=0.05)
    rig.tick(2)
    assert "latched; reset it first" in client.result("a")["values"]["message"]
    client.call("/teleop/estop_reset")
    client.goal("b", distance=0.05)
    rig.until(lambda: len(client.results()) == 2)
    assert client.results() == [("a", "refused"), ("b", "done")]


def test_cancelled_step_ends_once_the_robot_is_at_rest_and_the_next_one_goes_on(
    rig: StepRig,
) -> None:
    client = rig.connect()
    client.goal("a", distance=1.0)
    client.goal("b", distance=-0.05)
    rig.tick(60)
    client.cancel("a")
    record = rig.until(client.results)
    assert client.result("a")["status"] == 5
    assert outcome(client.result("a")) == "cancelled"
    assert 0.15 < client.result("a")["values"]["distance"] < 0.6
    assert abs(float(record.truth.twist.linear[0])) < 0.01
    rig.until(lambda: len(client.results()) == 2)
    assert outcome(client.result("b")) == "done"


def test_disconnect_stops_the_robot_and_empties_the_queue(rig: StepRig) -> None:
    client, other = rig.connect(), rig.connect()
    client.goal("a", distance=1.0)
    client.goal("b", distance=1.0)
    rig.tick(60)
    client.leave()
    record = rig.tick()
    assert at_rest(record)
    assert (record.steps.moving, record.steps.waiting) == (None, ())
    assert [r.outcome.value for r in record.steps.ended] == ["silent", "silent"]
    assert not record.steps.unanswered
    other.goal("c", distance=-0.05)
    rig.until(other.results)
    assert outcome(other.result("c")) == "done"


def test_bumper_contact_ends_the_queue_and_the_robot_can_back_off(rigs: Rigs) -> None:
    # The spawn faces the wall of the office in the west after 24 m; the nearest one is behind.
    rig = rigs(start=Pose.planar(24.2, 3.0, 0.0))
    client = rig.connect()
    client.goal("a", distance=20.0)
    client.goal("b", distance=0.1)
    rig.until(client.results)
    assert client.results() == [("a", "contact"), ("b", "contact")]
    assert client.result("a")["values"]["message"] == "the front bumper is pressed"
    assert "not begun: step" in client.result("b")["values"]["message"]
    client.goal("c", distance=0.1)
    client.goal("d", distance=-0.2)
    rig.until(lambda: len(client.results()) >= 4)
    assert client.results()[2:] in (
        [("c", "contact"), ("d", "contact")],
        [("c", "contact"), ("d", "done")],
    )
    client.goal("e", distance=-0.2)
    rig.until(lambda: client.results()[-1][0] == "e")
    assert client.results()[-1] == ("e", "done")


def test_step_that_takes_too_long_is_given_up(rig: StepRig) -> None:
    client = rig.connect()
    client.goal("a", distance=1.0, time_limit=1.0)
    rig.until(client.results)
    assert outcome(client.result("a")) == "time_limit"
    assert client.result("a")["values"]["message"] == "not at its end after 1.0 s"
    assert 0.1 < client.result("a")["values"]["distance"] < 0.6


def test_full_queue_refuses_the_next_step_at_once(rig: StepRig) -> None:
    client = rig.connect()
    for number in range(MAX_STEPS + 2):
        client.goal(str(number), distance=0.01)
    rig.tick()
    assert client.results() == [("100", "refused"), ("101", "refused")]
    assert "100 steps wait already" in client.result("100")["values"]["message"]


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({}, "needs a distance [m], an angle [rad]"),
        ({"distance": 1.0, "speed": -1.0}, "speed must be > 0"),
        ({"distance": 1.0, "time_limit": -1.0}, "time_limit must be up to 3600 s"),
        ({"distance": 1.0, "measure_by": "gps"}, "measure_by must be odometry or localization"),
        ({"distance": "far"}, "distance"),
    ],
)
def test_invalid_goal_is_answered_with_the_field_and_drives_nothing(
    rig: StepRig, values: dict[str, object], words: str
) -> None:
    client = rig.connect()
    client.goal("a", **values)
    assert rig.tick().steps.moving is None
    assert client.result("a")["result"] is False
    assert words in client.result("a")["values"]


def test_speed_beyond_the_robots_is_refused_with_the_largest(rig: StepRig) -> None:
    client = rig.connect()
    client.goal("a", distance=1.0, speed=0.8)
    client.goal("b", angle=1.0, speed=3.0)
    rig.tick()
    assert client.result("a")["values"]["message"] == "speed must be at most 0.7 m/s, got 0.8"
    assert client.result("b")["values"]["message"] == "speed must be at most 2.44 rad/s, got 3"


def test_client_that_answers_no_pings_is_silent(office: World, office_cloud: Cloud) -> None:
    hung = 0

    def round_trips(client: int) -> RoundTrips:
        unanswered = rig.drive.simulation.stamp - hung if hung else None
        return RoundTrips(last=20_000_000, unanswered=unanswered)

    rig = StepRig(office, office_cloud, round_trips=round_trips)
    client = rig.connect()
    client.goal("a", distance=1.0)
    rig.tick(60)
    assert rig.drive.steps.report().moving is not None
    hung = rig.drive.simulation.stamp - 600_000_000
    rig.until(client.results)
    assert outcome(client.result("a")) == "silent"
    assert "has not answered pings for" in client.result("a")["values"]["message"]
    # The robot waits for a second of silence, notes it with the next sign of life, and brakes to rest.
    assert 1_000_000_000 < rig.drive.simulation.stamp - hung < 1_700_000_000
    client.goal("b", distance=1.0)
    rig.tick()
    message = client.result("b")["values"]["message"]
    assert message.startswith("the way from you takes 1.")
    assert message.endswith("and 1 s is the limit")


def test_server_that_falls_silent_stops_the_robot(rig: StepRig) -> None:
    drive = rig.drive
    drive.tick(0, [StepGoal("a", 1, distance=1.0)])
    for _ in range(60):
        record = drive.tick(drive.simulation.stamp, [])
        if record.steps.ended:
            break
    (result,) = record.steps.ended
    assert result.outcome.value == "silent"
    assert "no sign of a for" in result.message
    assert at_rest(record)


def test_lost_server_takes_its_steps_with_it(rig: StepRig) -> None:
    rig.drive.tick(0, [StepGoal("a", 1, distance=1.0), StepGoal("a", 2, distance=1.0)])
    rig.drive.server_lost("the server has ended")
    record = rig.drive.tick(rig.drive.simulation.stamp, [])
    assert at_rest(record)
    assert (record.steps.moving, record.steps.waiting, record.steps.unanswered) == (None, (), ())


def test_result_is_repeated_until_it_is_confirmed(rig: StepRig) -> None:
    client = rig.connect()
    client.goal("a", distance=0.02)
    drive, adapter = rig.drive, rig.adapter
    seen = 0
    # As in real time, where a record may be lost on its way to the gateway.
    while seen < 5:
        record = drive.tick(drive.simulation.stamp, adapter.wishes.take())
        seen += bool(record.steps.unanswered)
        if not record.steps.unanswered:
            adapter.driven(record)
    assert not client.results()
    adapter.driven(record)
    adapter.driven(record)
    assert client.results() == [("a", "done")]
    assert not rig.tick().steps.unanswered


EVENTS = st.sampled_from(
    ["goal", "goal", "goal", "long goal", "cancel", "e-stop", "reset", "take over", "velocity"]
    + ["reconnect", "control", "wait", "wait"]
)


@settings(
    max_examples=12, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(st.lists(st.tuples(EVENTS, st.integers(0, 1), st.integers(0, 25)), min_size=3, max_size=14))
@pytest.mark.slow
def test_any_interleaving_gives_each_goal_one_result_in_order_and_stops_the_wheels(
    rigs: Rigs, events: list[tuple[str, int, int]]
) -> None:
    rig = rigs()
    clients = [rig.connect(), rig.connect()]
    gone: list[StepClient] = []
    sent: dict[int, list[str]] = {client.number: [] for client in clients}
    for event, who, ticks in events:
        client = clients[who]
        mine = sent[client.number]
        match event:
            case "goal" | "long goal":
                mine.append(f"{client.number}.{len(mine)}")
                length = 0.02 if event == "goal" else 0.5
                client.goal(mine[-1], distance=-length if len(mine) % 2 else length)
            case "cancel":
                client.cancel(mine[ticks % len(mine)] if mine else "none")
            case "e-stop":
                client.call("/teleop/estop")
            case "reset":
                client.call("/teleop/estop_reset")
            case "take over":
                client.call("/teleop/take_over")
            case "velocity":
                client.velocity(0.05)
            case "control":
                client.control('{"angle": 5, "movement": "left"}')
            case "reconnect":
                client.leave()
                gone.append(client)
                clients[who] = rig.connect()
                sent[clients[who].number] = []
        rig.tick(ticks)
    for _ in range(1500):
        record = rig.tick()
        if record.steps.moving is None and not record.steps.waiting and at_rest(record):
            break
    record = rig.tick(60)
    assert at_rest(record)
    assert np.abs(record.truth.twist.linear).max() < 0.01
    for client in clients:
        results = client.results()
        assert sorted(identity for identity, _ in results) == sorted(sent[client.number])
        # A refusal does not wait for the steps before it.
        accepted = [identity for identity, outcome in results if outcome != "refused"]
        assert accepted == [identity for identity in sent[client.number] if identity in accepted]
    for client in gone:
        identities = [identity for identity, _ in client.results()]
        assert len(set(identities)) == len(identities)
    # Nothing but the inboxes and the robot's own readings decided anything.
    again = Drive(rigs().drive.simulation)
    for inbox in rig.inboxes:
        repeated = again.tick(again.simulation.stamp, inbox)
    assert repeated.truth.map_from_base.position.tobytes() == (
        record.truth.map_from_base.position.tobytes()
    )
    assert repeated.steps == record.steps
