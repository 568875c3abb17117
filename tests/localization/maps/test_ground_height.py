from __future__ import annotations

import numpy as np
import pytest

from localization.geometry import FloatArray
from localization.maps.cloud import Cloud
from localization.maps.ground_height import Ground, ground_of
from localization.maps.prepared_map import PreparedMap, prepare
from localization.relocalization.floor_plan import FloorPlan
from localization.types import Hint, Pose, Sweep, Verdict
from tests.localization.relocalization.driven_search import DrivenSearch
from tests.support_rooms import CORRIDOR, HALL, SQUARE, Place, box

RISE = 0.4
"""How high the platform is [m]."""
RAMP = (4.0, 8.0)
"""Where the ramp begins and ends [m]."""
SLOPE = RISE / (RAMP[1] - RAMP[0])

# A yard of 14 m x 7 m whose east is a platform; its ramp is 2 m wide and cannot be seen by rays.
YARD = Place(
    [
        *box((0.0, 0.0, 0.0), (14.0, 7.0, 4.0), inside=True),
        *box((8.0, 0.0, 0.0), (14.0, 7.0, RISE)),
        # On the floor, on the platform, and a table that can be driven under.
        *box((1.0, 5.0, 0.0), (2.0, 6.0, 1.5)),
        *box((12.0, 1.0, RISE), (12.6, 2.0, 2.0)),
        *box((9.0, 5.5, RISE), (10.5, 6.0, 2.0)),
        *box((3.0, 4.0, 1.2), (4.5, 6.5, 1.3)),
    ]
)


def yard_cloud() -> Cloud:
    cloud = YARD.cloud()
    u, v = np.meshgrid(np.arange(*RAMP, 0.08), np.arange(0.5, 2.5, 0.08))
    ramp = np.column_stack([u.ravel(), v.ravel(), SLOPE * (u.ravel() - RAMP[0])])
    normal = np.array([-SLOPE, 0.0, 1.0]) / np.hypot(SLOPE, 1.0)
    # What the ramp and the platform hide, nobody has mapped.
    x, y, z = cloud.points.T
    hidden = (z < 0.01) & ((x > RAMP[1]) | ((x > RAMP[0]) & (y > 0.5) & (y < 2.5)))
    points = np.concatenate([cloud.points[~hidden], ramp])
    normals = np.concatenate([cloud.normals[~hidden], np.tile(normal, (len(ramp), 1))])
    return Cloud(points, normals, name="yard")


@pytest.fixture(scope="module")
def yard() -> PreparedMap:
    return prepare(yard_cloud())


def height(ground: Ground, *places: tuple[float, float]) -> FloatArray:
    return ground.heights(np.array(places))


@pytest.mark.parametrize("place", [HALL, SQUARE, CORRIDOR])
def test_level_floor_with_furniture_on_it_is_level(place: Place) -> None:
    ground = ground_of(place.cloud())
    assert ground.level
    assert height(ground, (0.3, 1.5), (50.0, -3.0)).tolist() == [0.0, 0.0]


def test_cloud_without_a_floor_has_no_ground() -> None:
    walls = HALL.cloud()
    upright = np.abs(walls.normals[:, 2]) < 0.5
    ground = ground_of(Cloud(walls.points[upright], walls.normals[upright], name="walls"))
    assert ground.level
    assert not ground.seen


def test_floor_at_another_height_than_zero_is_found() -> None:
    hall = HALL.cloud()
    lowered = Cloud(hall.points - [0.0, 0.0, 0.7], hall.normals, name="from the scanner")
    ground = ground_of(lowered)
    assert not ground.level
    assert height(ground, (4.0, 3.0), (0.3, 1.5)) == pytest.approx([-0.7, -0.7], abs=0.01)


def test_platform_and_ramp_have_their_heights(yard: PreparedMap) -> None:
    heights = height(yard.ground, (2.0, 2.0), (6.0, 1.5), (11.0, 4.0))
    assert heights[[0, 2]] == pytest.approx([0.0, RISE], abs=0.005)
    assert heights[1] == pytest.approx(SLOPE * 2.0, abs=SLOPE * 0.15 + 0.01)


def test_ground_is_under_the_table_and_beside_the_cupboards(yard: PreparedMap) -> None:
    heights = height(yard.ground, (3.7, 5.0), (1.5, 5.5), (9.7, 5.8), (12.3, 1.5))
    assert heights == pytest.approx([0.0, 0.0, RISE, RISE], abs=0.005)


def test_robot_on_a_ramp_is_tilted_like_it(yard: PreparedMap) -> None:
    for yaw in (0.0, 0.7, np.pi / 2, -2.0):
        stands = yard.ground.stand(6.0, 1.5, yaw)
        assert stands.position == pytest.approx([6.0, 1.5, SLOPE * 2.0], abs=0.015)
        # Uphill, the nose is up; across, the robot rolls.
        up = stands.rotation[:, 2]
        assert up == pytest.approx(np.array([-SLOPE, 0.0, 1.0]) / np.hypot(SLOPE, 1.0), abs=0.015)
        assert stands.yaw == pytest.approx(yaw, abs=1e-9)


def answer_of(
    world: PreparedMap, sweep: Sweep, at: Pose, *, everywhere: bool = False
) -> tuple[Verdict | None, Pose]:
    """Hint level and at height zero, half a metre off; or search the whole map."""
    search = DrivenSearch(world, FloorPlan(world, 0.35, cell=0.05, sigma=0.12))
    if everywhere:
        search.search_map(sweep, Pose.identity(), Pose.identity())
    else:
        x, y, _ = at.position.tolist()
        hint = Hint(0, Pose.planar(x + 0.4, y - 0.3, at.yaw + 0.15), np.zeros((6, 6)))
        search.receive(hint, 0, Pose.identity())
        search.begin(sweep, Pose.identity(), Pose.identity())
    for _ in range(10_000):
        found = search.advance(Pose.identity(), None)
        if found is not None:
            return found.verdict, found.candidates[0].map_from_base
    raise AssertionError("the search does not end")


@pytest.mark.parametrize("everywhere", [False, True])
@pytest.mark.parametrize("place", [(10.5, 3.0, 0.4), (2.5, 3.0, -1.0), (13.0, 3.5, 2.6)])
def test_robot_is_found_at_the_height_of_its_ground(
    yard: PreparedMap, place: tuple[float, float, float], everywhere: bool
) -> None:
    x, y, yaw = place
    true = Pose.from_euler([x, y, RISE if x > RAMP[1] else 0.0], yaw=yaw)
    sweep = YARD.sweep(true, noise=0.01, seed=1)
    verdict, found = answer_of(yard, sweep, true, everywhere=everywhere)
    assert verdict is (None if everywhere else Verdict.ACCEPTED)
    assert found.position == pytest.approx(true.position, abs=0.03)
    assert found.rotation[2, 2] > np.cos(np.deg2rad(0.5))
