from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from unittest import mock

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from localization.filter import prediction, updates
from localization.filter.ekf import STATES, EkfConfig, FilterState, corrected, propagated
from localization.filter.pose_error import LEVER, difference
from localization.geometry import so3_exp, wrap_angle
from localization.types import GRAVITY, Match, Pose
from tests.localization.filter.driven_filter import DrivenFilter
from tests.support import bits, floats, vectors
from tests.support_rooms import apart

DT = 0.02
DOWN = np.array([0.0, 0.0, GRAVITY])


Seen = tuple[np.ndarray, np.ndarray]
"""Innovation (k,) of a measurement, and its Jacobian (k, 13)."""


def seen_by(update: Callable[[], object]) -> Seen:
    """What an update is about to give to the filter; the filter stays as it is."""
    given: list[Seen] = []

    def corrected(
        state: FilterState, innovation: np.ndarray, h: np.ndarray, r: np.ndarray
    ) -> FilterState:
        given.append((innovation, h))
        return state

    def yaw_corrected(
        state: FilterState, innovation: float, slope: float, spread: float
    ) -> FilterState:
        h = np.zeros((1, STATES))
        h[0, 8], h[0, 10] = 1.0, slope
        given.append((np.array([innovation]), h))
        return state

    with (
        mock.patch.object(updates, "corrected", corrected),
        mock.patch.object(updates, "yaw_corrected", yaw_corrected),
    ):
        update()
    return given[-1]


def disturbed(error: np.ndarray, seed: int, config: EkfConfig = EkfConfig()) -> DrivenFilter:  # noqa: B008
    """A filter somewhere, whose nominal state is off by an error (13,)."""
    rng = np.random.default_rng(seed)
    ekf = DrivenFilter(config)
    pose = Pose.from_euler(rng.uniform(-9, 9, 3), roll=0.2, pitch=-0.1, yaw=rng.uniform(-3, 3))
    ekf.state = replace(
        ekf.state,
        pose=Pose.from_rotation(pose.position + error[:3], pose.rotation @ so3_exp(error[3:6])),
        gyro_bias=rng.uniform(-0.01, 0.01, 3) + error[6:9],
        kappa=ekf.kappa + rng.uniform(-0.05, 0.05, 4) + error[9:],
    )
    return ekf


def state_difference(a: DrivenFilter, b: DrivenFilter) -> np.ndarray:
    return np.concatenate(
        [difference(a.pose, b.pose), b.gyro_bias - a.gyro_bias, b.kappa - a.kappa]
    )


def match_of(pose: Pose, sigma: np.ndarray, directions: np.ndarray | None = None) -> Match:
    """A match of given sigmas (6,); by default of all directions."""
    information = np.diag(1.0 / np.square(sigma))
    return Match(
        0, pose, information, np.eye(6) if directions is None else directions, np.zeros(0), 1.0
    )


GOOD = np.array([0.01, 0.01, 0.01, 0.002, 0.002, 0.002])


def a_little(ekf: DrivenFilter, n: int, *, left: float = 0.4, right: float = 0.5) -> None:
    for _ in range(n):
        ekf.predict(DT, np.array([0.0, 0.0, 0.17]), DOWN, left, right, slipping=False)


def stand(ekf: DrivenFilter, seconds: float, gyro: np.ndarray | None = None) -> None:
    """Let nothing move for a while."""
    for _ in range(round(seconds / DT)):
        ekf.predict(DT, np.zeros(3) if gyro is None else gyro, DOWN, 0.0, 0.0, slipping=False)


def healthy(ekf: DrivenFilter) -> None:
    p = ekf.full_covariance
    assert np.isfinite(p).all()
    assert p == pytest.approx(p.T, rel=1e-9, abs=1e-18)
    scale = 1.0 / np.sqrt(np.diag(p))
    assert np.linalg.eigvalsh(p * np.outer(scale, scale)).min() > 0.0


# Jacobians


