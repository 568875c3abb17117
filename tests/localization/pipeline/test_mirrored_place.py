"""A map with holes, in which the mirrored place explains more than the true one does."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from localization.motion.sensor_configuration import Motion, SensorConfiguration
from localization.pipeline.localizer import Localizer, LocalizerConfig
from localization.types import Estimate, Hint, Pose
from tests.localization.pipeline.wheel_log import block, noting, upright
from tests.support_rooms import MOUNTS, Drive, Face, Place, box, by_odometry

pytestmark = pytest.mark.slow

SCANNER = "laser_horizontal"
START = Pose.planar(-1.5, -1.4, 0.0)
ORDERS = (
    (2.0, 0.0, 0.0),
    (6.0, 0.5, 0.0),
    (1.3, 0.0, 0.6),
    (3.96, 0.5, 0.0),
    (1.3, 0.0, -0.6),
    (4.6, 0.5, 0.0),
    (2.0, 0.0, 0.4),
    (4.0, 0.0, -0.4),
    (2.0, 0.2, 0.4),
    (3.0, 0.2, 0.4),
)
"""Through the hall of a table into the eastern room, and about in it."""


def reflected(face: Face) -> Face:
    """The point reflection of a wall about the middle of the table, where the origin is."""
    (a, b), (c, d) = face.low, face.high
    return Face(face.axis, -face.at, -face.facing, (-c, b), (-a, d))


EAST = [
    *block((6.0, -3.0), (7.0, -2.3)),
    *block((5.0, 2.4), (5.6, 3.0)),
    *block((3.5, -3.0), (3.6, -0.7)),
    *block((3.5, 0.7), (3.6, 3.0)),
]
"""Furniture of the eastern room, and the wall between it and the hall, with a door."""
HALL = [*block((-0.8, -0.4), (0.8, 0.4)), *block((-2.4, 2.3), (-1.2, 3.0))]
"""The table in the hall, and a cupboard that the western end of it alone has."""
OUTER = upright(box((-8.0, -3.0, -1.0), (8.0, 3.0, 2.5), inside=True))
BUILDING = Place([*OUTER, *EAST, *map(reflected, EAST), *HALL])
"""Two rooms on both sides of a hall; the western one is the point reflection of the eastern one."""


def surveyed() -> Place:
    """What the map has: of the eastern room half of the walls, and a box that was taken away since."""
    kept = []
    for face in BUILDING.faces:
        if face in OUTER and face.axis == 1 and face.at > 0.0:
            kept.append(Face(1, face.at, face.facing, face.low, (5.6, face.high[1])))
        elif face in OUTER and face.axis == 0 and face.at > 0.0:
            kept.append(Face(0, face.at, face.facing, face.low, (-0.4, face.high[1])))
        else:
            kept.append(face)
    return Place([*kept, *block((6.4, -1.1), (7.0, 0.9))])


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Driven:
    """The estimates of a drive, and their errors."""

    estimates: list[Estimate]
    off: np.ndarray
    fit: np.ndarray
    searched: int


def driven(motion: Motion) -> Driven:
    drive = Drive(BUILDING, START, *ORDERS, noise=0.01, seed=2, scanners=(SCANNER,))
    stages: list[str] = []
    mounts = {SCANNER: MOUNTS[SCANNER]}
    suite = SensorConfiguration(motion, flat=True)
    localizer = Localizer(
        surveyed().prepared(), mounts, LocalizerConfig.of(suite), stage=noting(stages)
    )
    estimates, off, fit, begun = [], [], [], 0
    readings = drive.readings() if motion is Motion.WHEELS_AND_GYRO else by_odometry(drive)
    for i, reading in enumerate(readings):
        estimate = localizer.add(reading)
        if i == 50:
            localizer.add(
                Hint(reading.stamp, START @ Pose.planar(0.1, 0.1, 0.05), np.zeros((6, 6)))
            )
        if estimate.map_from_base is None or estimate.match is None:
            continue
        begun = begun or len(stages)
        error = drive.pose(estimate.stamp).inverse() @ estimate.map_from_base
        estimates.append(estimate)
        off.append(np.hypot(*error.position[:2]))
        fit.append(estimate.match.inlier_ratio)
    return Driven(estimates, np.array(off), np.array(fit), stages[begun:].count("search"))


@pytest.mark.long
@pytest.mark.parametrize("motion", [Motion.WHEELS_AND_GYRO, Motion.ODOMETRY])
def test_pose_that_all_witnesses_agree_on_is_not_replaced_by_its_mirror_image(
    motion: Motion,
) -> None:
    run = driven(motion)
    assert len(run.off) > 200
    # The map explains little of what is seen in the eastern room; its mirror image would explain nearly all.
    assert np.median(run.fit[run.off < 0.1][-100:]) < 0.75
    jumps = np.abs(np.diff(run.off)).max()
    assert jumps < 0.3, f"jumped by {jumps:.1f} m"
    assert run.off.max() < 0.10
