"""Boxes, closed doors and people that come at their time, and spares that a running simulation puts down."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path

import mujoco
import numpy as np
import pytest

from localization.types import Pose, Scan, Twist
from robot_sim import (
    AddedBox,
    ClosedDoor,
    MujocoRayCaster,
    PassingPerson,
    RayCaster,
    Simulation,
    World,
    WorldError,
    WorldOptions,
    caster_for,
    doorways,
    load_world,
    parse_world,
)
from robot_sim.actors.extras import Extra
from robot_sim.actors.schedules import OpenSchedule, Scheduled, Standing
from robot_sim.scene_objects.plan_elements import Placement
from tests.robot_sim.driving import run

SECOND = 1_000_000_000
FORWARD = Twist.planar(0.5, 0.0)

ROOMS = """
bounds = [0.0, 0.0, 10.0, 6.0]
spawn = [1.5, 3.0, 0.0]
[places]
far = [8.0, 3.0, 0.0]
[[wall]]
name = "middle"
from = [5.0, 0.0]
to = [5.0, 6.0]
doors = [{ at = 3.0, width = 1.2 }]
[[wall]]
name = "north"
from = [0.0, 6.0]
to = [10.0, 6.0]
doors = [{ at = 7.0, width = 1.0 }, { at = 2.0, width = 0.9, height = 2.2 }]
"""
LIFE = """
[[person]]
name = "eve"
path = [[7.0, 1.0], [9.0, 1.0]]
"""
MJCF = """
<mujoco>
  <worldbody>
    <geom name="floor" type="plane" size="8 8 0.1" pos="0 0 1" user="0.7"/>
    <geom name="wall" type="box" size="0.1 4 1" pos="6 0 2"/>
    <site name="spawn" pos="0 0 1"/>
  </worldbody>
