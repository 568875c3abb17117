"""Scenarios that can never be run or passed in their world, each with the field and the remedy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from robot_sim import World, WorldOptions, load_world, parse_world
from teleop.scenario.files.errors import FieldPath, ScenarioError
from teleop.scenario.files.scenario import SCHEMA, Scenario, WorldSettings
from teleop.scenario.session.scene import checked_scene_of
from teleop.scenario.session.world_checks import check, check_settings
from teleop.scenario.session.world_extras import extras_of

ROOMS = """
bounds = [0.0, 0.0, 12.0, 6.0]
spawn = [1.5, 3.0, 0.0]
[places]
desk = [3.0, 1.5, 90.0]
lab = [7.5, 3.0, 0.0]
[[wall]]
name = "west"
from = [0.0, 0.0]
to = [0.0, 6.0]
[[wall]]
name = "middle"
from = [5.0, 0.0]
to = [5.0, 6.0]
doors = [{ at = 5.0, width = 1.4 }]
[[wall]]
name = "vault"
from = [9.0, 0.0]
to = [9.0, 6.0]
"""


@pytest.fixture(scope="module")
def rooms() -> World:
    return parse_world(ROOMS, name="rooms")


def scenario(**parts: Any) -> Scenario:
    made: Scenario = SCHEMA.validate_python({"format": 1, "name": "trial", **parts})
    return made


def fault(**fields: Any) -> Scenario:
    return scenario(fault=[{"at": 5.0, **fields}])


def goals(*places: Any, **mission: Any) -> Scenario:
    return scenario(mission={"goals": [{"at": place} for place in places], **mission})


def test_scenario_that_can_be_run_passes(rooms: World) -> None:
    check(
        scenario(
            start={"at": "desk", "known": "about", "off": 0.3},
            mission={"goals": [{"at": "lab"}, {"at": [3.0, 1.5]}], "time_limit": 60.0},
            fault=[
                {"kind": "kidnap", "at": 3.0, "to": [7.0, 2.0, 45.0]},
                {"kind": "kidnap", "at": 4.0},
                {"kind": "scanner_dead", "at": 3.0},
                {"kind": "box", "at": 0.0, "to": "lab", "lasting": 2.0},
                {"kind": "person", "at": 1.0, "path": [[1, 1], "desk", [4.0, 5.0, 90.0]]},
                {"kind": "door_closed", "at": 1.0, "door": "middle"},
                {"kind": "link", "at": 1.0, "delay": 0.2},
                {"kind": "wheel_slip", "at": 2.0},
            ],
            limits={"distance": 20.0, "duration": 50.0, "nees": [2.0, 12.0]},
        ),
        rooms,
    )


CASES: list[tuple[Scenario, FieldPath, str]] = [
    (scenario(start={"at": "desc"}), ("start", "at"), "no place 'desc'; did you mean desk?"),
    (scenario(start={"at": [5.0, 1.0]}), ("start", "at"), "would stand inside middle_0"),
    (scenario(start={"at": [20, 1]}), ("start", "at"), "off the floor, which reaches from 0, 0"),
    (scenario(start={"at": [11.0, 3.0]}, mission={"goals": [{"at": "lab"}]}),
     ("start", "at"), "no floor within 1 m"),
    (scenario(start={"at": "desk", "off": 1.0}), ("start", "off"), 'only with known = "about"'),
    (goals("lab", "kitchen"), ("mission", "goals", 1, "at"), "no place 'kitchen'; there are: desk, lab"),
    (goals([5.0, 1.0]), ("mission", "goals", 0, "at"), "is in middle_0; the nearest place"),
    (goals("lab", [11.0, 3.0]), ("mission", "goals", 1, "at"), "cannot be reached to within 0.5 m"),
    (goals("lab", time_limit=5.0), ("mission", "time_limit"), "the goals take 8 s at least"),
    (scenario(limits={"nees": [9.0, 3.0]}), ("limits", "nees"), "got [9, 3]; 6 is consistent"),
    (scenario(limits={"nees": [-1.0, 3.0]}), ("limits", "nees"), "0 <= least < greatest"),
    (scenario(limits={"distance": 500.0}), ("limits", "distance"), "it is 84 m at most"),
    (scenario(limits={"duration": 5.0}), ("limits", "duration"), "there is no goal"),
    (scenario(limits={"duration": 5.0}, mission={"goals": [{"at": "lab"}]}),
     ("limits", "duration"), "5 s can never be kept: the goals take 8 s at least"),
    (scenario(fault=[{"kind": "estop", "at": 1.0}, {"kind": "scanner_dead", "at": 130.0}]),
     ("fault", 1, "at"), "130 s is not before the end of the run: mission.time_limit is 120 s"),
    (fault(kind="wheel_slip", lasting=0.0), ("fault", 0, "lasting"), "must last > 0 s, got 0"),
    (fault(kind="kidnap", to=[5.0, 1.0]), ("fault", 0, "to"), "would stand inside middle_0"),
    (fault(kind="kidnap", to="lap"), ("fault", 0, "to"), "no place 'lap'; did you mean lab?"),
    (fault(kind="door_closed", door="middlo"), ("fault", 0, "door"), "no door 'middlo': did you mean middle?"),
    (fault(kind="box", to="lav"), ("fault", 0, "to"), "no place 'lav'; did you mean lab?"),
    (fault(kind="box", to=[13.0, 1.0]), ("fault", 0, "to"), "[13, 1] is off the floor"),
    (scenario(fault=[{"kind": "box", "at": 0.0, "to": [1.9, 3.0]}]),
     ("fault", 0, "to"), "at 0 s the robot itself stands there, at 1.5, 3"),
    (fault(kind="person", path=[[1, 1], [13, 1]]), ("fault", 0, "path", 1), "[13, 1] is off the floor"),
    (fault(kind="person", path=[[1, 1], [8, 1]]), ("fault", 0, "path"), "walks through middle_0 between"),
    (fault(kind="person", path=[[1, 1], [3, 1], [1, 1]]), ("fault", 0, "path"), "turns right back"),
    (fault(kind="person", path=[[1, 1], [1, 1]]), ("fault", 0, "path"), "two way-points in a row"),
    (fault(kind="link"), ("fault", 0), "give delay, jitter, rate or blackout"),
]  # fmt: skip


@pytest.mark.parametrize(("wrong", "path", "message"), CASES, ids=[c[2][:40] for c in CASES])
def test_what_can_never_be_is_refused_with_field_and_remedy(
    rooms: World, wrong: Scenario, path: FieldPath, message: str
) -> None:
    with pytest.raises(ScenarioError) as caught:
        check(wrong, rooms)
    assert caught.value.path == path
    assert message in caught.value.message
    assert "\n" not in str(caught.value)


def test_goals_are_not_too_far_for_a_robot_that_is_carried(rooms: World) -> None:
    carried = scenario(
        mission={"goals": [{"at": "lab"}], "time_limit": 5.0}, fault=[{"kind": "kidnap", "at": 1.0}]
    )
    check(carried, rooms)


def test_world_without_doors_that_are_known_says_so(tmp_path: Path) -> None:
    path = tmp_path / "hall.xml"
    path.write_text(
        '<mujoco><worldbody><geom name="floor" type="plane" size="4 4 0.1" user="0.7"/>'
        '<site name="spawn"/></worldbody></mujoco>',
        encoding="utf-8",
    )
    with pytest.raises(ScenarioError, match="no doorways that are known by name"):
        check(fault(kind="door_closed", door="gate"), load_world(str(path)))


def test_extras_of_a_scenario_are_in_its_world_at_their_times(rooms: World) -> None:
    made = scenario(
        fault=[
            {"kind": "box", "at": 2.0, "to": "lab", "lasting": 3.0, "size": [1, 2, 1]},
            {"kind": "estop", "at": 1.0},
            {"kind": "person", "at": 1.0, "path": [[1, 1], "desk"], "speed": 0.8},
            {"kind": "door_closed", "at": 4.0, "door": "middle"},
        ]
    )
    box, person, door = extras_of(made, rooms)
    assert (box.start_ns, box.end_ns) == (2_000_000_000, 5_000_000_000)  # type: ignore[union-attr]
    world = parse_world(ROOMS, name="rooms", options=WorldOptions(extras=(box, person, door)))
    assert [m.name for m in world.movers] == [
        "added_box_1",
        "added_person_1_torso",
        "added_person_1_left_leg",
        "added_person_1_right_leg",
        "closed_door_1",
    ]
    check(made, world)


HAND = {"kind": "hand", "tasks": [{"kind": "wait"}]}
PARCEL = {"name": "first", "at": [3, 4]}
BEFORE_ITS_WORLD: list[tuple[Scenario, FieldPath, str]] = [
    (scenario(world={"scene": "ofice"}), ("world", "scene"), "beside the scenario; did you mean office?"),
    (scenario(world={"scene": "../other"}), ("world", "scene"), "is outside the scenario's folder; copy the scene"),
    (scenario(world={"scene": "/etc"}), ("world", "scene"), "is outside the scenario's folder"),
    (scenario(world={"scanner": "sick_lms112"}), ("world", "scanner"), "did you mean sick_lms111"),
    (scenario(world={"inertial": "xyz"}), ("world", "inertial"), "there are: default, "),
    (scenario(world={"surface": "carpett"}), ("world", "surface"), "carpet"),
    (scenario(world={"arm": "s3"}), ("world", "arm"), "no arm 's3'; there are: s2"),
    (scenario(world={"arm": "s2", "arm_mount": "roof"}), ("world", "arm_mount"), "the arm has no mount 'roof'"),
    (scenario(limits={"picked": 1}), ("limits", "picked"), "the robot carries no arm"),
    (scenario(world={"parcels": [PARCEL]}), ("world", "parcels"), "the robot carries no arm"),
    (scenario(operator=HAND), ("operator", "kind"), "the robot carries no arm; give world.arm, such as s2"),
    (scenario(world={"arm": "s2", "parcels": [PARCEL]}, mission={"deliver": [{"parcel": "firxt", "to": [3, 4, 0]}]}),
     ("mission", "deliver", 0, "parcel"), "no parcel 'firxt'; did you mean first?"),
    (fault(kind="board_unplugged"), ("fault", 0), "there is no second arm"),
    (scenario(limits={"mirror_error": 1}), ("limits", "mirror_error"), "there is no second arm"),
    (scenario(world={"board": "degree"}), ("world", "board"), "the robot carries no arm"),
    (goals("meeting_room", tour=True), ("mission", "tour"), "the way-points of the tour are the goals"),
    (goals("kichen"), ("mission", "goals", 0, "at"), "kitchen"),
    (fault(kind="door_closed", door="corridor_south/9"), ("fault", 0, "door"), "corridor_south"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("wrong", "path", "message"), BEFORE_ITS_WORLD, ids=[c[2][:40] for c in BEFORE_ITS_WORLD]
)
def test_scene_is_built_only_of_a_scenario_that_can_be_run(
    tmp_path: Path, wrong: Scenario, path: FieldPath, message: str
) -> None:
    with pytest.raises(ScenarioError) as caught:
        checked_scene_of(wrong, tmp_path)
    assert caught.value.path == path
    assert message in caught.value.message


def test_scene_beside_the_scenario_is_found(tmp_path: Path) -> None:
    (tmp_path / "hall.toml").write_text(ROOMS, encoding="utf-8")
    check_settings(WorldSettings(scene="hall.toml"), tmp_path)
    check_settings(WorldSettings(), tmp_path)


@pytest.mark.slow
def test_scene_of_a_scenario_that_can_be_run_holds_what_comes_into_it(tmp_path: Path) -> None:
    box = {"kind": "box", "at": 1.0, "to": [20.0, 4.0]}
    good = checked_scene_of(scenario(world={"scene": "corridor"}, fault=[box]), tmp_path)
    assert [mover.name for mover in good.world.movers] == ["added_box_1"]
