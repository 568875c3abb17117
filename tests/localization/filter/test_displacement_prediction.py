from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from localization.filter.displacement_prediction import predict_displacement
from localization.filter.ekf import (
    GYRO_BIAS,
    KAPPA,
    POSITION,
    ROTATION,
    STATES,
    FilterState,
    corrected,
    initial_state,
    mark,
    with_pose,
)
from localization.filter.ekf_config import EkfConfig
from localization.filter.pose_error import difference
from localization.filter.updates import between, update_relative
from localization.geometry import FloatArray, so3_exp
from localization.motion.displacement import arc_step, with_turn
from localization.motion.gyro_turn import GyroStep, ReportedTilt, TurnWitness
from localization.motion.odometry_noise import OdometryNoise, step_variance
from localization.motion.sensor_configuration import Motion, SensorConfiguration
from localization.types import InvalidReadingError, Pose
from tests.support import floats, vectors

CONFIG = EkfConfig.of(SensorConfiguration(Motion.ODOMETRY))
EXACT = replace(CONFIG, odometry=OdometryNoise(*(0.0 for _ in range(10))))
"""Wheels without any error."""
PSI = KAPPA.start + 1


def filter_at(pose: Pose, ratio: float = 1.0, config: EkfConfig = CONFIG) -> FilterState:
    kappa = np.array([0.0, np.log(ratio), 0.0, 0.0])
    return replace(initial_state(config), pose=pose, kappa=kappa)


def disturbed(state: FilterState, error: FloatArray) -> FilterState:
    """The state with an error (13,) in the filter's own coordinates."""
    pose = state.pose
    moved = Pose.from_rotation(
        pose.position + error[POSITION], pose.rotation @ so3_exp(error[ROTATION])
    )
    return replace(state, pose=moved, kappa=state.kappa + error[KAPPA])


def error_between(one: FilterState, other: FilterState) -> FloatArray:
    e = np.zeros(STATES)
    e[:6] = difference(one.pose, other.pose)
    e[KAPPA] = other.kappa - one.kappa
    return e


STATE = st.builds(
    filter_at,
    st.builds(lambda p, r: Pose.from_rotation(p, so3_exp(r)), vectors(3, 20.0), vectors(3, 1.5)),
    floats(0.5, 1.9),
)
STEP = st.builds(Pose.planar, floats(-1.0, 1.0), floats(-0.5, 0.5), floats(-1.5, 1.5))


