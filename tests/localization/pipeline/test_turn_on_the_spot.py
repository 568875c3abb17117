"""An ordinary turn on the spot is no slip; wheels that spin are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from localization.maps.cloud import Cloud
from localization.maps.prepared_map import prepare
from localization.pipeline.localizer import Localizer
from localization.types import SECOND, Estimate, Health, Hint, Twist, WheelSpeeds
from robot_sim import Simulation, SlipFault, World
from teleop.robot.serving.robot_options import RobotOptions, slip_bursts


def _drive(
    simulation: Simulation,
    localizer: Localizer,
    seconds: float,
    twist: Twist,
    *,
    spin: float = 1.0,
) -> list[Health]:
    """Drive, and return the states that were reported; the left wheels count ``spin`` times their way."""
    found: list[Health] = []
    for _ in range(round(seconds / 0.02)):
        simulation.command(twist)
        for reading in simulation.step():
            if isinstance(reading, WheelSpeeds) and spin != 1.0:
                left = float(np.float32(spin * reading.left))
                reading = WheelSpeeds(reading.stamp, left, reading.right)
            answer = localizer.add(reading)
            if isinstance(answer, Estimate):
                found.append(answer.health)
    return found


def _placed(
    world: World, cloud: Cloud, cache: Path, seed: int, slips: tuple[SlipFault, ...] = ()
) -> tuple[Simulation, Localizer]:
    """Return a robot that stands and knows its pose."""
    simulation = Simulation(world, seed=seed, config=RobotOptions().simulation(slips))
    localizer = Localizer(prepare(cloud, cache=cache), simulation.mounts)
    _drive(simulation, localizer, 0.5, Twist.planar(0.0, 0.0))
    localizer.add(Hint(simulation.stamp, simulation.truth().map_from_base, np.zeros((6, 6))))
    assert _drive(simulation, localizer, 1.5, Twist.planar(0.0, 0.0))[-1] is Health.TRACKING
    return simulation, localizer


@pytest.mark.slow
@pytest.mark.parametrize(("rate", "seed"), [(0.74, 0), (1.2, 2)])
def test_turn_on_the_spot_and_its_end_are_not_called_slip(
    rate: float, seed: int, office: World, office_cloud: Cloud, cache: Path
) -> None:
    simulation, localizer = _placed(office, office_cloud, cache, seed)
    for turn in (rate, -rate):
        states = _drive(simulation, localizer, 3.0, Twist.planar(0.0, turn))
        states += _drive(simulation, localizer, 1.5, Twist.planar(0.0, 0.0))
        assert set(states) == {Health.TRACKING}


@pytest.mark.slow
def test_wheels_that_spin_ahead_are_called_slip_within_two_tenths_of_a_second(
    office: World, office_cloud: Cloud, cache: Path
) -> None:
    simulation, localizer = _placed(office, office_cloud, cache, 0, slip_bursts((4.0,)))
    ahead = Twist.planar(0.5, 0.0)
    before = _drive(simulation, localizer, 3.9 - simulation.stamp / SECOND, ahead)
    assert set(before) == {Health.TRACKING}
    assert Health.SLIPPING in _drive(simulation, localizer, 0.3, ahead)


@pytest.mark.slow
def test_wheels_of_one_side_that_spin_in_a_turn_are_called_slip_at_once(
    office: World, office_cloud: Cloud, cache: Path
) -> None:
    simulation, localizer = _placed(office, office_cloud, cache, 0)
    turn = Twist.planar(0.0, 0.8)
    assert set(_drive(simulation, localizer, 2.0, turn)) == {Health.TRACKING}
    assert Health.SLIPPING in _drive(simulation, localizer, 0.04, turn, spin=2.0)
