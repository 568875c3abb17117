"""A robot that seems to have left the map has left it, or was never where it is believed to be."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from localization.maps.prepared_map import PreparedMap
from localization.pipeline.localizer import Localizer
from localization.types import SECOND, Health, Hint, Pose
from tests.localization.pipeline.wheel_log import block
from tests.support_rooms import MOUNTS, Drive, Face, Place, box

pytestmark = [pytest.mark.slow, pytest.mark.untraced]


def end_of_room(x: float, facing: float, width: float) -> list[Face]:
    """A wall across x with a door of a metre in its middle."""
    low = Face(0, x, facing, (-width, 0.0), (-0.5, 2.5))
    return [low, Face(0, x, facing, (0.5, 0.0), (width, 2.5))]


ROOM = [
    *(f for f in box((0.0, -3.0, 0.0), (6.0, 3.0, 2.5), inside=True) if f.axis != 0),
    *end_of_room(0.0, 1.0, 3.0),
    *end_of_room(6.0, -1.0, 3.0),
]
"""A room that looks the same from both of its ends, each with a door."""
EAST = [
    *(f for f in box((6.0, -1.0, 0.0), (22.0, 1.0, 2.5), inside=True) if f.axis != 0),
    *end_of_room(6.0, 1.0, 1.0),
    Face(0, 22.0, -1.0, (-1.0, 0.0), (1.0, 2.5)),
    *block((9.0, 0.6), (10.0, 1.0)),
    *block((13.0, -1.0), (13.4, -0.5)),
    *block((17.0, 0.5), (18.5, 1.0)),
]
"""Behind one door a corridor ..."""
WEST = [
    *(f for f in box((-14.0, -4.0, 0.0), (0.0, 5.0, 2.5), inside=True) if f.axis != 0),
    *end_of_room(0.0, -1.0, 5.0),
    Face(0, -14.0, 1.0, (-4.0, 0.0), (5.0, 2.5)),
    *block((-6.0, 1.0), (-4.0, 2.0)),
]
"""... and behind the other a hall that nobody mapped."""
PLACE = Place([*ROOM, *EAST, *WEST])
START = Pose.planar(3.0, 0.0, np.pi)
OUT = ((1.0, 0.0, 0.0), (24.0, 0.6, 0.0))
"""Orders that lead out of the door ahead."""


@dataclass(frozen=True, slots=True)
class Instant:
    """What an estimate said, and how wrong it was."""

    health: Health
    reasons: str
    off: float


@pytest.fixture(scope="module")
def world() -> PreparedMap:
    return Place([*ROOM, *EAST]).prepared()


def driven(world: PreparedMap, *, carried: bool) -> list[Instant]:
    """Drive round in the room, and out of it; between, the robot may be carried to where all looks the same."""
    round_ = Drive(PLACE, START, (1.0, 0.0, 0.0), (4.0 * np.pi, 0.5, 0.5), (1.0, 0.0, 0.0))
    here = round_.pose(round_.end)
    x, y, yaw = float(here.position[0]), float(here.position[1]), here.yaw
    there = Pose.planar(6.0 - x, -y, yaw + np.pi) if carried else here
    out = Drive(PLACE, there, *OUT, begin=round_.end)
    localizer = Localizer(world, MOUNTS)
    localizer.add(Hint(0, START, np.zeros((6, 6))))
    instants = []
    for drive in (round_, out):
        for reading in drive.readings():
            e = localizer.add(reading)
            if e.map_from_base is not None:
                off = e.map_from_base.position - drive.pose(e.stamp).position
                instants.append(Instant(e.health, "; ".join(e.reasons), float(np.hypot(*off[:2]))))
    return instants


def test_robot_that_was_never_there_finds_itself_where_all_is_mapped(world: PreparedMap) -> None:
    run = driven(world, carried=True)
    wrong = [i for i in run if i.off > 1.0]
    assert any("has left the map" in i.reasons for i in wrong)
    assert run[-1].off < 0.1
    assert run[-1].health in (Health.TRACKING, Health.DEGRADED)


def test_robot_that_drove_out_of_the_map_stays_where_its_motion_led_it(world: PreparedMap) -> None:
    run = driven(world, carried=False)
    outside = [i for i in run if "has left the map" in i.reasons]
    assert len(outside) > 10 * SECOND // 20_000_000
    assert max(i.off for i in run) < 0.3
