"""Furniture moved after mapping: never into anything, always by the seed, and enough to matter."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from robot_sim import Simulation, World, WorldError, load_world, scene_names
from robot_sim.floorplan.actors_in_plan import Person
from robot_sim.floorplan.plan import Plan
from robot_sim.layout.furniture_rearrangement import (
    DOOR_CLEARANCE,
    MOBILITY,
    ROBOT_CLEARANCE,
    rearranged,
)
from robot_sim.layout.rectangles import Rectangles
from robot_sim.raycasting import caster_for
from robot_sim.scene_objects.furniture import size_of
from robot_sim.scene_objects.plan_elements import Door, Piece, Placement, Wall
from robot_sim.worlds.loading import load_plan
from robot_sim.worlds.world import WorldOptions
from tests.robot_sim.lines import dense


def corners(piece: Piece) -> np.ndarray:
    """Return the corners (4, 2) of what a piece covers [m]."""
    width, depth, _ = size_of(piece)
    c, s = math.cos(piece.yaw), math.sin(piece.yaw)
    local = 0.5 * np.array([[width, depth], [-width, depth], [-width, -depth], [width, -depth]])
    turned: np.ndarray = local @ np.array([[c, s], [-s, c]]) + (piece.x, piece.y)
    return turned


def overlap(a: np.ndarray, b: np.ndarray) -> bool:
    """Return whether two convex polygons (N, 2) overlap, by projecting on all edges' normals."""
    for polygon in (a, b):
        for edge in np.roll(polygon, -1, axis=0) - polygon:
            normal = np.array([-edge[1], edge[0]])
            if (a @ normal).max() <= (b @ normal).min() or (b @ normal).max() <= (a @ normal).min():
                return False
    return True


def outline(piece: Piece, spacing: float = 0.02) -> np.ndarray:
    """Return points (N, 2) along the edge of what a piece covers."""
    ring = corners(piece)
    return dense([*ring, ring[0]], spacing)


rectangle = st.tuples(
    st.floats(-3.0, 3.0), st.floats(-3.0, 3.0),
    st.tuples(st.floats(0.05, 2.0), st.floats(0.05, 2.0)), st.floats(-4.0, 4.0),
)  # fmt: skip


@given(one=rectangle, other=rectangle)
def test_rectangles_meet_where_their_polygons_overlap(
    one: tuple[float, float, tuple[float, float], float],
    other: tuple[float, float, tuple[float, float], float],
) -> None:
    def polygon(r: tuple[float, float, tuple[float, float], float]) -> np.ndarray:
        return corners(Piece("p", "box", r[0], r[1], r[3], (2 * r[2][0], 2 * r[2][1], 1.0)))

    x, y, (a, b), yaw = other
    assert Rectangles([(x, y, a, b, yaw)]).meet(*one) == overlap(polygon(one), polygon(other))


def test_same_seed_moves_the_same_way_and_another_seed_another() -> None:
    plan = load_plan("office")
    assert rearranged(plan, 3) == rearranged(plan, 3)
    assert rearranged(plan, 3).furniture != rearranged(plan, 4).furniture
    before, after = plan, rearranged(plan, 3)
    assert replace(after, furniture=before.furniture) == before


def test_rearranged_plan_can_be_rearranged_again() -> None:
    once = rearranged(load_plan("office"), 3)
    names = [p.name for p in rearranged(once, 4).furniture]
    assert len(names) == len(set(names))
    boxes = {p.name for p in once.furniture if p.name.startswith("left_box")}
    assert len({n for n in names if n.startswith("left_box")} - boxes) >= 3


def test_seed_below_zero_is_rejected() -> None:
    with pytest.raises(WorldError, match="rearranged is a seed and must be >= 0, got -1"):
        WorldOptions(rearranged=-1)


def test_without_a_seed_everything_stands_where_it_was_mapped(office: World) -> None:
    assert office.plan == load_plan("office")


@pytest.mark.parametrize("scene", scene_names())
@pytest.mark.parametrize("seed", [0, 1])
def test_moved_pieces_keep_clear_of_everything(scene: str, seed: int) -> None:
    plan = load_plan(scene)
    before = {p.name: p for p in plan.furniture}
    moved = [p for p in rearranged(plan, seed).furniture if before.get(p.name) != p]
    assert moved
    after = rearranged(plan, seed).furniture
    spots = [(s.x, s.y) for s in (*plan.spawns.values(), *plan.places.values())]
    for piece in moved:
        mine = corners(piece)
        for other in after:
            if other.name != piece.name and other.kind not in ("tree", "conifer", "canopy", "arch"):
                assert not overlap(mine, corners(other)), f"{piece.name} in {other.name}"
        edge = outline(piece)
        for x, y in spots:
            assert np.hypot(*(edge - (x, y)).T).min() > ROBOT_CLEARANCE - 0.02, piece.name
        for a, b in pairwise(plan.tour):
            assert _to_segment(edge, np.array(a), np.array(b)) > ROBOT_CLEARANCE - 0.02, piece.name
        for wall in plan.walls:
            c, s = math.cos(wall.yaw), math.sin(wall.yaw)
            local = (edge - wall.start) @ np.array([[c, -s], [s, c]])
            for door in wall.doors:
                inside = np.abs(local - (door.at, 0.0)) < (0.5 * door.width, DOOR_CLEARANCE - 0.02)
                assert not inside.all(axis=1).any(), f"{piece.name} before a door of {wall.name}"
    assert all(piece.kind in MOBILITY or piece.name.startswith("left_box") for piece in moved)


