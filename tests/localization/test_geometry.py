from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings

from localization import geometry
from localization.geometry import (
    FloatArray,
    euler_from_rotation,
    quaternion_exp,
    quaternion_from_rotation,
    quaternion_product,
    rotation_from_euler,
    rotation_from_quaternion,
    so3_exp,
    so3_log,
    wrap_angle,
)
from tests.support import floats, rotation_vectors, vectors

ANGLES_THAT_BREAK_FORMULAS = [0.0, 1e-300, 1e-16, 1e-12, 9e-9, 1.1e-8, 1e-6, 1e-3, 1.0, 3.0]
ANGLES_THAT_BREAK_FORMULAS += [np.pi - gap for gap in (1e-3, 1e-6, 1e-9, 1e-12, 1e-15)] + [np.pi]


def turn(axis: FloatArray, angle: float) -> FloatArray:
    return np.asarray(angle * axis / np.linalg.norm(axis))


@given(w=rotation_vectors())
def test_exp_is_a_rotation(w: FloatArray) -> None:
    r = so3_exp(w)
    assert r.T @ r == pytest.approx(np.eye(3), abs=1e-14)
    assert np.linalg.det(r) == pytest.approx(1.0)


@given(w=rotation_vectors(), s=floats(-1.0, 1.0), t=floats(-1.0, 1.0))
def test_turns_about_one_axis_add_up(w: FloatArray, s: float, t: float) -> None:
    assert so3_exp(s * w) @ so3_exp(t * w) == pytest.approx(so3_exp((s + t) * w), abs=1e-14)


@pytest.mark.parametrize("angle", ANGLES_THAT_BREAK_FORMULAS)
@given(axis=vectors(3, 1.0).filter(lambda v: np.linalg.norm(v) > 0.1))
@settings(max_examples=20)
def test_log_undoes_exp(axis: FloatArray, angle: float) -> None:
    w = turn(axis, angle)
    again = so3_log(so3_exp(w))
    if angle > np.pi - 1e-7:  # either way round is right
        again = again if again @ w > 0.0 else -again
    assert again == pytest.approx(w, abs=2e-15 if angle < 1e-6 else 1e-7)
    assert so3_exp(again) == pytest.approx(so3_exp(w), abs=1e-14)


@given(w=rotation_vectors())
def test_log_is_no_longer_than_half_a_turn(w: FloatArray) -> None:
    assert np.linalg.norm(so3_log(so3_exp(3.0 * w))) <= np.pi + 1e-12


@given(u=vectors(3), v=vectors(3))
def test_hat_is_the_cross_product(u: FloatArray, v: FloatArray) -> None:
    assert geometry.hat(u) @ v == pytest.approx(np.cross(u, v), abs=1e-9)


@given(q=vectors(4, 1.0).filter(lambda q: np.linalg.norm(q) > 0.1))
def test_quaternion_survives_the_matrix_but_for_its_sign(q: FloatArray) -> None:
    q = q / np.linalg.norm(q)
    again = quaternion_from_rotation(rotation_from_quaternion(q))
    assert again[0] >= 0.0
    assert again @ again == pytest.approx(1.0, abs=1e-15)
    assert again == pytest.approx(q if again @ q > 0.0 else -q, abs=1e-14)


@given(a=rotation_vectors(), b=rotation_vectors())
def test_quaternions_of_plain_floats_turn_as_the_matrices_do(a: FloatArray, b: FloatArray) -> None:
    x, y = quaternion_exp(*a.tolist()), quaternion_exp(*b.tolist())
    assert rotation_from_quaternion(x) == pytest.approx(so3_exp(a), abs=1e-14)
    both = quaternion_product(x, y)
    assert both[0] >= 0.0
    assert rotation_from_quaternion(both) == pytest.approx(so3_exp(a) @ so3_exp(b), abs=1e-14)


@pytest.mark.parametrize("angle", ANGLES_THAT_BREAK_FORMULAS)
def test_quaternion_of_any_angle_is_a_unit(angle: float) -> None:
    w, x, y, z = quaternion_exp(0.6 * angle, 0.0, -0.8 * angle)
    assert w * w + x * x + y * y + z * z == pytest.approx(1.0, abs=1e-15)
    assert 2.0 * np.arctan2(np.hypot(x, z), w) == pytest.approx(angle, rel=1e-12)


@pytest.mark.parametrize("axis", np.eye(3))
def test_half_turns_have_their_quaternions(axis: FloatArray) -> None:
    r = 2.0 * np.outer(axis, axis) - np.eye(3)
    assert np.abs(quaternion_from_rotation(r)) == pytest.approx(np.array([0.0, *axis]))


@given(roll=floats(-3.1, 3.1), pitch=floats(-1.5, 1.5), yaw=floats(-3.1, 3.1))
def test_euler_angles_survive_the_matrix(roll: float, pitch: float, yaw: float) -> None:
    again = euler_from_rotation(rotation_from_euler(roll, pitch, yaw))
    assert again == pytest.approx((roll, pitch, yaw), abs=1e-12)


def test_euler_angles_turn_as_rep_103_says() -> None:
    quarter = np.pi / 2
    x, y, z = np.eye(3)
    assert rotation_from_euler(0.0, 0.0, quarter) @ x == pytest.approx(y, abs=1e-15)
    assert rotation_from_euler(0.0, quarter, 0.0) @ x == pytest.approx(-z, abs=1e-15)
    assert rotation_from_euler(quarter, 0.0, 0.0) @ y == pytest.approx(z, abs=1e-15)
    together = rotation_from_euler(0.1, 0.2, 0.3)
    parts = so3_exp(0.3 * z) @ so3_exp(0.2 * y) @ so3_exp(0.1 * x)
    assert together == pytest.approx(parts, abs=1e-15)


@given(angle=floats(-100.0, 100.0))
def test_wrapped_angle_is_the_same_direction(angle: float) -> None:
    wrapped = wrap_angle(angle)
    assert -np.pi <= wrapped < np.pi
    assert np.exp(1j * wrapped) == pytest.approx(np.exp(1j * angle), abs=1e-12)


def test_half_a_turn_wraps_to_the_negative_side() -> None:
    assert wrap_angle(np.pi) == -np.pi
    assert wrap_angle(-np.pi) == -np.pi