@given(
    seed=st.integers(0, 500),
    gyro=vectors(3, 1.0),
    left=floats(-1.0, 1.0),
    right=floats(-1.0, 1.0),
    speed=st.one_of(st.none(), floats(-1.0, 1.0)),
)
@settings(max_examples=20)
def test_process_jacobian_is_the_slope_of_the_prediction(
    seed: int, gyro: np.ndarray, left: float, right: float, speed: float | None
) -> None:
    dt = 1e-3

    def predicted(error: np.ndarray) -> DrivenFilter:
        ekf = disturbed(error, seed)
        ekf.predict(dt, gyro, DOWN, left, right, slipping=False, speed=speed)
        return ekf

    h = 1e-5
    with mock.patch.object(prediction, "propagated", wraps=propagated) as spy:
        predicted(np.zeros(STATES))
    jacobian = spy.call_args.args[1]
    for i, e in enumerate(np.eye(STATES)):
        slope = state_difference(predicted(-h * e), predicted(h * e)) / (2.0 * h)
        # First order in dt: what is left out is of second.
        assert slope == pytest.approx(jacobian[:, i], abs=3.0 * dt**2)


def wheel_yaw_seen(error: np.ndarray, seed: int) -> Seen:
    turn, split = np.random.default_rng(seed).uniform([-1.0, -0.5], [1.0, 0.5])
    ekf = disturbed(error, seed, EkfConfig(consistent=1.0))
    gyro = np.array([0.0, 0.0, turn])
    return seen_by(lambda: ekf.update_wheel_yaw(gyro, 0.3 - split, 0.3 + split))


def standstill_seen(error: np.ndarray, seed: int) -> Seen:
    ekf = disturbed(error, seed)
    stand(ekf, 0.5)
    return seen_by(lambda: ekf.update_standstill(np.zeros(3), 0.0, 0.0))


def tilt_seen(error: np.ndarray, seed: int) -> Seen:
    force = disturbed(np.zeros(STATES), seed).pose.rotation.T @ DOWN
    ekf = disturbed(error, seed)
    ekf.predict(1e-9, np.zeros(3), force, 0.0, 0.0, slipping=False)
    return seen_by(lambda: ekf.update_tilt(0.1))


def match_seen(error: np.ndarray, seed: int) -> Seen:
    directions, _ = np.linalg.qr(np.random.default_rng(seed).standard_normal((6, 4)))
    match = match_of(disturbed(np.zeros(STATES), seed).pose, GOOD, directions.T)
    innovation, h, _ = disturbed(error, seed).match_innovation(match)
    return innovation, h


@pytest.mark.slow
@pytest.mark.parametrize("seen", [wheel_yaw_seen, standstill_seen, tilt_seen, match_seen])
@given(seed=st.integers(0, 500))
@settings(max_examples=15)
def test_jacobian_of_a_measurement_is_the_slope_of_its_innovation(
    seen: Callable[[np.ndarray, int], Seen], seed: int
) -> None:
    """An innovation falls by H e when the state is off by e."""
    step = 1e-6
    _, h = seen(np.zeros(STATES), seed)
    for i, e in enumerate(np.eye(STATES)):
        slope = (seen(step * e, seed)[0] - seen(-step * e, seed)[0]) / (2.0 * step)
        assert -slope == pytest.approx(h[:, i], abs=1e-4)


# Prediction


def test_prediction_is_the_arc_that_wheels_and_gyro_describe() -> None:
    ekf = DrivenFilter()
    ekf.reset_pose(Pose.planar(1.0, 2.0, 0.5), np.eye(6) * 1e-6)
    turn, speed = 0.4, 0.5
    for _ in range(250):
        ekf.predict(DT, np.array([0.0, 0.0, turn]), DOWN, speed, speed, slipping=False)
    radius = speed / turn
    wanted = Pose.planar(1.0, 2.0, 0.5) @ Pose.planar(
        radius * np.sin(2.0), radius * (1.0 - np.cos(2.0)), 2.0
    )
    assert apart(ekf.pose, wanted)[0] < 1e-4
    assert ekf.twist.linear[0] == pytest.approx(speed)
    assert ekf.twist.angular[2] == pytest.approx(turn)


def test_motions_returned_add_up_to_the_pose() -> None:
    ekf, pose = DrivenFilter(), Pose.identity()
    for i in range(50):
        pose = pose @ ekf.predict(
            DT, np.array([0.1, -0.2, 0.3]), DOWN, 0.1 + 0.01 * i, 0.4, slipping=False
        )
    assert apart(pose, ekf.pose)[0] < 1e-12


