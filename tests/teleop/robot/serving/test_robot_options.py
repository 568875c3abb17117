from __future__ import annotations

import re
from pathlib import Path

import pytest
import tyro

from robot_sim import P3AT, SensorError, SimulationConfig
from robot_sim.robot.imperfections import MANDOW_2007
from robot_sim.sensors.imu_models import INERTIAL_UNITS
from robot_sim.sensors.lidar_models import LIDARS
from teleop.robot.serving.robot_options import RobotOptions


@pytest.mark.slow
def test_plain_outfit_is_the_plain_robot_in_the_plain_world() -> None:
    assert RobotOptions().simulation() == SimulationConfig()
    world = RobotOptions().world("office")
    assert world.movers == ()
    assert world.robot == P3AT()


def test_sensors_are_fitted_by_name() -> None:
    config = RobotOptions(
        scanner="hokuyo_utm30lx", inertial="bosch_bmi088", effects=True
    ).simulation()
    assert {s.name for s in config.scanners} == {"laser_horizontal", "laser_vertical"}
    assert all(s.range_max == 30.0 and s.effects.optical for s in config.scanners)


def test_help_names_every_model(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        tyro.cli(RobotOptions, args=["--help"])
    words = set(re.findall(r"\w+", capsys.readouterr().out))
    assert {*LIDARS, *INERTIAL_UNITS} <= words


def test_unknown_sensors_are_refused_with_those_there_are() -> None:
    with pytest.raises(SensorError, match="sick_lms111"):
        RobotOptions(scanner="velodyne").simulation()
    with pytest.raises(SensorError, match="bosch_bmi088"):
        RobotOptions(inertial="?").simulation()


def test_day_and_tyres_are_built_into_the_world() -> None:
    plain, other = (
        RobotOptions().world("office"),
        RobotOptions(alive=True, rearranged=3, uneven_tyres=True),
    )
    world = other.world("office", seed=5)
    assert len(world.movers) > 3
    assert world.robot.imperfections == MANDOW_2007
    assert world.plan is not None
    assert plain.plan is not None
    assert world.plan.furniture != plain.plan.furniture


def test_world_without_anything_to_move_says_so(tmp_path: Path) -> None:
    path = tmp_path / "hall.toml"
    path.write_text("bounds = [0, 0, 9, 9]\nspawn = [2, 2, 0]\ntour = [[2, 2], [7, 2], [7, 7]]\n")
    alive, rearranged = RobotOptions(alive=True, rearranged=1).world(str(path)).notes
    assert alive == "alive: the plan has no people, carts or doors, so nothing moves"
    assert rearranged.startswith("rearranged: no furniture of the plan can be moved")
    assert RobotOptions(alive=True, rearranged=1).world("office").notes == ()
