"""Clean plans, drawn with lines: walls one cell thick, free space on both sides of them."""

from __future__ import annotations

import numpy as np
import pytest

from localization.maps.cloud_from_grid import cloud_from_grid
from localization.maps.prepared_map import PreparedMap, prepare
from localization.types import Pose
from tests.localization.pipeline.wheel_log import (
    BEGIN,
    TRUSTED,
    Wheels,
    follow,
    moments,
    summary,
    upright,
)
from tests.support_rooms import Drive, Face, Place, box

pytestmark = [pytest.mark.slow, pytest.mark.long]

HEIGHTS = (-1.0, 2.5)


def screen(axis: int, at: float, low: float, high: float) -> list[Face]:
    """A wall without thickness that is seen from both sides."""
    ends = (low, HEIGHTS[0]), (high, HEIGHTS[1])
    return [Face(axis, at, facing, *ends) for facing in (-1.0, 1.0)]


ROOM = Place(
    [
        *upright(box((0.0, 0.0, HEIGHTS[0]), (12.0, 9.0, HEIGHTS[1]), inside=True)),
        *screen(0, 3.5, 2.0, 6.0),
        *screen(1, 5.5, 6.0, 9.5),
    ]
)
"""A room of 12 m x 9 m with two screens, round which a robot drives."""
ROUND = Drive(
    ROOM,
    Pose.planar(5.0, 1.2, 0.3),
    (1.0, 0.0, 0.0), (10.0, 0.5, 0.0), (4.5, 0.5, 0.5), (8.0, 0.5, 0.0), (3.0, 0.5, 0.5), (6.0, 0.5, 0.0),
    begin=BEGIN,
)  # fmt: skip


def drawn(place: Place, cell: float, slant: float) -> PreparedMap:
    """The plan of a place, its lines one cell wide, at an angle [rad] to the rows of the grid."""
    turned, margin = Pose.planar(0.0, 0.0, -slant), 1.0
    lines = []
    for face in place.faces:
        along = np.arange(face.low[0], face.high[0], 0.2 * cell)
        line = np.zeros((len(along), 3))
        line[:, face.axis], line[:, face.others[0]] = face.at, along
        lines.append(turned.apply(line)[:, :2])
    at = np.concatenate(lines)
    low = np.floor(at.min(axis=0) / cell) * cell - margin
    column, row = np.floor((at - low) / cell).astype(int).T
    beyond = round(margin / cell)
    occupied = np.zeros((row.max() + beyond, column.max() + beyond), dtype=bool)
    occupied[row, column] = True
    corner = turned.inverse().apply(np.array([[*low, 0.0]]))[0]
    origin = Pose.planar(float(corner[0]), float(corner[1]), slant)
    return prepare(cloud_from_grid(occupied, ~occupied, cell, origin, name="plan"))


@pytest.mark.parametrize(("cell", "slant"), [(0.02, 0.0), (0.1, 0.0), (0.05, 0.37)])
def test_robot_is_tracked_in_a_plan_whose_walls_are_lines(cell: float, slant: float) -> None:
    log = moments(ROOM, ROUND, Wheels(), scan_every=5)
    followed = follow(drawn(ROOM, cell, slant), ROUND, log, hint=Pose.identity())
    assert len(followed.off) > 0.9 * len(log) / 5, summary(followed)
    assert followed.off.max() < cell + 0.05, summary(followed)
    assert followed.share(*TRUSTED) > 0.95, summary(followed)
    assert followed.searched == 0, summary(followed)