</mujoco>
"""


def rooms(*extras: Extra, alive: bool = False, text: str = ROOMS, **options: object) -> World:
    chosen = WorldOptions(alive=alive, extras=extras, **options)  # type: ignore[arg-type]
    return parse_world(text, name="rooms", options=chosen)


def both_casters(simulation: Simulation) -> list[RayCaster]:
    world, data = simulation.world, mujoco.MjData(simulation.world.model)
    mujoco.mj_forward(world.model, data)
    return [caster_for(world, data), MujocoRayCaster(world.model, data, world.movers)]


def seen(caster: RayCaster, start: Sequence[float], times: Sequence[int]) -> list[float]:
    """Distances along x from a point, in one cast, at these times."""
    origins, ahead = (
        np.tile(np.array(start), (len(times), 1)),
        np.tile([1.0, 0, 0], (len(times), 1)),
    )
    found = caster.distances(origins, ahead, np.array(times, dtype=np.int64), 30.0)
    return [round(float(d), 3) for d in found]


def drive(simulation: Simulation, seconds: float, twist: Twist = FORWARD) -> Pose:
    simulation.command(twist)
    run(simulation, round(seconds * 50))
    return simulation.truth().map_from_base


def box(at: Sequence[float], start: float = 0.0, end: float | None = None) -> AddedBox:
    until = None if end is None else int(end * SECOND)
    return AddedBox((0.6, 0.8, 1.0), Placement(*at), int(start * SECOND), until)


def test_both_casters_see_a_box_from_its_first_to_its_last_nanosecond() -> None:
    simulation = Simulation(rooms(box((3.0, 3.0), 1.0, 2.0)))
    times = [0, SECOND - 1, SECOND, 2 * SECOND - 1, 2 * SECOND]
    for caster in both_casters(simulation):
        assert seen(caster, (1.0, 3.0, 0.4), times) == [math.inf, math.inf, 1.7, 1.7, math.inf]
        # Also where the middle of the rays' times is before it comes, or after it has gone.
        assert seen(caster, (1.0, 3.0, 0.4), [0, 0, SECOND]) == [math.inf, math.inf, 1.7]
        assert seen(caster, (1.0, 3.0, 0.4), [SECOND, 3 * SECOND]) == [1.7, math.inf]


@pytest.mark.parametrize("alive", [False, True])
def test_box_stops_the_robot_like_furniture_until_it_is_taken_away(alive: bool) -> None:
    world = rooms(box((3.5, 3.0), 1.0, 6.0), alive=alive, text=ROOMS + LIFE)
    simulation = Simulation(world)
    reached = drive(simulation, 5.9)
    edge = 3.2 - 0.5 * world.robot.length
    assert edge - 0.02 < reached.position[0] < edge + 0.02
    assert simulation.touching == ("added_box_1_side",)
    assert "added_box_1_side" in simulation.condition.touching
    assert drive(simulation, 3.0).position[0] > 4.0


@pytest.mark.parametrize(
    ("extra", "start"),
    [
        (box((1.6, 3.1), 1.0), (1.5, 3.0)),
        (box((1.9, 3.0), 1.0), (1.5, 3.0)),
        (ClosedDoor("middle", SECOND), (5.0, 3.0)),
        (ClosedDoor("middle", SECOND), (5.2, 3.1)),
    ],
)
def test_what_would_come_upon_the_robot_waits_until_it_has_gone(
    extra: Extra, start: tuple[float, float]
) -> None:
    simulation = Simulation(rooms(extra), start=Pose.planar(*start, 0.0))
    (name,) = (mover.name for mover in simulation.world.movers)
    before = simulation.truth().map_from_base.position.copy()
    run(simulation, 100)
    assert list(simulation.waiting) == [name]
    assert simulation.truth().map_from_base.position == pytest.approx(before, abs=1e-3)
    body = simulation._model.body(name).mocapid[0]
    assert simulation.visual_state().mocap_pos[body, 2] < -9.0
    drive(simulation, 4.0)
    assert list(simulation.waiting) == []
    assert simulation.visual_state().mocap_pos[body, 2] == 0.0
    assert simulation.truth().map_from_base.position[0] > start[0] + 1.0


def test_what_would_come_after_its_end_does_not_come_and_other_simulations_are_not_affected() -> (
    None
):
    world = rooms(ClosedDoor("middle", SECOND, 2 * SECOND))
    held = Simulation(world, start=Pose.planar(5.0, 3.0, 0.0))
    free = Simulation(world)
    body = held._model.body("closed_door_1").mocapid[0]
    heights = []
    for _ in range(150):
        held.step()
        free.step()
        heights.append([s.visual_state().mocap_pos[body, 2] for s in (held, free)])
    assert max(h for h, _ in heights) < -9.0
    assert [h for _, h in heights].count(0.0) == 50
    assert held.waiting == ()


def test_robot_is_pushed_by_nothing_wherever_it_stands_when_a_door_closes() -> None:
    for x in np.arange(4.3, 5.8, 0.1):
        simulation = Simulation(
            rooms(ClosedDoor("middle", SECOND // 10)), start=Pose.planar(float(x), 2.9, 0.3)
        )
        run(simulation, 25)
        moved = simulation.truth().map_from_base.position[:2] - (float(x), 2.9)
        assert np.hypot(*moved) < 5e-3


def test_nothing_differs_by_a_bit_before_a_box_comes() -> None:
    def readings(world: World) -> list[str]:
        simulation = Simulation(world, seed=3)
        simulation.command(Twist.planar(0.4, 0.3))
        return [repr(r) + (r.ranges.tobytes().hex() if isinstance(r, Scan) else "")
                for _ in range(50) for r in simulation.step()]  # fmt: skip

    plain = readings(rooms())
    assert readings(rooms(box((3.5, 3.0), 1.01), ClosedDoor("middle", 2 * SECOND))) == plain
    assert readings(rooms(PassingPerson(((3.0, 1.0), (3.0, 5.0)), SECOND))) == plain
    changed = readings(rooms(box((3.5, 3.0), 0.5)))
    assert changed != plain


def test_closed_door_fills_its_doorway_for_rays_and_for_the_robot() -> None:
    world = rooms(ClosedDoor("middle", SECOND, 9 * SECOND))
    simulation = Simulation(world)
    for caster in both_casters(simulation):
        for y in (2.45, 3.0, 3.55):
            assert seen(caster, (1.0, y, 0.4), [0, SECOND]) == [math.inf, 3.98]
        # Above it is the lintel.
        assert seen(caster, (1.0, 3.0, 2.04), [SECOND]) == [3.98]
    assert drive(simulation, 8.9).position[0] < 4.98 - 0.5 * world.robot.length + 0.02
    assert drive(simulation, 5.0).position[0] > 5.5


def test_doorways_are_known_by_their_wall_and_number() -> None:
    plan = rooms().plan
    assert plan is not None
    doors = doorways(plan)
    assert list(doors) == ["middle", "north/1", "north/2"]
    assert (doors["north/1"].x, doors["north/1"].width, doors["north/1"].height) == (2.0, 0.9, 2.2)
    assert doors["middle"].yaw == pytest.approx(0.5 * math.pi)
    assert (doors["middle"].x, doors["middle"].y) == pytest.approx((5.0, 3.0))


@pytest.mark.parametrize(
    ("extra", "message"),
    [
        (ClosedDoor("north"), "no door 'north': did you mean north/"),
        (ClosedDoor("xyz"), "no door 'xyz': there are: middle, north/1, north/2"),
        (PassingPerson(((1.0, 1.0), (9.0, 1.0))), "person 1 walks through middle_0 between"),
        (PassingPerson(((1.0, 1.0),)), "2 way-points or more, got 1"),
        (PassingPerson(((1.0, 1.0), (2.0, 1.0), (1.0, 1.0))), "person's path turns right back"),
    ],
)
def test_extra_that_cannot_be_is_refused_with_the_reason(extra: Extra, message: str) -> None:
    with pytest.raises(WorldError, match=message):
        rooms(extra)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: AddedBox((0.01, 1.0, 1.0), Placement(1, 1)), "each side must be 0.05 to 5 m"),
        (lambda: box((1.0, 1.0), 2.0, 1.0), "the end must be after the start"),
        (lambda: ClosedDoor("middle", -1), "the start must be >= 0 ns, got -1"),
        (lambda: PassingPerson(((0, 0), (1, 0)), speed=3.5), "at most 3 m/s, got 3.5"),
        (lambda: WorldOptions(spare_people=-1), "spare_people must be >= 0, got -1"),
    ],
)
def test_impossible_extra_cannot_be_made(make: Callable[[], object], message: str) -> None:
    with pytest.raises(WorldError, match=message):
        make()


def test_start_inside_a_box_that_is_there_from_the_beginning_is_refused() -> None:
    world = rooms(box((1.7, 3.0)))
    with pytest.raises(WorldError, match="would stand inside added_box_1_side"):
        Simulation(world)
    Simulation(world, start=Pose.planar(3.0, 5.0, 0.0))
    Simulation(rooms(box((1.7, 3.0), 0.1)))


def test_person_walks_once_along_the_path_and_is_gone() -> None:
    world = rooms(PassingPerson(((2.0, 1.0), (2.0, 4.0)), SECOND, speed=1.0))
    torso = next(m for m in world.movers if m.name == "added_person_1_torso")
    times = np.arange(0, 8 * SECOND, SECOND // 100)
    positions, _ = torso.pose_at(times)
    there = positions[:, 2] > -1.0
    walked = times[there]
    assert walked[0] == SECOND
    # 3 m at 1 m/s, with 0.5 s more for each of both ramps of 1 m/s^2.
    assert walked[-1] == pytest.approx(5 * SECOND, abs=SECOND // 50)
    assert positions[there][0, :2] == pytest.approx((2.0, 1.0))
    assert positions[there][-1, :2] == pytest.approx((2.0, 4.0), abs=0.01)
    assert (np.diff(positions[there][:, 1]) >= 0.0).all()
    simulation = Simulation(world)
    for caster in both_casters(simulation):
        # At 3 s the walker is at y = 2.5.
        at = [SECOND // 2, 3 * SECOND, 6 * SECOND]
        assert seen(caster, (1.0, 2.5, 1.2), at) == [math.inf, 0.78, math.inf]


def test_person_who_walks_once_pushes_the_robot() -> None:
    simulation = Simulation(rooms(PassingPerson(((1.5, 5.0), (1.5, 1.0)), 0)))
    drive(simulation, 4.5, Twist.planar(0.0, 0.0))
    assert simulation.truth().map_from_base.position[1] < 2.98


@pytest.fixture
def mjcf(tmp_path: Path) -> Path:
    path = tmp_path / "hall.xml"
    path.write_text(MJCF, encoding="utf-8")
    return path


def test_boxes_and_people_come_into_an_mjcf_world_and_stand_on_its_ground(mjcf: Path) -> None:
    plain = load_world(str(mjcf))
    person = PassingPerson(((1.5, 2.0), (1.5, -2.0)), 2 * SECOND)
    options = WorldOptions(extras=(box((2.0, 0.0), 1.0, 3.0), person), spare_boxes=((1, 1, 1),))
    world = load_world(str(mjcf), options=options)
    assert world.bounds == plain.bounds
    simulation = Simulation(world)
    for caster in both_casters(simulation):
        assert seen(caster, (0.0, 0.0, 1.9), [0, SECOND, 3 * SECOND]) == [5.9, 1.7, 5.9]
        assert seen(caster, (0.0, 0.0, 2.1), [SECOND]) == [5.9]
        # The torso, 1.15 m above the ground, crosses after 2 m: 0.5 s and 2.17 s at speed.
        assert seen(caster, (0.0, 0.0, 2.15), [4_260_000_000])[0] == pytest.approx(1.28, abs=0.03)
    assert drive(simulation, 2.9).position[0] < 1.5
    with pytest.raises(WorldError, match="no doorways that are known by name"):
        load_world(str(mjcf), options=WorldOptions(extras=(ClosedDoor("gate"),)))


def spare_world() -> World:
    return rooms(spare_boxes=((0.6, 0.8, 1.0), (0.4, 0.4, 0.4)), spare_people=1)


def test_spares_are_parked_until_they_are_put_somewhere() -> None:
    simulation = Simulation(spare_world())
    names = ("spare_box_1", "spare_box_2", "spare_person_1")
    assert tuple(s.name for s in simulation.spares.parked) == names
    assert drive(simulation, 1.0).position[0] > 1.7
    simulation.spares.put("spare_box_1", Placement(3.5, 3.0, 0.0))
    assert tuple(s.name for s in simulation.spares.parked) == names[1:]
    edge = 3.2 - 0.5 * simulation.world.robot.length
    assert edge - 0.02 < drive(simulation, 5.0).position[0] < edge + 0.02
    simulation.spares.remove("spare_box_1")
    assert simulation.spares.parked == simulation.spares.all
    assert drive(simulation, 3.0).position[0] > 4.0
    with pytest.raises(
        WorldError, match="no spare body 'cat'; there are: spare_box_1, spare_box_2"
    ):
        simulation.spares.put("cat", Placement(0, 0, 0))


def test_sweep_sees_a_spare_only_with_the_beams_after_it_was_put_down() -> None:
    simulation = Simulation(spare_world(), start=Pose.planar(2.0, 3.0, 0.0))
    scans: list[Scan] = []

    def run(ticks: int) -> None:
        for _ in range(ticks):
            scans.extend(r for r in simulation.step() if isinstance(r, Scan))

    # The beam straight ahead is sent 37.5 ms after a sweep of 75 ms begins; a tick ends at 40 ms.
    run(10)
    simulation.spares.put("spare_box_1", Placement(3.5, 3.0, 0.0))
    run(12)
    simulation.spares.put("spare_box_1", Placement(4.5, 3.0, 0.0))
    run(5)
    ahead = {s.stamp // 100_000_000: s.ranges[len(s.ranges) // 2]
             for s in scans if s.scanner == "laser_horizontal"}  # fmt: skip
    x = 2.0 + simulation.world.robot.mounts["laser_horizontal"].position[0]
    assert ahead[1] > 5.0
    assert ahead[2] == pytest.approx(3.2 - x, abs=0.06)
    assert ahead[3] == pytest.approx(3.2 - x, abs=0.06)
    assert ahead[4] == pytest.approx(3.2 - x, abs=0.06)
    run(5)
    last = [s for s in scans if s.scanner == "laser_horizontal"][-1]
    assert last.ranges[len(last.ranges) // 2] == pytest.approx(4.2 - x, abs=0.06)
    # In the sweep from 400 to 475 ms the box moves at 440 ms: after the beam at 37.5 ms.
    straddling = next(s for s in scans if s.stamp == 400_000_000 and s.scanner == last.scanner)
    near = np.flatnonzero(np.isfinite(straddling.ranges) & (straddling.ranges < 1.4 - (x - 2.0)))
    assert len(near)
    assert near.max() * 75e6 / 540 <= 40e6 < 41e6


def test_robot_is_not_carried_into_a_spare_that_was_just_put_down() -> None:
    simulation = Simulation(spare_world())
    simulation.step()
    simulation.spares.put("spare_box_2", Placement(8.0, 3.0, 0.0))
    with pytest.raises(WorldError, match="would stand inside spare_box_2_side"):
        simulation.carry_to(Pose.planar(8.1, 3.0, 0.0))
    simulation.spares.put("spare_box_2", Placement(8.0, 5.0, 0.0))
    simulation.carry_to(Pose.planar(8.1, 3.0, 0.0))


def test_simulations_of_one_world_have_spares_of_their_own() -> None:
    world = spare_world()
    first, second = Simulation(world), Simulation(world)
    first.spares.put("spare_box_1", Placement(3.5, 3.0, 0.0))
    assert drive(second, 6.0).position[0] > 3.5
    assert drive(first, 6.0).position[0] < 3.1


def test_the_past_of_a_schedule_stays_as_it_was() -> None:
    schedule = OpenSchedule("crate")
    here, there = Standing(1, 0, 0, 0), Standing(2, 0, 0, 0)
    schedule.add(100, here.pose_at)
    before = schedule.pose_at(np.arange(90, 200))
    schedule.add(200, there.pose_at)
    again = schedule.pose_at(np.arange(90, 200))
    assert np.array_equal(before[0], again[0])
    assert schedule.pose_at(np.array([100, 101, 200, 201]))[0][:, 0].tolist() == [0, 1, 1, 2]
    assert schedule.jumps(150, 201)
    assert not schedule.jumps(150, 200)
    with pytest.raises(WorldError, match="past of 'crate' cannot be changed"):
        schedule.add(150, None)
    # Two changes between the same two ticks: the later one counts.
    schedule.add(200, None)
    assert schedule.pose_at(np.array([201]))[0][0, 2] < -100.0


def test_empty_schedule_is_parked_at_all_times() -> None:
    positions, yaws = Scheduled("nobody").pose_at(np.array([-5, 0, 10**12]))
    assert (positions[:, 2] < -100.0).all()
    assert not yaws.any()
