"""A simulated hand that leads a tip."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np
import pytest

from localization.geometry import FloatArray, so3_exp
from localization.types import SECOND, Pose
from teleop.scenario.operators.simulated_hand import HandSample, HandTraits, SimulatedHand

CALM = HandTraits(noise=0.0, unrest=0.0)


class Follower:
    """A tip that does as the hand does while the clutch is closed, and is seen late."""

    def __init__(self, hand: SimulatedHand, delay: int = 0) -> None:
        self.hand = hand
        self.tip = Pose.from_euler((0.2, 0.0, 0.2))
        self.shown = [self.tip] * (delay + 1)
        self.last: HandSample | None = None
        self.stamp = SECOND

    def go(self, seconds: float) -> Iterator[HandSample]:
        """Let the hand move the tip for a time."""
        for _ in range(round(seconds * 90)):
            self.stamp += self.hand.traits.period
            self.hand.see(self.shown[0])
            sample, last = self.hand.sample(self.stamp), self.last
            if last is not None and last.engaged and sample.engaged:
                turn = sample.pose.rotation @ last.pose.rotation.T
                moved = sample.pose.position - last.pose.position
                self.tip = Pose.from_rotation(self.tip.position + moved, turn @ self.tip.rotation)
            self.shown = [*self.shown[1:], self.tip]
            self.last = sample
            yield sample


def _hand(traits: HandTraits = CALM) -> SimulatedHand:
    return SimulatedHand(np.random.default_rng(1), traits)


def _positions(samples: list[HandSample]) -> FloatArray:
    return np.array([sample.pose.position for sample in samples])


def test_a_hand_leads_the_tip_to_where_it_aims() -> None:
    follower = Follower(_hand())
    goal = Pose.from_rotation(np.array([0.25, 0.1, 0.1]), so3_exp([0.0, 0.5, 0.3]))
    follower.hand.aim(goal, SECOND)
    list(follower.go(3.0))
    assert follower.hand.settled
    assert follower.hand.clutches == 1
    np.testing.assert_allclose(follower.tip.position, goal.position, atol=3e-3)
    np.testing.assert_allclose(follower.tip.rotation[:, 0], goal.rotation[:, 0], atol=0.035)


def test_it_reaches_with_the_speed_of_minimum_jerk_and_not_before_its_reaction() -> None:
    follower = Follower(_hand())
    follower.hand.aim(Pose.from_euler((0.2, 0.15, 0.2)), SECOND)
    samples = list(follower.go(2.0))
    moving = np.linalg.norm(np.diff(_positions(samples), axis=0), axis=1) > 0.0
    begun = samples[int(np.argmax(moving))].stamp
    # Once to close the clutch, once to move.
    assert begun - SECOND == pytest.approx(2 * CALM.reaction, abs=2 * CALM.period)
    speeds = np.linalg.norm(np.diff(_positions(samples), axis=0), axis=1) * 90
    assert speeds.max() == pytest.approx(1.875 * 0.3, rel=0.02)


def test_where_its_span_is_used_up_it_opens_the_clutch_and_comes_back() -> None:
    follower = Follower(_hand())
    goal = Pose.from_euler((0.2, 0.6, 0.2))
    follower.hand.aim(goal, SECOND)
    samples = list(follower.go(10.0))
    assert follower.hand.settled
    assert follower.hand.clutches == 3
    assert np.linalg.norm(_positions(samples), axis=1).max() <= CALM.span + 1e-9
    np.testing.assert_allclose(follower.tip.position, goal.position, atol=3e-3)
    closed = [sample.engaged for sample in samples]
    assert sum(a and not b for a, b in itertools.pairwise(closed)) == 2


def test_a_hand_that_must_turn_far_takes_up_the_clutch_as_well() -> None:
    follower = Follower(_hand())
    follower.hand.aim(Pose.from_euler((0.2, 0.0, 0.2), yaw=np.radians(100.0)), SECOND)
    list(follower.go(8.0))
    assert follower.hand.clutches == 2
    assert follower.tip.yaw == pytest.approx(np.radians(100.0), abs=0.035)


def test_with_noise_and_a_late_picture_it_still_arrives() -> None:
    follower = Follower(_hand(HandTraits(noise=0.002)), delay=18)
    for number, place in enumerate(((0.3, 0.1, 0.2), (0.2, -0.1, 0.3), (0.25, 0.0, 0.1))):
        follower.hand.aim(Pose.from_euler(place), follower.stamp)
        list(follower.go(5.0))
        assert np.linalg.norm(follower.tip.position - place) < 0.012, number


def test_the_noise_is_as_large_as_it_is_said_to_be() -> None:
    hand = _hand(HandTraits(noise=0.002, unrest=0.01))
    samples = [hand.sample(SECOND + k * hand.traits.period) for k in range(500)]
    assert np.std(_positions(samples)) == pytest.approx(0.002, rel=0.1)
    turns = [np.arccos(min(1.0, 0.5 * (np.trace(s.pose.rotation) - 1.0))) for s in samples]
    assert np.sqrt(np.mean(np.square(turns))) == pytest.approx(0.01 * np.sqrt(3.0), rel=0.1)


def test_without_an_aim_it_rests_with_the_clutch_open() -> None:
    follower = Follower(_hand())
    assert not any(sample.engaged for sample in follower.go(1.0))
    assert follower.hand.settled


def test_traits_that_make_no_sense_are_refused() -> None:
    with pytest.raises(ValueError, match=r"span must be > 0, got 0\.0"):
        HandTraits(span=0.0)
