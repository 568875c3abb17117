"""A robot on wheels stays on the ground, whatever a sweep fits there."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest

from localization.config import LocalizerConfig
from localization.filter.ekf import mark
from localization.filter.updates import widen
from localization.maps.cloud import Cloud
from localization.maps.prepared_map import PreparedMap, prepare
from localization.pipeline.registration_cache import SweepRecord
from localization.pipeline.resources import Resources
from localization.pipeline.state import LastSweep, State
from localization.pipeline.sweep_update import Registration, corrected_by_sweep
from localization.types import SECOND, Pose
from tests.support_rooms import HALL, MOUNTS, Place, box

HERE = Pose.planar(3.5, 2.4, 0.2)


def legs(count: int = 20, away: float = 0.9) -> Place:
    """The hall with people's legs all around the robot."""
    faces = list(HALL.faces)
    for angle in np.arange(count) * 2.0 * np.pi / count + 0.1:
        x, y = HERE.position[:2] + away * np.array([np.cos(angle), np.sin(angle)])
        faces += box((x - 0.12, y - 0.12, 0.0), (x + 0.12, y + 0.12, 1.7))
    return Place(faces)


def after_sweep(
    world: PreparedMap, place: Place, believed: Pose, true: Pose = HERE
) -> tuple[State, Registration]:
    """What becomes of a robot whose height is believed to be known to a decimetre, by a sweep at a pose."""
    config = LocalizerConfig(kiss_odometry=False)
    state = State.initial(MOUNTS, config)
    filter_ = widen(replace(state.filter, pose=believed), 0.05, 0.05, 0.1, np.deg2rad(2.0))
    last = LastSweep(map_from_base=believed)
    state = state._replace(filter=mark(filter_), placed=True, last=last)
    sweep = place.sweep(true, noise=0.01, stamp=SECOND // 10)
    resources = Resources(world, MOUNTS, config, stage=lambda _: nullcontext())
    return corrected_by_sweep(state, SweepRecord((), Pose.identity(), sweep), resources)


@pytest.mark.parametrize("height", [-0.14, 0.0])
def test_robot_among_people_is_not_placed_below_the_floor_that_their_legs_would_fit(
    height: float,
) -> None:
    after, registration = after_sweep(
        HALL.prepared(), legs(), HERE @ Pose.from_euler([0.0, 0.0, height])
    )
    assert abs(after.filter.pose.position[2]) < 0.05
    match = registration.match
    assert match is not None
    assert abs(match.map_from_base.position[2]) < 0.1


def test_without_a_mapped_floor_a_sweep_may_move_the_robot_up_or_down() -> None:
    cloud = HALL.cloud()
    kept = (np.abs(cloud.normals[:, 2]) < 0.5) | (cloud.normals[:, 2] < -0.5)
    open_below = prepare(Cloud(cloud.points[kept], cloud.normals[kept], name="no floor"))
    after, _ = after_sweep(open_below, HALL, HERE @ Pose.from_euler([0.0, 0.0, 0.25]))
    assert after.filter.pose.position[2] == pytest.approx(0.0, abs=0.02)


def test_robot_believed_far_from_the_ground_is_brought_back_to_it_by_a_sweep() -> None:
    after, _ = after_sweep(HALL.prepared(), HALL, HERE @ Pose.from_euler([0.0, 0.0, -0.25]))
    assert after.filter.pose.position[2] == pytest.approx(0.0, abs=0.02)


def test_robot_climbs_a_ramp_that_the_map_does_not_show() -> None:
    before, true = (HERE @ Pose.from_euler([0.0, 0.0, height]) for height in (0.147, 0.16))
    after, registration = after_sweep(HALL.prepared(), HALL, before, true)
    assert after.filter.pose.position[2] == pytest.approx(0.16, abs=0.004)
    assert registration.refusal is None