def test_speed_given_takes_the_place_of_the_wheels() -> None:
    ekf = DrivenFilter()
    motion = ekf.predict(DT, np.zeros(3), DOWN, 3.0, 3.0, slipping=True, speed=0.5)
    assert motion.position == pytest.approx([0.5 * DT, 0.0, 0.0])


def test_uncertainty_grows_faster_while_slipping_than_rolling_than_standing() -> None:
    spreads = []
    for speed, slipping in ((0.0, False), (0.5, False), (0.5, True)):
        ekf = DrivenFilter()
        for _ in range(50):
            ekf.predict(DT, np.zeros(3), DOWN, speed, speed, slipping=slipping)
        spreads.append(np.sqrt(ekf.accrued[0, 0]))
    assert spreads[0] < 0.001
    assert 5.0 * spreads[0] < spreads[1] < spreads[2] / 5.0


# Standing


def settled(bias: np.ndarray, seed: int, seconds: float) -> DrivenFilter:
    """A filter that has stood for a while; sensors are read ten times a second."""
    rng = np.random.default_rng(seed)
    ekf, dt = DrivenFilter(), 0.1
    ekf.state = replace(ekf.state, kappa=np.array([0.0, 0.0, 0.02, 0.0]))
    for _ in range(round(seconds / dt)):
        gyro = bias + np.deg2rad(0.02) / np.sqrt(dt) * rng.standard_normal(3)
        force = DOWN + [0.03, 0.0, -0.02] + 0.02 * rng.standard_normal(3)
        assert ekf.update_wheel_yaw(gyro, 0.0, 0.0, seconds=dt)
        ekf.update_standstill(gyro, 0.0, 0.0, seconds=dt)
        ekf.predict(dt, gyro, force, 0.0, 0.0, slipping=False)
        ekf.update_tilt(dt)
    return ekf


@pytest.mark.slow
def test_robot_that_stands_for_ten_minutes_neither_drifts_nor_grows_unsure() -> None:
    bias = np.deg2rad([0.1, -0.2, 0.3])
    yaw = settled(bias, 0, 10.0).pose.yaw
    ekf = settled(bias, 0, 600.0)
    assert ekf.standing
    assert ekf.pose.position == pytest.approx(np.zeros(3), abs=1e-4)
    # Unwatched, the bias would be 180 degrees, and the gyro's noise half a degree.
    assert np.rad2deg(ekf.pose.yaw - yaw) == pytest.approx(0.0, abs=0.005)
    sigma = np.sqrt(np.diag(ekf.full_covariance))
    assert sigma[:3].max() < 0.013
    assert np.rad2deg(sigma[5]) < 0.09
    assert np.abs(ekf.gyro_bias - bias).max() < 4.0 * sigma[8] < np.deg2rad(0.04)
    assert not ekf.twist.angular.any()
    healthy(ekf)


def test_sweeps_from_one_place_make_nobody_surer_than_one_place_can() -> None:
    ekf = settled(np.zeros(3), 5, 2.0)
    ekf.reset_pose(Pose.identity(), np.diag([0.05**2] * 3 + [0.02**2] * 3))
    there = Pose.planar(0.004, -0.002, 0.001)
    for _ in range(200):
        stand(ekf, 0.1)
        ekf.update_match(match_of(there, GOOD))
    sigma = np.sqrt(np.diag(ekf.covariance))
    c = ekf.config
    assert sigma[:3] == pytest.approx(np.full(3, c.still_position), rel=0.05)
    assert sigma[3:] == pytest.approx(np.full(3, c.still_angle), rel=0.05)
    assert apart(ekf.pose, there)[0] < 1e-3
    healthy(ekf)


@pytest.mark.parametrize("rate", [1.0, 3.0, 20.0])
def test_robot_that_is_turned_on_the_spot_by_hand_turns_in_the_filter(rate: float) -> None:
    bias = np.deg2rad([0.1, -0.2, 0.3])
    ekf = settled(bias, 1, 20.0)
    yaw, known = ekf.pose.yaw, ekf.gyro_bias
    for _ in range(500):
        gyro = bias + np.deg2rad([0.0, 0.0, rate])
        agrees = ekf.update_wheel_yaw(gyro, 0.0, 0.0)
        ekf.update_standstill(gyro, 0.0, 0.0)
        ekf.predict(DT, gyro, DOWN, 0.0, 0.0, slipping=not agrees)
        assert not ekf.standing
    turned = wrap_angle(ekf.pose.yaw - yaw - np.deg2rad(10.0 * rate))
    assert np.rad2deg(turned) == pytest.approx(0.0, abs=0.3)
    assert ekf.gyro_bias == pytest.approx(known, abs=np.deg2rad(0.01))


