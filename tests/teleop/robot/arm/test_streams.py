"""A hand, a twist, a pose and rates of joints move the arm over the wire, under lease, watchdog and e-stop."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from tests.teleop.robot.arm.support import JOINTS, STOW, ArmClient, ArmRig, pose

HEADER = {"stamp": {"sec": 1, "nanosec": 0}, "frame_id": "base_link"}


def tip_target(client: ArmClient, x: float, y: float, z: float) -> None:
    """Publish as MoveIt Servo's pose tracking demo does."""
    client.publish("/servo_node/pose_target_cmds", {"header": HEADER, "pose": pose(x, y, z)})


def raise_arm(rig: ArmRig, client: ArmClient) -> None:
    """Move the arm off its stow pose by joint jog, and let go."""
    rig.hold(60, lambda: client.jog(arm_joint_2=0.3, arm_joint_3=0.8))
    client.jog(arm_joint_1=0.0)
    rig.tick(20)


def test_joint_jog_moves_the_joints_that_it_names(rig: ArmRig) -> None:
    client = rig.connect()
    state = rig.hold(50, lambda: client.jog(arm_joint_1=0.4))
    moved = state.wanted - STOW
    assert moved[0] > 0.25
    np.testing.assert_allclose(moved[1:], 0.0, atol=1e-12)
    assert (state.mode, state.controller) == ("jog", client.name)


def test_twist_moves_the_tip_along_the_axes_of_its_frame(rig: ArmRig) -> None:
    client = rig.connect()
    raise_arm(rig, client)
    before = rig.tick().tip.position
    ahead = {"header": HEADER, "twist": {"linear": {"x": 0.05}}}
    state = rig.hold(50, lambda: client.publish("/servo_node/delta_twist_cmds", ahead))
    moved = state.tip.position - before
    assert moved[0] == pytest.approx(0.05, abs=0.02)
    assert np.abs(moved[1:]).max() < 0.02, "play of the servos, and how they sag"
    assert state.mode == "twist"


def test_pose_target_leads_the_tip(rig: ArmRig) -> None:
    client = rig.connect()
    raise_arm(rig, client)
    goal = rig.tick().tip.position + [0.03, 0.03, 0.0]
    # In base_link, which the arm's bracket is 0.29 m ahead of and 0.20 m up from.
    state = rig.hold(100, lambda: tip_target(client, goal[0] + 0.29, goal[1], goal[2] + 0.20))
    np.testing.assert_allclose(state.target.position, goal, atol=1e-6)
    assert state.mode == "pose"
    assert np.linalg.norm(state.tip.position - goal) < 0.03


STOPS: list[Callable[[ArmRig, ArmClient], object]] = [
    lambda rig, client: None,
    lambda rig, client: client.client.leave(),
    lambda rig, client: rig.connect().call("/teleop/estop"),
    lambda rig, client: rig.connect().call("/teleop/take_over"),
    lambda rig, client: rig.rig.drive.server_lost("the server has ended"),
]


@pytest.mark.parametrize(
    "stop", STOPS, ids=["silence", "disconnect", "e-stop", "take-over", "server"]
)
def test_what_ends_the_lease_or_the_stream_stops_the_arm_and_holds_it(
    rig: ArmRig, stop: Callable[[ArmRig, ArmClient], object]
) -> None:
    client = rig.connect()
    rig.hold(40, lambda: client.jog(arm_joint_1=0.4))
    stop(rig, client)
    rig.tick(30)  # the watchdog's half second, and a stop
    state = rig.tick()
    assert not state.wanted_rates.any()
    assert state.mode == "held"
    assert state.reason
    later = rig.tick(50)
    np.testing.assert_array_equal(later.wanted, state.wanted)


def test_arm_that_stands_says_that_the_estop_is_latched_and_released(rig: ArmRig) -> None:
    client, other = rig.connect(), rig.connect()
    rig.hold(5, lambda: client.jog(arm_joint_1=0.4))
    client.jog(arm_joint_1=0.0)
    assert rig.tick(30).reason == "let go"
    other.call("/teleop/estop")
    state = rig.tick()
    assert (state.mode, state.reason) == ("held", f"e-stop by {other.name}")
    other.call("/teleop/estop_reset")
    assert rig.tick().reason == f"e-stop reset by {other.name}"


def test_arm_stops_within_the_bounds_of_its_motion(rig: ArmRig) -> None:
    client = rig.connect()
    rates = []
    for tick in range(80):
        if tick < 40:
            client.jog(arm_joint_1=1.5)
        if tick == 40:
            rig.connect().call("/teleop/estop")
        rates.append(rig.tick().wanted_rates[0])
    assert max(rates) > 1.0
    accelerations = np.diff(rates) / 0.02
    assert np.abs(accelerations).max() <= 40.0 + 1e-6
    assert rates[40 + 8] == 0.0


