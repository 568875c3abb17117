"""The robot's physics against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from localization.types import Twist
from robot_sim.robot.p3at import MOUNTS, P3AT
from robot_sim.robot.skid_steer_parameters import REFERENCE_HALF_WIDTH, REFERENCE_HULL
from robot_sim.sensors.imu import InertialConfig
from robot_sim.simulation import Simulation, SimulationConfig
from robot_sim.worlds.world import World

QUIET = SimulationConfig(
    inertial=InertialConfig(
        gyro_noise=0.0, gyro_bias_sigma=0.0, force_noise=0.0, force_bias_sigma=0.0
    ),
    scanners=(),
)


def wheel_rates(simulation: Simulation) -> np.ndarray:
    """Return the rates of the four wheels [rad/s], left and right in turn."""
    return np.array([simulation._data.joint(w).qvel[0] for w in
                     ("front_left", "front_right", "rear_left", "rear_right")])  # fmt: skip


@pytest.mark.parametrize("turn", [0.1, 2.4])
def test_turning_in_place_slips_by_the_closed_form_at_any_speed(field: World, turn: float) -> None:
    simulation = Simulation(field, config=QUIET)
    simulation.command(Twist.planar(0.0, turn))
    ratios, rates, contacts = [], [], []
    for tick in range(200):
        simulation.step()
        contacts.append(simulation._data.ncon)
        if tick >= 100:
            rate = simulation.truth().twist.angular[2]
            left, right = wheel_rates(simulation).reshape(2, 2).mean(axis=0)
            rates.append(rate)
            ratios.append((right - left) * P3AT().rolling_radius / P3AT().track / rate)
    closed_form = 1.0 + (0.269 / 0.394) ** 2
    assert np.mean(ratios) == pytest.approx(closed_form, rel=0.03)
    assert np.std(rates) < 0.01 * turn
    assert np.mean(rates) == pytest.approx(turn, rel=0.02)
    assert np.hypot(*simulation.truth().map_from_base.position[:2]) < 0.01
    assert min(contacts) == 8


def test_hull_never_touches_the_floor(field: World) -> None:
    simulation = Simulation(field, config=QUIET)
    for forward, turn in ((0.7, 0.0), (0.0, 0.0), (-0.7, 1.0), (0.0, -2.0)):
        simulation.command(Twist.planar(forward, turn))
        for _ in range(80):
            simulation.step()
            assert simulation._data.ncon == 8


def test_vertical_scanner_sweeps_through_the_zenith_across_the_robot() -> None:
    rotation = MOUNTS["laser_vertical"].rotation
    np.testing.assert_allclose(rotation @ [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], atol=1e-12)
    assert abs((rotation @ [0.0, 0.0, 1.0])[0]) == pytest.approx(1.0)


def test_what_other_platforms_are_scaled_by_is_the_p3at_s_own() -> None:
    robot = P3AT()
    assert robot.length_scale == 1.0
    assert robot.inner_half_width == pytest.approx(REFERENCE_HALF_WIDTH, abs=1e-12)
    assert robot.height - robot.clearance == pytest.approx(REFERENCE_HULL, abs=1e-12)
