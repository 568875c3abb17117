"""Faults strike at their times, end, and change nothing that was before them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from localization.types import Scan, WheelSpeeds
from teleop.robot.inbox import Disconnected, DriveCommand, EStop, EStopReset, InboxMessage, PoseHint
from teleop.scenario.referee.outcome import EventKind
from tests.teleop.scenario.session.support import (
    TICK,
    Forward,
    Run,
    first_difference,
    run,
    scenario,
)

AT = 0.5
KINDS: dict[str, dict[str, Any]] = {
    "kidnap": {"to": "niche"},
    "wheel_slip": {"lasting": 0.2, "factor": 3.0},
    "scanner_dead": {"lasting": 0.2},
    "scanner_dirty": {"lasting": 0.2, "share": 0.5},
    "box": {"to": [5.0, 4.5], "lasting": 0.2},
    "person": {"path": [[6.0, 4.0], [8.0, 4.0]]},
    "link": {"delay": 0.3, "lasting": 0.2},
    "operator_killed": {},
    "wrong_hint": {"off": 2.0},
    "clock_step": {"step": -5.0},
    "estop": {"lasting": 0.2},
}
"""Each kind of fault, which the corridor knows."""

LATER = {
    "clock_step": 0.02,
    "scanner_dead": 0.12,
    "scanner_dirty": 0.12,
    "box": 0.3,
    "person": 0.3,
    "link": 0.1,
}
"""Where a fault needs time to be felt, that time [s]."""


@pytest.fixture(scope="module")
def nominal() -> Run:
    """A second without any fault."""
    return run(scenario(), Forward())


@pytest.fixture(scope="module")
def struck() -> dict[str, Run]:
    """The same second with each kind of fault."""
    return {
        kind: run(scenario({"kind": kind, "at": AT, **fields}), Forward())
        for kind, fields in KINDS.items()
    }


def inboxes(done: Run, kind: type[InboxMessage]) -> list[tuple[float, Any]]:
    """Return the messages of a kind with the times at which their ticks begin [s]."""
    found = [(i * TICK, m) for i, tick in enumerate(done.ticks) for m in tick.inbox]
    return [(time, message) for time, message in found if isinstance(message, kind)]


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_fault_changes_not_a_bit_before_its_time_and_something_after(
    nominal: Run, struck: dict[str, Run], kind: str
) -> None:
    differs = first_difference(nominal, struck[kind])
    assert AT - 1e-9 <= differs <= AT + LATER.get(kind, 0.0) + 1e-9
    if kind == "clock_step":
        differs = first_difference(nominal, struck[kind], inboxes=False)
        assert differs == math.inf, "a clock that jumps says nothing of the age of commands"


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_fault_is_noted_as_it_begins_and_as_it_ends(struck: dict[str, Run], kind: str) -> None:
    events = [e for e in struck[kind].session.referee.events if e.kind is EventKind.FAULT]
    assert events[0].stamp == pytest.approx(AT * 1e9)
    ends = [e for e in events if e.text.startswith("over: ")]
    assert [e.stamp for e in ends] == ([700_000_000] if "lasting" in KINDS[kind] else [])


# What each one does


def test_kidnapped_robot_stands_elsewhere_from_one_tick_to_the_next() -> None:
    done = run(scenario({"kind": "kidnap", "at": 0.3, "to": "niche"}, time=0.4), Forward())
    assert done.x[14] == pytest.approx(2.5, abs=0.2)
    assert done.x[15] == pytest.approx(34.0, abs=0.02)
    assert done.session.referee.judged()[1]["distance"] < 0.2


def test_kidnap_to_coordinates_turns_the_robot_too() -> None:
    done = run(scenario({"kind": "kidnap", "at": 0.1, "to": [20.0, 4.2, 90.0]}, time=0.2))
    pose = done.ticks[-1].truth.map_from_base
    assert pose.position[:2].tolist() == pytest.approx([20.0, 4.2], abs=1e-3)
    assert pose.yaw == pytest.approx(math.pi / 2, abs=1e-3)


@pytest.mark.parametrize(
    ("to", "why"),
    [
        ([20.0, 2.8], "would stand inside"),
        ([0.0, 0.0], "no ground"),
        ([200.0, 4.0], "no ground"),
        ([1e308, -1e308], "no ground for the robot at x 1e+308, y -1e+308"),
        ("atlantis", "no place 'atlantis'"),
    ],
)
def test_kidnap_to_where_no_robot_can_stand_leaves_it_and_says_so(to: Any, why: str) -> None:
    done = run(scenario({"kind": "kidnap", "at": 0.1, "to": to}, time=0.2))
    assert done.x[-1] == pytest.approx(2.5, abs=1e-3)
    (text,) = [text for text in done.texts if text.startswith("the robot stays")]
    assert why in text


@pytest.mark.slow
def test_kidnap_anywhere_is_drawn_by_the_seed() -> None:
    def place(seed: int) -> float:
        return run(scenario({"kind": "kidnap", "at": 0.1}, seed=seed, time=0.14)).x[-1]

    places = [place(seed) for seed in (1, 2, 3)]
    assert len(set(places)) == 3
    assert place(1) == places[0]


def test_draws_of_a_fault_do_not_depend_on_the_faults_behind_it() -> None:
    kidnap, hint = {"kind": "kidnap", "at": 0.1}, {"kind": "wrong_hint", "at": 0.06}
    alone = run(scenario(kidnap, time=0.14, seed=2)).x[-1]
    assert run(scenario(kidnap, hint, time=0.14, seed=2)).x[-1] == pytest.approx(alone, abs=1e-6)


def test_each_wrong_hint_is_wrong_in_a_direction_of_its_own() -> None:
    hints = [{"kind": "wrong_hint", "at": 0.04, "off": 3.0}] * 2
    done = run(scenario(*hints, time=0.1))
    one, other = (m.hint.map_from_base.position for _, m in inboxes(done, PoseHint) if m.client)
    assert np.linalg.norm(one - other) > 0.1


def test_slipping_wheels_turn_faster_than_the_robot_drives_while_it_lasts() -> None:
    fault = {"kind": "wheel_slip", "at": 0.6, "lasting": 0.2, "factor": 4.0}
    done = run(scenario(fault), Forward())
    ratio = []
    for tick in done.ticks:
        (wheels,) = (r for r in tick.drive.sensed if isinstance(r, WheelSpeeds))
        ratio.append(0.5 * (wheels.left + wheels.right) / max(tick.truth.twist.linear[0], 1e-3))
    assert min(ratio[30:40]) > 2.0
    assert max(ratio[20:30]) < 1.5
    assert max(ratio[40:]) < 1.5


def scans(done: Run, scanner: str) -> list[Scan]:
    return [
        r
        for tick in done.ticks
        for r in tick.drive.sensed
        if isinstance(r, Scan) and r.scanner == scanner
    ]


@pytest.mark.parametrize(
    ("scanner", "silent"),
    [
        ("laser_horizontal", {"laser_horizontal"}),
        ("laser_vertical", {"laser_vertical"}),
        ("both", {"laser_horizontal", "laser_vertical"}),
    ],
)
def test_dead_scanner_is_silent_for_its_time_and_the_other_goes_on(
    scanner: str, silent: set[str]
) -> None:
    done = run(scenario({"kind": "scanner_dead", "at": 0.4, "lasting": 0.3, "scanner": scanner}))
    for name in ("laser_horizontal", "laser_vertical"):
        during = [s for s in scans(done, name) if s.end_stamp >= 4e8 and s.stamp < 7e8]
        assert bool(during) is (name not in silent)
        assert [s for s in scans(done, name) if s.end_stamp < 4e8]
        assert [s for s in scans(done, name) if s.stamp >= 7e8]


def test_dirt_covers_its_share_of_the_beams_for_its_time() -> None:
    fault = {"kind": "scanner_dirty", "at": 0.4, "lasting": 0.3, "share": 0.4}
    done, clean = run(scenario(fault)), run(scenario())
    pairs = list(
        zip(scans(done, "laser_horizontal"), scans(clean, "laser_horizontal"), strict=True)
    )
    for dirty, same in pairs:
        changed = ~(dirty.ranges == same.ranges) & ~(np.isnan(dirty.ranges) & np.isnan(same.ranges))
        if dirty.stamp >= 4e8 and dirty.end_stamp < 7e8:
            assert changed.mean() == pytest.approx(0.4, abs=0.02)
        elif dirty.end_stamp < 4e8 or dirty.stamp >= 7e8:
            assert not changed.any()


def test_box_stands_in_the_beams_for_its_time() -> None:
    fault = {"kind": "box", "at": 0.3, "to": [5.0, 4.0], "lasting": 0.4}
    ahead = [
        (scan.stamp, float(np.min(scan.ranges[np.abs(scan.angles) < 0.02])))
        for scan in scans(run(scenario(fault)), "laser_horizontal")
    ]
    assert all(near < 3.0 for stamp, near in ahead if 3.2e8 <= stamp <= 6e8)
    assert all(near > 3.0 for stamp, near in ahead if stamp < 1.9e8 or stamp >= 7.2e8)


def test_killed_operator_is_gone_and_the_robot_brakes_at_once() -> None:
    done = run(scenario({"kind": "operator_killed", "at": 0.5}), Forward())
    assert [time for time, _ in inboxes(done, Disconnected)] == [0.5]
    assert max(time for time, _ in inboxes(done, DriveCommand)) <= 0.5
    assert done.modes[24:26] == ["armed", "idle"]
    assert "stopped: " in " ".join(done.texts)


def test_operator_that_hangs_sends_nothing_and_the_watchdog_stops_the_robot() -> None:
    done = run(
        scenario({"kind": "operator_killed", "at": 0.4, "silent": True}, time=1.2), Forward()
    )
    assert inboxes(done, Disconnected) == []
    last = max(time for time, _ in inboxes(done, DriveCommand))
    assert last == pytest.approx(0.4)
    assert done.modes[int((last + 0.46) / TICK)] == "armed"
    assert done.modes[int((last + 0.52) / TICK)] == "disarmed"


def test_wrong_hint_is_as_far_off_as_it_says_and_of_a_second_operator() -> None:
    fault = {"kind": "wrong_hint", "at": 0.3, "off": 3.0, "turned": 90.0}
    done = run(scenario(fault, time=0.4), Forward())
    hints = [(time, m) for time, m in inboxes(done, PoseHint) if m.client]
    ((time, message),) = hints
    assert time == pytest.approx(0.3)
    assert message.client == "a second operator"
    off = message.hint.map_from_base.position - done.ticks[14].truth.map_from_base.position
    assert np.linalg.norm(off) == pytest.approx(3.0)
    assert abs(message.hint.map_from_base.yaw) == pytest.approx(math.pi / 2, abs=1e-3)


def test_hint_as_wrong_as_a_file_can_say_is_no_failure_of_the_run() -> None:
    fault = {"kind": "wrong_hint", "at": 0.04, "off": 99_999.0}
    start = {"known": "about", "off": 99_999.0}
    assert run(scenario(fault, start=start, time=0.2)).session.ending is not None


def test_clock_that_steps_moves_the_stamps_and_not_the_robots_time() -> None:
    done = run(scenario({"kind": "clock_step", "at": 0.5, "step": 60.0}), Forward())
    stamps = [(time, m.stamp, m.arrival) for time, m in inboxes(done, DriveCommand)]
    ahead = [(time, round((stamp - arrival) * 1e-9)) for time, stamp, arrival in stamps]
    offsets = {time > 0.51: offset for time, offset in ahead}
    assert offsets[True] - offsets[False] == 60


def test_pressed_estop_holds_until_it_is_released() -> None:
    done = run(scenario({"kind": "estop", "at": 0.3, "lasting": 0.3}), Forward())
    assert [time for time, _ in inboxes(done, EStop)] == pytest.approx([0.3])
    assert [time for time, _ in inboxes(done, EStopReset)] == pytest.approx([0.6])
    assert done.modes[14] == "armed"
    assert set(done.modes[15:30]) == {"estop"}
    assert "estop" not in done.modes[30:]


def test_estop_that_is_not_released_stays_to_the_end() -> None:
    done = run(scenario({"kind": "estop", "at": 0.3}), Forward())
    assert inboxes(done, EStopReset) == []
    assert set(done.modes[15:]) == {"estop"}


# Times at the edges


@pytest.mark.slow
def test_fault_of_no_duration_begins_before_it_ends() -> None:
    done = run(scenario({"kind": "estop", "at": 0.3, "lasting": 0.0}), Forward())
    kinds = [type(m) for m in done.ticks[15].inbox if isinstance(m, EStop | EStopReset)]
    assert kinds == [EStop, EStopReset]
    assert "estop" not in done.modes
    assert [t for t in done.texts if "e-stop" in t][:2] == [
        "a second operator presses the e-stop",
        "over: a second operator presses the e-stop",
    ]


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["wheel_slip", "scanner_dead", "scanner_dirty", "link"])
def test_fault_of_no_duration_does_no_harm(kind: str) -> None:
    chosen = scenario({"kind": kind, "at": 0.2, **KINDS[kind], "lasting": 0.0}, time=0.4)
    done = run(chosen, Forward())
    assert len(done.ticks) == 20
    assert sum("over: " in text for text in done.texts) == 1


@pytest.mark.parametrize("order", [1, -1])
def test_release_at_the_instant_of_another_press_does_not_undo_it(order: int) -> None:
    first = {"kind": "estop", "at": 0.1, "lasting": 0.2}
    second = {"kind": "estop", "at": 0.3}
    done = run(scenario(*[first, second][::order], time=0.6), Forward())
    assert set(done.modes[15:]) == {"estop"}


def test_fault_between_two_ticks_strikes_with_the_next_one() -> None:
    done = run(scenario({"kind": "estop", "at": 0.290000001}, time=0.4))
    assert [time for time, _ in inboxes(done, EStop)] == pytest.approx([0.3])
    assert done.time_of("a second operator presses") == pytest.approx(0.3)


def test_faults_at_the_very_start_strike_before_the_first_tick() -> None:
    done = run(
        scenario(
            {"kind": "kidnap", "at": 0.0, "to": "middle"},
            {"kind": "estop", "at": 0.0},
            {"kind": "wrong_hint", "at": 0.0},
            {"kind": "operator_killed", "at": 0.0},
            time=0.1,
        ),
        Forward(),
    )
    assert done.x[0] == pytest.approx(40.0, abs=0.01)
    assert done.modes[0] == "estop"
    assert [type(m) for m in done.ticks[0].inbox if not isinstance(m, PoseHint)][:1] == [EStop]
    first = done.session.referee.events[0]
    assert first.stamp == 0
    assert first.x == pytest.approx(2.5)


def test_fault_at_the_time_limit_comes_too_late() -> None:
    done = run(scenario({"kind": "estop", "at": 0.2}, {"kind": "kidnap", "at": 0.2}, time=0.2))
    assert done.modes == ["idle"] * 10
    assert not [e for e in done.session.referee.events if e.kind is EventKind.FAULT]


def test_fault_that_ends_behind_the_time_limit_only_begins() -> None:
    done = run(scenario({"kind": "estop", "at": 0.1, "lasting": 1000.0}, time=0.2))
    assert not [text for text in done.texts if text.startswith("over: ")]


def test_faults_of_one_instant_strike_in_the_order_of_the_file() -> None:
    places = ["quarter", "middle", "niche"]
    done = run(scenario(*[{"kind": "kidnap", "at": 0.1, "to": to} for to in places], time=0.2))
    assert done.x[-1] == pytest.approx(34.0, abs=0.01)
    carried = [text for text in done.texts if text.startswith("the robot is carried")]
    assert carried == [f"the robot is carried off to {place}" for place in places]


@pytest.mark.slow
@pytest.mark.parametrize(
    "kind", ["kidnap", "estop", "wrong_hint", "wheel_slip", "scanner_dirty", "clock_step", "link"]
)
def test_thousand_faults_at_one_instant_are_survived(kind: str) -> None:
    fields = {**KINDS[kind], **({"lasting": 0.1} if "lasting" in KINDS[kind] else {})}
    faults = [{"kind": kind, "at": 0.1, **fields}] * 1000
    done = run(scenario(*faults, time=0.3), Forward())
    assert len(done.ticks) == 15
    begun = [e for e in done.session.referee.events if e.kind is EventKind.FAULT]
    assert len(begun) == 1000 * (2 if "lasting" in fields else 1)
