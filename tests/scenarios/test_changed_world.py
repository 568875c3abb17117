"""A place that differs from its map: changes are reported, and do not move the pose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pytest

from benchmarks.localization.lost import FLAGGED, KINDS, lost_trials
from benchmarks.replay.recordings import record
from localization.maps.cloud import Cloud
from localization.maps.prepared_map import PreparedMap, prepare
from localization.pipeline.localizer import Localizer
from localization.types import SECOND, Estimate, Pose
from robot_sim import World, WorldOptions
from robot_sim.worlds.loading import parse_world
from teleop.world_building.station_survey import StationConfig, survey_from_stations

pytestmark = pytest.mark.slow

FAR = 0.25
"""Position error beyond which a pose is useless for driving [m]."""

OPEN_DOOR, CLOSED_DOOR = "doors = [{ at = 2.5, width = 1.4 }]", ""
INTO_THE_ROOM = "[[1.5, 2.5], [8.6, 2.5], [8.6, 3.2], [8.4, 2.5], [2.5, 2.5]]"
IN_THE_HALL = "[[1.5, 2.5], [4.6, 2.5], [4.6, 3.4]]"
PLAN = """
bounds = [0.0, 0.0, 11.0, 5.0]
height = 2.5
spawn = [1.5, 2.5, 0.0]
tour = {tour}
survey = [[1.5, 2.5], [4.6, 2.5], [4.6, 4.2], [4.6, 2.5], [8.6, 2.5], [9.8, 4.0]]
[[wall]]
name = "south"
from = [0.0, 0.0]
to = [11.0, 0.0]
[[wall]]
name = "east"
from = [11.0, 0.0]
to = [11.0, 5.0]
[[wall]]
name = "north"
from = [11.0, 5.0]
to = [0.0, 5.0]
[[wall]]
name = "west"
from = [0.0, 5.0]
to = [0.0, 0.0]
[[wall]]
name = "between"
from = [6.2, 0.0]
to = [6.2, 5.0]
{door}
[[furniture]]
type = "cabinet"
at = [3.0, 4.6]
[[furniture]]
type = "counter"
at = [4.2, 0.5]
size = [1.8, 0.6, 1.1]
[[furniture]]
type = "pillar"
at = [0.9, 4.2]
[[furniture]]
type = "cabinet"
at = [10.5, 1.2]
yaw = 90
[[furniture]]
type = "plant"
at = [7.0, 4.5]
[[person]]
name = "ada"
path = [[2.6, 1.4], [5.2, 1.4], [5.2, 3.7], [2.6, 3.7]]
loop = true
[[person]]
name = "bob"
path = [[5.4, 4.2], [3.8, 4.0], [5.6, 1.5]]
loop = true
"""


def place(*, tour: str = IN_THE_HALL, door: str = OPEN_DOOR, options: WorldOptions) -> World:
    return parse_world(PLAN.format(tour=tour, door=door), name="two rooms", options=options)


@pytest.fixture(scope="module")
def cloud() -> Cloud:
    mapped = place(options=WorldOptions())
    coarse = StationConfig(resolution=float(np.deg2rad(0.5)))
    return survey_from_stations(mapped, station=coarse)


@pytest.fixture(scope="module")
def world(cloud: Cloud) -> PreparedMap:
    return prepare(cloud)


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    estimate: Estimate
    truth: Pose

    @property
    def off(self) -> float:
        """[m]"""
        assert self.estimate.map_from_base is not None
        step = self.estimate.map_from_base.position - self.truth.position
        return float(np.hypot(*step[:2]))


def drive(actual: World, world: PreparedMap, seconds: float) -> list[Moment]:
    """Return the estimate and the truth at each sweep of a tour, from a second after the hint."""
    recording = record(actual, name=actual.name, seed=3, seconds=seconds)
    localizer, moments = Localizer(world, recording.mounts), []
    for reading in recording.readings:
        e = localizer.add(reading)
        if e.sweep is not None and e.map_from_base is not None and e.consistency is not None:
            moments.append(Moment(e, recording.truth[e.stamp]))
    return moments[10:]


def kinds(moments: Sequence[Moment]) -> dict[str, float]:
    """Return the mean share of each kind of unexplained beam."""
    seen = [t.estimate.consistency for t in moments]
    names = ("occluded", "free_space_violation", "unmapped", "unexplained")
    return {n: float(np.mean([getattr(m, n) for m in seen])) for n in names}


def reasons_of(moments: Sequence[Moment]) -> str:
    return "\n".join(reason for t in moments for reason in t.estimate.reasons)


def test_place_as_it_was_mapped_is_explained(world: PreparedMap) -> None:
    moments = drive(place(options=WorldOptions()), world, 9.0)
    assert max(t.off for t in moments) < 0.03
    assert kinds(moments)["unexplained"] < 0.08
    assert "the map explains" not in reasons_of(moments)


def test_people_are_seen_before_the_walls_and_not_followed(world: PreparedMap) -> None:
    moments = drive(place(options=WorldOptions(alive=True)), world, 12.0)
    assert max(t.off for t in moments) < 0.05
    seen = kinds(moments)
    assert seen["occluded"] > 0.04
    assert seen["occluded"] > 2.0 * max(seen["free_space_violation"], seen["unmapped"])
    assert not any(t.estimate.health in FLAGGED for t in moments)


def test_moved_furniture_is_not_followed(world: PreparedMap) -> None:
    moments = drive(place(options=WorldOptions(rearranged=4)), world, 9.0)
    assert max(t.off for t in moments) < 0.05
    seen = kinds(moments)
    assert seen["unexplained"] > 0.05
    assert seen["occluded"] + seen["free_space_violation"] > seen["unmapped"]


def test_closed_door_counts_as_occlusion_and_moves_nothing(world: PreparedMap) -> None:
    moments = drive(place(door=CLOSED_DOOR, options=WorldOptions()), world, 9.0)
    assert max(t.off for t in moments) < 0.05
    near = kinds(moments[-10:])
    assert near["occluded"] > 0.06
    assert near["occluded"] > 2.0 * max(near["free_space_violation"], near["unmapped"])
    assert not any(t.estimate.health in FLAGGED for t in moments)


def test_unmapped_room_is_reported_and_the_pose_recovers_on_return(
    cloud: Cloud,
) -> None:
    mapped = cloud.points[:, 0] < 6.25
    lacking = prepare(replace(cloud, points=cloud.points[mapped], normals=cloud.normals[mapped]))
    moments = drive(place(tour=INTO_THE_ROOM, options=WorldOptions()), lacking, 60.0)
    inside = [t for t in moments if t.truth.position[0] > 7.0]
    back = [t for t in moments if t.estimate.stamp > inside[-1].estimate.stamp]
    assert "ends where nothing is mapped" in reasons_of(inside)
    assert kinds(inside)["unmapped"] > 0.5
    assert all(t.estimate.health in FLAGGED for t in inside)
    assert "has left the map and goes by its own motion" in reasons_of(inside)
    assert max(t.off for t in moments) < FAR
    assert len(back) * 0.1 > 5.0
    for t in back[-10:]:
        assert t.off < 0.05
        assert t.estimate.health not in FLAGGED
    assert back[-1].estimate.stamp < 60 * SECOND


@pytest.mark.long
def test_estimates_that_are_put_wrong_are_said_to_be_wrong_within_two_seconds(
    world: PreparedMap,
) -> None:
    actual = place(tour=INTO_THE_ROOM, options=WorldOptions())
    recording = record(actual, name="put wrong", seed=5, seconds=22.0)
    trials = [t for t in lost_trials(recording, world, count=9, seed=2) if t.wrong]
    assert {t.kind for t in trials} == set(KINDS)
    assert len(trials) >= 7
    assert [t for t in trials if not t.flagged] == []