@pytest.mark.parametrize("push", [[0.4, 0.0, 0.0], [0.0, 0.4, 0.0], [0.0, 0.0, 1.0]])
def test_robot_that_is_pushed_or_lifted_does_not_stand(push: list[float]) -> None:
    ekf = settled(np.zeros(3), 2, 5.0)
    spread = ekf.covariance[0, 0]
    for _ in range(15):
        ekf.predict(DT, np.zeros(3), DOWN + push, 0.0, 0.0, slipping=False)
        assert not ekf.standing
    # It may be moving at any speed by now: only a while of rest makes it stand again.
    ekf.predict(DT, np.zeros(3), DOWN, 0.0, 0.0, slipping=False)
    assert not ekf.standing
    stand(ekf, 1.1)
    assert ekf.standing
    assert ekf.covariance[0, 0] > spread


def test_robot_whose_wheels_are_distrusted_does_not_stand() -> None:
    ekf = settled(np.zeros(3), 3, 5.0)
    assert ekf.standing
    bias = ekf.gyro_bias
    for _ in range(50):
        ekf.predict(DT, np.zeros(3), DOWN, 0.0, 0.0, slipping=True, speed=0.3)
        ekf.update_standstill(np.zeros(3), 0.0, 0.0)
    assert not ekf.standing
    assert bits(ekf.gyro_bias) == bits(bias)
    assert ekf.pose.position[0] == pytest.approx(0.3, abs=0.01)


def test_robot_begins_to_drive_with_the_first_reading_of_its_wheels() -> None:
    ekf = settled(np.zeros(3), 4, 5.0)
    a_little(ekf, 1, left=0.02, right=0.02)
    assert not ekf.standing
    assert ekf.twist.angular[2] == pytest.approx(0.17, abs=0.01)


# Corrections


def test_wheels_that_turn_as_the_gyro_says_are_believed_and_others_are_not() -> None:
    ekf = DrivenFilter()
    track, turn = ekf.config.effective_track, 0.5
    gyro = np.array([0.0, 0.0, turn])
    assert ekf.update_wheel_yaw(gyro, 0.3 - turn * track / 2, 0.3 + turn * track / 2)
    before = ekf.full_covariance
    assert not ekf.update_wheel_yaw(gyro, 0.3, 0.3 + 2.0)
    assert bits(ekf.full_covariance) == bits(before)
    assert not ekf.update_wheel_yaw(np.zeros(3), -0.3, 0.3)


@given(seed=st.integers(0, 500), turn=floats(-0.8, 0.8), off=floats(-0.05, 0.05))
@settings(max_examples=20)
def test_wheels_yaw_is_weighed_as_filterpy_weighs_it(seed: int, turn: float, off: float) -> None:
    ekf = DrivenFilter()
    wander(ekf, seed)
    gyro = np.array([0.0, 0.0, turn])
    across = 0.5 * ekf.config.effective_track * (turn + off)
    h = np.zeros((1, STATES))
    wheels = np.exp(ekf.kappa[1]) * 2.0 * across / ekf.config.effective_track
    h[0, 8], h[0, 10] = 1.0, wheels
    variance = 5.0 * (ekf.config.wheel_yaw_floor**2 + (0.05 * (turn - ekf.gyro_bias[2])) ** 2)
    innovation = np.array([turn - ekf.gyro_bias[2] - wheels])
    dense = DrivenFilter(state=corrected(ekf.state, innovation, h, np.array([[variance]])))
    assert ekf.update_wheel_yaw(gyro, 0.3 - across, 0.3 + across)
    assert state_difference(ekf, dense) == pytest.approx(np.zeros(STATES), abs=1e-12)
    assert ekf.full_covariance == pytest.approx(dense.full_covariance, rel=1e-8, abs=1e-15)


