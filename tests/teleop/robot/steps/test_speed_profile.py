"""The speeds of a step: within the limits, without overshoot, and exact at the end."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, strategies as st

from robot_sim import DriveConfig
from teleop.robot.inbox import StepGoal
from teleop.robot.steps.speed_profile import SpeedProfile

DT = 0.02


@given(
    st.one_of(
        st.builds(
            lambda d, s: StepGoal("a", 1, distance=d, speed=s),
            st.floats(0.01, 3.0) | st.floats(-3.0, -0.01),
            st.sampled_from([0.0, 0.1, 0.7]),
        ),
        st.builds(
            lambda a, s: StepGoal("a", 1, angle=a, speed=s),
            st.floats(0.02, math.tau) | st.floats(-math.tau, -0.02),
            st.sampled_from([0.0, 0.2, 2.0]),
        ),
    )
)
def test_profile_reaches_the_end_within_the_limits_and_about_in_time(goal: StepGoal) -> None:
    profile = SpeedProfile.of(goal, DriveConfig())
    length = goal.distance or goal.angle
    gone = speed = 0.0
    time = 0.0
    while True:
        faster = profile.next_speed(speed, length - gone, DT)
        assert abs(faster) <= profile.cruise
        assert abs(faster) - abs(speed) <= profile.acceleration * DT + 1e-12
        if faster == 0.0:
            break
        assert faster * length > 0.0, "it never drives away from the end"
        # The wheels follow a tick later.
        gone, speed = gone + speed * DT, faster
        time += DT
        assert time < 2.0 * profile.duration(length) + 1.0
    gone += speed * DT
    assert abs(length - gone) <= 2.0 * profile.exact
    assert time <= 1.5 * profile.duration(length)


def test_step_without_a_speed_has_the_robots_own_within_its_limits() -> None:
    straight, turn = StepGoal("a", 1, distance=1.0), StepGoal("a", 1, angle=1.0)
    assert SpeedProfile.of(straight, DriveConfig()).cruise == 0.3
    assert SpeedProfile.of(straight, DriveConfig(max_speed=0.2)).cruise == 0.2
    assert SpeedProfile.of(turn, DriveConfig()).cruise == 0.5
    assert SpeedProfile.of(turn, DriveConfig(max_turn=0.4)).cruise == pytest.approx(0.4)