@given(STATE, STEP, vectors(STATES, 1.0).filter(lambda e: np.linalg.norm(e) > 0.1))
@settings(max_examples=60)
def test_covariance_is_carried_by_the_slope_of_the_prediction(
    state: FilterState, step: Pose, e: FloatArray
) -> None:
    h = 1e-6
    e = np.where(np.arange(STATES) // 3 == 2, 0.0, e)  # a displacement has no gyro
    alone = replace(state, full_covariance=np.outer(e, e))
    after, _ = predict_displacement(alone, EXACT, step, 0.1)
    more, _ = predict_displacement(disturbed(state, h * e), EXACT, step, 0.1)
    less, _ = predict_displacement(disturbed(state, -h * e), EXACT, step, 0.1)
    slope = (error_between(after, more) - error_between(after, less)) / (2.0 * h)
    np.testing.assert_allclose(after.full_covariance, np.outer(slope, slope), atol=2e-6)


@pytest.mark.parametrize("ratio", [0.7, 1.0, 1.85])
def test_covariance_is_that_of_many_drives(ratio: float) -> None:
    """Of eight steps along a curve, each with its own noise, and a ratio that is not known exactly."""
    rng = np.random.default_rng(5)
    step, turn_back = arc_step(0.2, 0.5), Pose.planar(0.0, 0.0, -0.4)
    config = replace(CONFIG, skid_steer=(0.0, 0.05, 0.0, 0.0))
    predicted = filter_at(Pose.planar(1.0, 2.0, 0.4), ratio, config)
    drives = [
        disturbed(predicted, _error_of_ratio(0.05 * rng.standard_normal())) for _ in range(250)
    ]
    for _ in range(8):
        for measured in (step, turn_back):
            predicted, motion = predict_displacement(predicted, config, measured, 0.1)
            added = step_variance(motion, 0.1, config.odometry)
            for i, drive in enumerate(drives):
                after, _ = predict_displacement(drive, config, measured, 0.1)
                x, y, yaw = rng.standard_normal(3) * np.sqrt(
                    [added.along, added.aside, added.heading]
                )
                noise = np.zeros(STATES)
                noise[POSITION] = drive.pose.rotation @ [x, y, 0.0]
                noise[5] = yaw
                noise[PSI] = np.sqrt(added.ratio) * rng.standard_normal()
                drives[i] = disturbed(after, noise)
    errors = np.array([error_between(predicted, drive)[[0, 1, 5, PSI]] for drive in drives])
    claimed = predicted.full_covariance[np.ix_([0, 1, 5, PSI], [0, 1, 5, PSI])]
    # The mean of the squared errors over what is claimed has a sigma of 4 % for 250 drives of 4 values.
    nees = float(np.mean(np.einsum("ni,ni->n", errors, np.linalg.solve(claimed, errors.T).T)))
    assert nees == pytest.approx(4.0, rel=0.15)
    assert np.std(errors, axis=0) == pytest.approx(np.sqrt(np.diag(claimed)), rel=0.2)


def _error_of_ratio(psi: float) -> FloatArray:
    e = np.zeros(STATES)
    e[PSI] = psi
    return e


def corrected_yaw(state: FilterState, yaw: float, sigma: float) -> FilterState:
    """The state after a scan has shown the heading."""
    h = np.zeros((1, STATES))
    h[0, 5] = 1.0
    off = np.angle(np.exp(1j * (yaw - state.pose.yaw)))
    return corrected(state, np.array([off]), h, np.array([[sigma**2]]))


@pytest.mark.parametrize("ratio", [0.5, 0.7, 1.27, 1.85])
def test_yaw_ratio_is_learned_from_the_headings_that_scans_show(ratio: float) -> None:
    rng = np.random.default_rng(2)
    state, yaw = filter_at(Pose.identity()), 0.0
    for k in range(60):
        counted = 0.15 if (k // 15) % 2 == 0 else -0.15
        yaw += ratio * counted
        state, _ = predict_displacement(state, CONFIG, arc_step(0.05, counted), 0.1)
        state = corrected_yaw(state, yaw + 0.005 * rng.standard_normal(), 0.005)
    sigma = np.sqrt(state.full_covariance[PSI, PSI])
    assert state.yaw_ratio == pytest.approx(ratio, rel=0.1)
    assert abs(state.kappa[1] - np.log(ratio)) < 3.0 * sigma
    assert sigma < 0.1
    # Forward scale is not learned from yaw.
    assert state.kappa[0] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_noise_of_the_heading_on_straight_ways_teaches_no_yaw_ratio(seed: int) -> None:
    rng = np.random.default_rng(seed)
    state = filter_at(Pose.identity())
    for _ in range(100):
        counted = np.deg2rad(2.0) * np.sqrt(0.1) * rng.standard_normal()
        state, _ = predict_displacement(state, CONFIG, arc_step(0.1, counted), 0.2)
        state = corrected_yaw(state, np.deg2rad(0.3) * rng.standard_normal(), np.deg2rad(0.3))
    sigma = np.sqrt(state.full_covariance[PSI, PSI])
    assert abs(state.kappa[1]) < 2.0 * sigma, (state.yaw_ratio, sigma)


def test_speed_is_not_that_of_a_burst_of_stamps() -> None:
    """A robot at 0.5 m/s, whose logger writes three poses within a millisecond after each stall."""
    state = filter_at(Pose.identity())
    speeds, step = [], arc_step(0.05, 0.02)
    for k in range(90):
        state, _ = predict_displacement(state, EXACT, step, 0.2992 if k % 3 == 0 else 0.0004)
        speeds.append(float(state.twist.linear[0]))
    assert max(speeds) < 1.1
    assert np.average(speeds[30:], weights=[0.2992, 0.0004, 0.0004] * 20) < 0.6
    for _ in range(20):
        state, _ = predict_displacement(state, EXACT, step, 0.1)
    assert state.twist.linear[0] == pytest.approx(0.5, rel=0.02)
    assert state.twist.angular[2] == pytest.approx(0.2, rel=0.02)


@given(STATE, STEP)
def test_pause_moves_the_robot_as_far_as_a_burst(state: FilterState, step: Pose) -> None:
    burst, _ = predict_displacement(state, CONFIG, step, 1e-4)
    pause, _ = predict_displacement(state, CONFIG, step, 3.0)
    assert difference(burst.pose, pause.pose) == pytest.approx(np.zeros(6), abs=1e-12)
    grown = np.diag(pause.full_covariance - burst.full_covariance)[:6]
    assert grown.max() < 1e-4


@pytest.mark.parametrize("seconds", [np.nan, np.inf])
def test_displacement_of_no_finite_duration_is_refused(seconds: float) -> None:
    with pytest.raises(InvalidReadingError, match="must be finite"):
        predict_displacement(filter_at(Pose.identity()), CONFIG, Pose.identity(), seconds)


GYRO = EkfConfig.of(SensorConfiguration(Motion.ODOMETRY_AND_GYRO))
EXACT_GYRO = replace(
    GYRO, odometry=EXACT.odometry, gyro_noise=1e-9, gyro_bias_walk=0.0, turn_share=0.0
)
"""Neither wheels nor gyro err, but for the gyro's bias."""


def measured(turn: FloatArray, seconds: float = 0.1, **more: object) -> GyroStep:
    return GyroStep(turn, seconds, np.array([0.0, 0.0, 9.81]), **more)  # type: ignore[arg-type]


@given(
    STATE, STEP, vectors(3, 0.05), vectors(STATES, 1.0).filter(lambda e: np.linalg.norm(e) > 0.1)
)
@settings(max_examples=60)
def test_covariance_of_a_turn_by_gyro_is_carried_by_the_slope_of_the_prediction(
    state: FilterState, step: Pose, turn: FloatArray, e: FloatArray
) -> None:
    h, gyro = 1e-6, measured(turn)
    alone = replace(state, full_covariance=np.outer(e, e))
    after, _ = predict_displacement(alone, EXACT_GYRO, step, 0.1, gyro)

    def moved(sign: float) -> FilterState:
        off = disturbed(state, sign * h * e)
        off = replace(off, gyro_bias=state.gyro_bias + sign * h * e[GYRO_BIAS])
        return predict_displacement(off, EXACT_GYRO, step, 0.1, gyro)[0]

    slope = (error_between(moved(-1.0), moved(1.0))) / (2.0 * h)
    slope[GYRO_BIAS] = e[GYRO_BIAS]
    # The turn of the bias is of first order in the turn itself, which is small between two readings.
    expected = np.outer(slope, slope)
    np.testing.assert_allclose(after.full_covariance, expected, atol=0.02 * float(e @ e))


@given(STEP, floats(-1.5, 1.5))
def test_gyro_turns_the_motion_and_wheels_give_its_length(step: Pose, turn: float) -> None:
    _, motion = predict_displacement(
        filter_at(Pose.identity()), GYRO, step, 0.1, measured(np.array([0.0, 0.0, turn]))
    )
    expected = with_turn(step, turn)
    assert motion.position == pytest.approx(expected.position, abs=1e-12)
    assert motion.yaw == pytest.approx(turn, abs=1e-12)


def test_yaw_ratio_is_learned_from_the_gyro_and_forward_scale_is_not() -> None:
    rng = np.random.default_rng(4)
    state, config = filter_at(Pose.identity(), config=GYRO), GYRO
    for k in range(80):
        true = 0.2 if (k // 10) % 2 == 0 else -0.2
        counted = 1.85 * true + config.odometry.heading * 0.3 * rng.standard_normal()
        gyro = measured(
            np.array([0.0, 0.0, true]), 0.5, witness=TurnWitness(counted, true, 0.5, 0.09)
        )
        state, _ = predict_displacement(state, config, arc_step(0.09, counted), 0.5, gyro)
    sigma = np.sqrt(state.full_covariance[PSI, PSI])
    assert state.yaw_ratio == pytest.approx(1.0 / 1.85, rel=0.1)
    assert abs(state.kappa[1] + np.log(1.85)) < 3.0 * sigma
    assert state.kappa[0] == 0.0


def test_bias_is_learned_while_neither_wheels_nor_gyro_move() -> None:
    bias = np.deg2rad([0.3, -0.2, 1.0])
    state = filter_at(Pose.identity(), config=GYRO)
    for _ in range(30):
        state, motion = predict_displacement(
            state, GYRO, Pose.identity(), 0.1, measured(0.1 * bias)
        )
    assert state.gyro_bias == pytest.approx(bias, abs=np.deg2rad(0.02))
    assert motion.yaw == 0.0
    assert state.standing(GYRO)


def test_reported_roll_and_pitch_are_taken_over() -> None:
    start = Pose.identity()
    state = with_pose(
        filter_at(start, config=GYRO), start, np.diag([0.01, 0.01, 0.01, 0.01, 0.01, 0.01])
    )
    gyro = measured(np.zeros(3), tilt=ReportedTilt(0.02, -0.1, 0.01))
    for _ in range(100):
        state, _ = predict_displacement(state, GYRO, arc_step(0.05, 0.0), 0.1, gyro)
    assert state.pose.euler[:2] == pytest.approx((0.02, -0.1), abs=0.004)


# Turns that the scanner observes

SURE, SURER = 0.2, np.deg2rad(0.3)
"""Errors of a yaw ratio and of an observed turn, one sigma."""


def with_ratio(ratio: float, heading: float = 0.05, common: float = 0.3) -> FilterState:
    """A filter that knows its ratio to ``SURE``, and whose heading [rad] goes with it."""
    state = with_pose(filter_at(Pose.identity(), ratio), Pose.identity(), np.eye(6) * heading**2)
    p = np.array(state.full_covariance)
    p[PSI, PSI] = SURE**2
    p[5, PSI] = p[PSI, 5] = common * heading * SURE
    return replace(state, full_covariance=p)


def test_observed_turn_corrects_heading_and_ratio_as_if_the_pose_before_it_were_a_state() -> None:
    """One turn on the spot: heading h, ratio psi, their covariance c; the turn's error is d psi and noise q."""
    before, turn = with_ratio(1.0), 0.5
    steady = replace(CONFIG, odometry=replace(CONFIG.odometry, yaw_ratio_walk=0.0))
    after, _ = predict_displacement(before, steady, Pose.planar(0.0, 0.0, turn), 0.1)
    seen = np.diag(np.square([0.01, 0.01, SURER]))
    updated = update_relative(
        after, before.pose, Pose.planar(0.0, 0.0, turn + 0.1), seen, np.zeros((0, 6))
    )
    q, d = float(after.accrued[5, 5]), float(after.by_ratio[5])
    assert d == pytest.approx(turn, rel=0.05)
    h, c = 0.05**2, 0.3 * 0.05 * SURE
    joint = np.array([[h + 2.0 * d * c + d * d * SURE**2 + q, c + d * SURE**2], [0.0, SURE**2]])
    joint[1, 0] = joint[0, 1]
    with_motion = np.array([c * d + d * d * SURE**2 + q, d * SURE**2])
    gain = with_motion / (d * d * SURE**2 + q + SURER**2)
    at = [5, PSI]
    assert np.array([updated.pose.yaw - turn, updated.kappa[1]]) == pytest.approx(0.1 * gain)
    left = updated.full_covariance[np.ix_(at, at)]
    assert left == pytest.approx(joint - np.outer(gain, with_motion), rel=1e-6)


def test_wheels_and_scanner_that_contradict_each_other_may_miss_way_and_turn_each_by_itself() -> (
    None
):
    before = filter_at(Pose.planar(3.0, 1.0, 0.7))
    after, _ = predict_displacement(before, CONFIG, Pose.planar(0.1, 0.0, 0.0), 0.2)
    rolled, seen = between(after, before.pose, Pose.planar(0.3, 0.1, 0.4))
    assert rolled.pose == after.pose
    assert difference(before.pose @ Pose.planar(0.3, 0.1, 0.4), seen.pose) == pytest.approx(
        np.zeros(6)
    )
    off = difference(rolled.pose, seen.pose)
    added = rolled.full_covariance[:6, :6] - after.full_covariance[:6, :6]
    assert added[:3, :3] == pytest.approx(np.outer(off[:3], off[:3]))
    assert added[3:, 3:] == pytest.approx(np.outer(off[3:], off[3:]))
    assert added[:3, 3:] == pytest.approx(np.zeros((3, 3)))


@pytest.mark.parametrize("turn", [-0.2, 0.2])
def test_ratio_that_is_surely_wrong_is_corrected_by_turns_that_the_scanner_observes(
    turn: float,
) -> None:
    state = with_ratio(1.6)
    for _ in range(10):
        then = state.pose
        state, _ = predict_displacement(state, CONFIG, Pose.planar(0.0, 0.0, turn), 0.2)
        seen = np.diag(np.square([0.01, 0.01, SURER]))
        state = mark(
            update_relative(state, then, Pose.planar(0.0, 0.0, turn), seen, np.zeros((0, 6)))
        )
    assert state.yaw_ratio == pytest.approx(1.0, abs=0.1)
    assert abs(state.kappa[1]) < 3.0 * float(state.full_covariance[PSI, PSI]) ** 0.5