def test_track_is_learned_from_turns() -> None:
    ekf = DrivenFilter()
    true, turn = 0.64, 0.6
    for i in range(50 * 60):
        w = turn * np.sin(0.02 * i)
        gyro = np.array([0.0, 0.0, w])
        ekf.update_wheel_yaw(gyro, -0.5 * w * true, 0.5 * w * true)
        ekf.predict(DT, gyro, DOWN, -0.5 * w * true, 0.5 * w * true, slipping=False)
    nominal = ekf.config.effective_track
    assert nominal / np.exp(ekf.kappa[1]) == pytest.approx(true, abs=0.01)
    assert nominal < 0.6


def test_scale_of_forward_speed_is_not_learned_from_turns() -> None:
    ekf = DrivenFilter()
    before = ekf.kappa[0], ekf.full_covariance[9, 9]
    for _ in range(200):
        ekf.update_wheel_yaw(np.array([0.0, 0.0, 0.6]), 0.3 - 0.19, 0.3 + 0.19)
    assert (ekf.kappa[0], ekf.full_covariance[9, 9]) == before


@pytest.mark.slow
@given(roll=floats(-0.08, 0.08), pitch=floats(-0.08, 0.08), yaw=floats(-3.0, 3.0))
@settings(max_examples=5)
def test_tilt_converges_to_where_gravity_points(roll: float, pitch: float, yaw: float) -> None:
    true = Pose.from_euler([0, 0, 0], roll=roll, pitch=pitch, yaw=yaw)
    ekf = DrivenFilter()
    ekf.reset_pose(Pose.planar(0, 0, yaw), np.diag([1e-4] * 3 + [0.05**2] * 2 + [1e-4]))
    force = true.rotation.T @ DOWN
    for i in range(50 * 20):
        ekf.predict(DT, np.zeros(3), force, 0.0, 0.0, slipping=False)
        ekf.update_standstill(np.zeros(3), 0.0, 0.0)
        if i % 5 == 4:
            ekf.update_tilt(0.1)
    assert ekf.pose.euler[:2] == pytest.approx((roll, pitch), abs=np.deg2rad(0.5))


def test_tilt_is_not_taken_from_a_robot_that_turns_or_speeds_up() -> None:
    ekf = DrivenFilter()
    ekf.reset_pose(Pose.identity(), np.diag([1e-4] * 3 + [0.02**2] * 3))
    speed, turn = 0.0, 0.8
    for i in range(200):
        speed += 0.5 * DT
        force = DOWN + np.array([0.5, speed * turn, 0.0])
        ekf.predict(DT, np.array([0.0, 0.0, turn]), force, speed, speed, slipping=False)
        if i % 5 == 4:
            ekf.update_tilt(0.1)
    # Taken for gravity, half a metre per second squared would be three degrees.
    assert ekf.pose.euler[:2] == pytest.approx((0.0, 0.0), abs=np.deg2rad(0.2))


def test_tilt_without_force_or_time_changes_nothing() -> None:
    ekf = DrivenFilter()
    before = ekf.full_covariance
    ekf.update_tilt(0.1)
    assert bits(ekf.full_covariance) == bits(before)
    a_little(ekf, 1)
    before = ekf.full_covariance
    ekf.update_tilt(0.0)
    assert bits(ekf.full_covariance) == bits(before)


@given(error=vectors(6, 1.0))
@settings(max_examples=20)
def test_match_draws_the_pose_to_where_it_says(error: np.ndarray) -> None:
    ekf = DrivenFilter()
    ekf.reset_pose(Pose.planar(3, 4, 1), np.diag([0.3**2] * 3 + [0.1**2] * 3))
    e = error * np.repeat([0.2, 0.05], 3)
    there = Pose.from_rotation(ekf.pose.position + e[:3], ekf.pose.rotation @ so3_exp(e[3:]))
    for _ in range(3):
        ekf.update_match(match_of(there, GOOD))
    distance, angle = apart(ekf.pose, there)
    assert distance < 0.002
    assert angle < 0.001
    assert np.sqrt(np.diag(ekf.covariance))[:3].max() < GOOD[0]
    healthy(ekf)