def test_hand_must_open_its_clutch_after_a_stop(rig: ArmRig) -> None:
    client = rig.connect()
    client.hand(engaged=False)
    rig.tick()
    client.hand()
    rig.tick(40)
    client.hand(0.1)
    assert rig.tick().mode == "held"
    assert "open the hand's clutch first" in client.said
    client.hand(engaged=False)
    rig.tick()
    client.hand()
    assert rig.tick().mode == "hand"


def test_hand_without_the_lease_is_refused_and_moves_nothing(rig: ArmRig) -> None:
    driver, other = rig.connect(), rig.connect()
    other.hand(engaged=False)
    rig.tick()
    for tick in range(50):
        driver.jog(arm_joint_1=0.0 if tick else 0.1)
        other.hand(0.001 * tick)
        state = rig.tick()
        assert (state.rumble, state.servo) == (0.0, 0), "the driver feels nothing of it"
    assert f"{driver.name} drives; call /teleop/take_over" in other.said
    assert np.abs(state.wanted - STOW).max() < 0.01


def test_vehicle_is_slow_while_the_arm_is_off_its_stow_pose(rig: ArmRig) -> None:
    client = rig.connect()
    client.subscribe("/teleop/state", "/arm/state")
    client.client.velocity(0.7)
    rig.tick(5)
    assert rig.tick().speed_limit == np.inf
    raise_arm(rig, client)
    state = rig.hold(30, lambda: client.client.velocity(0.7))
    assert not state.stowed
    message = client.messages("/teleop/state")[-1]
    assert message["linear"] == pytest.approx(0.2)
    assert "arm" in message["reason"]
    assert client.messages("/arm/state")[-1]["speed_limit"] == pytest.approx(0.2)


def test_states_come_ten_times_a_second_at_rest_and_each_tick_in_motion(rig: ArmRig) -> None:
    client = rig.connect()
    client.subscribe("/arm/state", "/servo_node/status", "/arm/joint_degrees", "/joint_states")
    rig.tick(50)
    assert len(client.messages("/arm/state")) == 10
    rig.hold(50, lambda: client.jog(arm_joint_1=0.4))
    assert len(client.messages("/arm/state")) >= 10 + 48
    degrees = client.messages("/arm/joint_degrees")
    assert len(degrees) == 100
    assert len(degrees[-1]["data"]) == 6
    joints = [m for m in client.messages("/joint_states") if "arm_joint_1" in m["name"]]
    assert joints[-1]["name"] == [*JOINTS, "gripper_joint"]
    assert {len(joints[-1][part]) for part in ("position", "velocity", "effort")} == {6}


def test_clutch_and_pose_in_messages_of_their_own_are_joined(rig: ArmRig) -> None:
    client = rig.connect()
    raise_arm(rig, client)

    def send(z: float, grip: int, tick: int = 0) -> None:
        stamp = {"sec": 5, "nanosec": 20_000_000 * (tick % 50)}
        header = {"stamp": stamp, "frame_id": "arm_base"}
        client.publish("/arm/joy", {"header": header, "axes": [0.0], "buttons": [grip]})
        client.publish("/arm/hand_pose", {"header": header, "pose": pose(z=z)})

    send(0.0, 0)
    start = rig.tick().tip.position
    for tick in range(1, 50):
        send(0.0005 * tick, 1, tick)
        state = rig.tick()
    assert state.mode == "hand"
    assert state.tip.position[2] - start[2] == pytest.approx(0.025, abs=0.01)
    client.publish(
        "/arm/joy",
        {"header": {"stamp": {"sec": 5, "nanosec": 0}}, "axes": [0.0], "buttons": [0]},
    )
    assert rig.tick().mode == "idle", "an open clutch does not wait for a pose"


def test_pose_whose_clutch_is_of_another_time_moves_nothing(rig: ArmRig) -> None:
    client = rig.connect()
    stamp = {"sec": 5, "nanosec": 0}
    client.publish("/arm/hand_pose", {"header": {"stamp": stamp}, "pose": pose()})
    client.publish("/arm/joy", {"header": {"stamp": stamp}, "axes": [0.0], "buttons": [1]})
    later = {"sec": 9, "nanosec": 0}
    client.publish("/arm/hand_pose", {"header": {"stamp": later}, "pose": pose(z=0.1)})
    assert rig.tick().mode == "idle"


def test_step_of_the_vehicle_is_driven_slowly_while_the_arm_is_off_its_stow_pose(
    rig: ArmRig,
) -> None:
    client = rig.connect()
    raise_arm(rig, client)
    client.client.goal("s", distance=0.4, speed=0.5)
    rig.until(lambda: client.client.results(), seconds=8.0)
    assert client.client.results() == [("s", "done")]