def _to_segment(points: np.ndarray, a: np.ndarray, b: np.ndarray) -> float:
    share = np.clip((points - a) @ (b - a) / max(1e-12, float((b - a) @ (b - a))), 0.0, 1.0)
    return float(np.hypot(*(points - a - share[:, None] * (b - a)).T).min())


@pytest.mark.parametrize("scene", scene_names())
def test_robot_fits_everywhere_in_a_rearranged_world(scene: str) -> None:
    # Building it puts the robot at every spawn and place.
    world = load_world(scene, options=WorldOptions(rearranged=1))
    assert set(world.places) == set(load_plan(scene).places)


@settings(max_examples=60)
@given(seed=st.integers(0, 2**32 - 1))
def test_nothing_leaves_its_room_or_enters_a_wall(seed: int) -> None:
    walls = (
        Wall("south", (0.0, 0.0), (8.0, 0.0)),
        Wall("east", (8.0, 0.0), (8.0, 4.0)),
        Wall("north", (8.0, 4.0), (0.0, 4.0)),
        Wall("west", (0.0, 4.0), (0.0, 0.0)),
        Wall("between", (4.0, 0.0), (4.0, 4.0), doors=(Door(2.0, 1.0),)),
    )
    pieces = (
        Piece("desk", "desk", 1.2, 0.8), Piece("chair", "chair", 1.2, 1.6),
        Piece("crate", "box", 2.9, 3.4), Piece("post", "pillar", 3.0, 1.0),
    )  # fmt: skip
    plan = Plan("two rooms", (0.0, 0.0, 8.0, 4.0), {"spawn": Placement(6.0, 2.0)}, walls=walls,
                furniture=pieces, actors=(Person("a", ((0.6, 2.4), (2.4, 2.4))),))  # fmt: skip
    after = {p.name: p for p in rearranged(plan, seed).furniture}
    assert after["post"] == pieces[3]
    for name in ("desk", "chair", "crate"):
        if name not in after:
            continue
        edge = corners(after[name])
        assert (edge > 0.07).all(), name
        assert (edge[:, 1] < 3.93).all(), name
        assert (edge[:, 0] < 3.93).all(), f"{name} went through the wall"
        way = _to_segment(outline(after[name]), np.array([0.6, 2.4]), np.array([2.4, 2.4]))
        assert way > 0.34, f"{name} is in somebody's way"


def test_enough_is_moved_to_matter() -> None:
    plan = load_plan("office")
    movable = {p.name: p for p in plan.furniture if p.kind in MOBILITY}
    shares, distances, gone, new = [], [], 0, 0
    for seed in range(12):
        after = {p.name: p for p in rearranged(plan, seed).furniture}
        touched = [n for n, p in movable.items() if after.get(n) != p]
        shares.append(len(touched) / len(movable))
        gone += sum(n not in after for n in movable)
        new += sum(n not in {p.name for p in plan.furniture} for n in after)
        distances += [
            math.hypot(after[n].x - movable[n].x, after[n].y - movable[n].y)
            for n in touched
            if n in after
        ]
    # docs/worlds.md: three quarters at least, half a metre and more in the mean.
    assert min(shares) >= 0.75
    assert np.mean(distances) > 0.5
    assert max(distances) <= 2.5
    chairs = sum(p.kind == "chair" for p in movable.values())
    boxes = sum(p.kind == "box" for p in movable.values())
    plants = sum(p.kind == "plant" for p in movable.values())
    assert gone / 12 == pytest.approx(0.15 * chairs + 0.25 * boxes + 0.1 * plants, rel=0.4)
    assert 2.5 <= new / 12 <= 4.0


def changed_share(mapped: World, today: World, spacing: float = 1.0) -> float:
    """Return the share of level beams, cast along the tour, that differ by more than 10 cm."""
    points = dense(mapped.tour, spacing)
    angles = np.radians(np.arange(0.0, 360.0, 1.0))
    rays = np.stack([np.cos(angles), np.sin(angles), np.zeros(len(angles))], axis=1)
    origins = np.repeat(np.column_stack([points, np.full(len(points), 0.4)]), len(rays), axis=0)
    directions = np.tile(rays, (len(points), 1))
    ranges = []
    for world in (mapped, today):
        simulation = Simulation(world)
        caster = caster_for(world, simulation._data)
        none = np.zeros(len(origins), dtype=np.int64)
        ranges.append(np.minimum(caster.distances(origins, directions, none, 20.0), 20.0))
    return float((np.abs(ranges[0] - ranges[1]) > 0.1).mean())


def test_scanners_see_the_difference(office: World) -> None:
    share = changed_share(office, load_world("office", options=WorldOptions(rearranged=1)))
    assert 0.05 < share < 0.35