def test_match_leaves_directions_that_it_does_not_keep() -> None:
    ekf = DrivenFilter()
    ekf.reset_pose(Pose.planar(3, 4, 1), np.diag([0.3**2] * 3 + [0.1**2] * 3))
    there = Pose.planar(3.2, 4.1, 1.05)
    ekf.update_match(match_of(there, GOOD, np.eye(6)[1:]))
    assert ekf.pose.position[0] == pytest.approx(3.0, abs=1e-6)
    assert ekf.pose.position[1] == pytest.approx(4.1, abs=1e-3)
    assert np.sqrt(ekf.covariance[0, 0]) == pytest.approx(0.3, abs=1e-3)


def test_nis_of_a_match_is_its_squared_distance_in_sigmas() -> None:
    ekf = DrivenFilter()
    ekf.reset_pose(Pose.identity(), np.diag(np.square(3.0 * GOOD)))
    there = Pose.from_rotation(np.array([0.06, 0.0, 0.0]), np.eye(3))
    wanted = 0.06**2 / (0.01**2 + 0.03**2)
    assert ekf.match_nis(match_of(there, GOOD)) == pytest.approx(wanted)
    assert ekf.match_nis(match_of(there, GOOD, np.eye(6)[:1])) == pytest.approx(wanted)
    assert ekf.match_nis(match_of(there, GOOD, np.eye(6)[1:])) == pytest.approx(0.0, abs=1e-12)


def test_widening_adds_variance_along_the_robots_axes() -> None:
    ekf = DrivenFilter()
    ekf.reset_pose(Pose.planar(0, 0, np.pi / 2), np.eye(6) * 1e-6)
    ekf.widen(0.3, 0.1, 0.05, 0.02)
    sigma = np.sqrt(np.diag(ekf.covariance) - 1e-6)
    assert sigma == pytest.approx([0.1, 0.3, 0.05, 0.0, 0.0, 0.02], abs=1e-9)
    assert np.diag(ekf.accrued) == pytest.approx(np.diag(ekf.covariance) - 1e-6)
    healthy(ekf)


def test_gravity_says_nothing_about_the_heading_of_a_robot_that_leans() -> None:
    """Slip may have turned it about the vertical, which it carries askew."""
    ekf = DrivenFilter()
    leaning = so3_exp(np.array([0.2, -0.1, 0.0]))
    ekf.reset_pose(Pose.from_rotation(np.zeros(3), leaning), np.eye(6) * 1e-6)
    ekf.predict(DT, np.zeros(3), leaning.T @ DOWN, 0.0, 0.0, slipping=False)
    ekf.widen(0.1, 0.05, 0.02, 0.05)
    ekf.update_tilt(0.1)
    vertical = ekf.pose.rotation[2]
    assert vertical @ ekf.covariance[3:, 3:] @ vertical == pytest.approx(0.05**2, rel=0.01)
    healthy(ekf)


def test_new_pose_forgets_how_the_old_one_hung_together_with_the_rest() -> None:
    ekf = DrivenFilter()
    a_little(ekf, 200)
    before = ekf.full_covariance
    assert np.abs(before[:6, 6:]).max() > 1e-6
    pose, covariance = Pose.planar(7, 8, 1), np.diag([0.1, 0.2, 0.3, 0.01, 0.02, 0.03])
    ekf.reset_pose(pose, covariance)
    after = ekf.full_covariance
    assert ekf.pose is pose
    assert bits(after[:6, :6]) == bits(covariance)
    assert not after[:6, 6:].any()
    assert not after[6:, :6].any()
    assert bits(after[6:, 6:]) == bits(before[6:, 6:])
    assert not ekf.accrued.any()


# Observed motion

SEEN = np.diag(np.square([0.01, 0.01, 0.005]))
NONE = np.zeros((0, 6))


def under_way(yaw: float) -> tuple[DrivenFilter, Pose]:
    """A filter that has moved on from a pose it is not sure of; with that pose."""
    ekf = DrivenFilter()
    ekf.reset_pose(Pose.planar(1.0, 2.0, yaw), np.diag(np.square([0.2, 0.2, 0.1, 0.01, 0.01, 0.1])))
    then = ekf.pose
    for _ in range(5):
        ekf.predict(DT, np.array([0.0, 0.0, 0.2]), DOWN, 0.5, 0.5, slipping=True)
    return ekf, then


@pytest.mark.parametrize("yaw", [0.0, -2.5, 1.1])
def test_observed_motion_is_weighed_like_a_measurement_of_what_was_added_since_the_mark(
    yaw: float,
) -> None:
    ekf, then = under_way(yaw)
    h = np.zeros((3, 6))
    h[:2, :3], h[2, 5] = ekf.pose.rotation.T[:2], 1.0
    q, before = ekf.accrued.copy(), ekf.covariance
    motion = (then.inverse() @ ekf.pose) @ Pose.planar(0.02, -0.01, 0.003)
    innovation = h @ difference(ekf.pose, then @ motion)
    gain = q @ h.T @ np.linalg.inv(h @ q @ h.T + SEEN)
    pose = ekf.pose
    ekf.update_relative(then, motion, SEEN, NONE)
    assert difference(pose, ekf.pose) == pytest.approx(gain @ innovation, abs=1e-9)
    assert ekf.covariance == pytest.approx(before - gain @ h @ q, abs=1e-8)


@given(yaw=floats(-3.0, 3.0), off=floats(-0.1, 0.1))
@settings(max_examples=20)
def test_observed_motion_says_nothing_in_directions_that_a_match_has_used(
    yaw: float, off: float
) -> None:
    results = []
    for side in (0.0, off):
        ekf, then = under_way(yaw)
        across = np.zeros((1, 6))
        across[0, :3] = ekf.pose.rotation[:, 1]
        motion = (then.inverse() @ ekf.pose) @ Pose.planar(0.03, side, 0.0)
        ekf.update_relative(then, motion, SEEN, across)
        results.append(ekf)
    straight, aside = results
    assert difference(straight.pose, aside.pose) == pytest.approx(np.zeros(6), abs=1e-12)
    fresh, _ = under_way(yaw)
    step = fresh.pose.rotation.T @ (straight.pose.position - fresh.pose.position)
    assert step[0] == pytest.approx(0.03, abs=0.005)
    assert step[1] == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize(("marked", "used"), [(False, np.eye(6)), (True, NONE)])
def test_observed_motion_changes_nothing_where_all_directions_are_used_or_nothing_was_added(
    marked: bool, used: np.ndarray
) -> None:
    ekf, then = under_way(0.3)
    if marked:
        ekf.mark()
    pose, before = ekf.pose, ekf.full_covariance
    ekf.update_relative(then, then.inverse() @ pose @ Pose.planar(1, 1, 1), SEEN, used)
    assert bits(ekf.pose) == bits(pose)
    assert ekf.full_covariance == pytest.approx(before, rel=1e-12, abs=1e-18)


# Earlier states


def wander(ekf: DrivenFilter, seed: int) -> None:
    """Everything that changes a filter, in some order."""
    rng = np.random.default_rng(seed)
    for i in range(40):
        gyro, force = 0.1 * rng.standard_normal(3), DOWN + 0.1 * rng.standard_normal(3)
        left, right = rng.choice([0.0, 1.0]) * rng.uniform(-0.5, 0.5, 2)
        ekf.update_wheel_yaw(gyro, left, right)
        ekf.update_standstill(0.001 * gyro, 0.0, 0.0)
        then = ekf.pose
        ekf.predict(DT, gyro, force, left, right, slipping=bool(rng.integers(2)))
        if i % 5 == 3:
            ekf.update_tilt(0.1)
            ekf.update_relative(
                then, then.inverse() @ ekf.pose @ Pose.planar(0.01, 0, 0), SEEN, NONE
            )
            ekf.update_match(match_of(ekf.pose @ Pose.planar(0.01, 0.01, 0.002), GOOD))
        if i % 11 == 7:
            ekf.widen(0.1, 0.05, 0.02, 0.02)
        if i % 9 == 5:
            ekf.mark()


def everything(state: FilterState) -> tuple[object, ...]:
    arrays = (
        state.pose.position,
        state.pose.quaternion_wxyz,
        state.pose.rotation,
        state.gyro_bias,
        state.kappa,
        state.twist.linear,
        state.twist.angular,
        state.full_covariance,
        state.accrued,
        state.by_ratio,
        state.force_sum,
        np.array([state.force_count, np.nan if state.tilt_speed is None else state.tilt_speed]),
    )
    return state.rest, *(bits(a) for a in arrays)


@given(before=st.integers(0, 1000), astray=st.integers(0, 1000), after=st.integers(0, 1000))
@settings(max_examples=10)
def test_filter_goes_on_from_an_earlier_state_bit_for_bit(
    before: int, astray: int, after: int
) -> None:
    ekf = DrivenFilter()
    wander(ekf, before)
    known, there = ekf.state, everything(ekf.state)
    wander(ekf, after)
    wanted = everything(ekf.state)
    wander(ekf, astray)
    assert everything(known) == there, "no update writes to an earlier state"
    again = DrivenFilter(state=known)
    wander(again, after)
    assert everything(again.state) == wanted


# Hygiene


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_measurements_that_are_not_finite_do_not_reach_the_filter(bad: float) -> None:
    ekf = DrivenFilter()
    a_little(ekf, 10)
    pose, before = ekf.pose, ekf.full_covariance
    unsure = match_of(pose, GOOD)
    poisoned = np.array(unsure.information)
    poisoned[0, 0] = np.nan
    attempts: list[Callable[[], object]] = [
        lambda: ekf.predict(DT, np.array([0.0, 0.0, bad]), DOWN, 0.1, 0.1, slipping=False),
        lambda: ekf.update_wheel_yaw(np.array([0.0, 0.0, np.nan]), 0.1, 0.1),
        lambda: ekf.update_wheel_yaw(np.zeros(3), np.nan, 0.1),
        lambda: ekf.update_match(
            Match(0, pose, poisoned, unsure.observable_directions, np.zeros(0), 1.0)
        ),
        lambda: ekf.update_relative(Pose.identity(), pose, np.diag([bad, 1.0, 1.0]), NONE),
    ]
    for attempt in attempts:
        with pytest.raises((ArithmeticError, ValueError), match="finite"):
            attempt()
        assert ekf.pose is pose
        assert bits(ekf.full_covariance) == bits(before)


@given(seed=st.integers(0, 100_000))
@settings(max_examples=15)
@pytest.mark.slow
def test_covariance_stays_symmetric_and_positive_whatever_comes(seed: int) -> None:
    rng = np.random.default_rng(seed)
    ekf = DrivenFilter()
    ekf.reset_pose(Pose.planar(*rng.uniform(-3, 3, 3)), np.diag(rng.uniform(1e-8, 0.3, 6)))
    for _ in range(12):
        then = ekf.pose
        v, w = rng.uniform(-1, 1), rng.choice([0.0, rng.uniform(-1, 1)])
        left, right = rng.choice([0.0, 1.0]) * np.array([v - 0.3 * w, v + 0.3 * w])
        for _ in range(rng.integers(1, 30)):
            gyro = np.array([0.0, 0.0, w]) + 0.01 * rng.standard_normal(3)
            ekf.update_wheel_yaw(gyro, left, right)
            ekf.update_standstill(gyro, left, right)
            force = DOWN + 0.3 * rng.standard_normal(3)
            ekf.predict(DT, gyro, force, left, right, slipping=bool(rng.integers(2)))
        if rng.random() < 0.7:
            ekf.update_tilt(0.1)
        healthy(ekf)
        directions, _ = np.linalg.qr(rng.standard_normal((6, 6)))
        directions = directions[: rng.integers(0, 7)]
        used = directions if rng.random() < 0.5 else NONE
        if rng.random() < 0.3:
            ekf.widen(0.1, 0.05, 0.02, 0.02)
        if rng.random() < 0.7:
            seen = np.diag(10.0 ** rng.uniform(-6, 2, 3))
            ekf.update_relative(then, then.inverse() @ ekf.pose, seen, used)
            healthy(ekf)
        if len(directions):
            there = ekf.pose @ Pose.planar(*rng.uniform(-0.05, 0.05, 3))
            ekf.update_match(match_of(there, 10.0 ** rng.uniform(-4, 0, 6), directions))
        ekf.mark()
        healthy(ekf)


def test_lever_is_the_same_on_both_sides_of_a_match() -> None:
    """A direction of one unit means 1/LEVER radians of turn: information in radians is met exactly."""
    ekf = DrivenFilter()
    only_yaw = np.eye(6)[5:]
    innovation, h, r = ekf.match_innovation(match_of(Pose.planar(0, 0, 0.1), GOOD, only_yaw))
    assert innovation == pytest.approx([0.1 * LEVER])
    assert h[0, 5] == LEVER
    assert r[0, 0] == pytest.approx((0.002 * LEVER) ** 2)
