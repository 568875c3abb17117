"""An operator whose hand leads an arm from task to task, in runs of a scenario."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from localization.geometry import FloatArray
from robot_sim.arm.arm_table import load_arm
from teleop.robot.arm.arm_commands import Hand
from teleop.robot.arm.arm_state import ArmMode, ArmState
from teleop.robot.inbox import ArmWish
from teleop.scenario.operators.building import operator_of
from teleop.scenario.session.inbox_file import read_inboxes
from tests.teleop.scenario.session.support import Run, digests, run, scenario

pytestmark = pytest.mark.slow

READY = np.array(load_arm().poses["ready"])
QUIET: dict[str, Any] = {"noise": 0.0, "unrest": 0.0}


def done(*tasks: dict[str, Any], folder: Path | None = None, **more: Any) -> Run:
    """Return a run in which a hand does some tasks, from the arm's stow pose on."""
    traits: dict[str, Any] = {
        key: more.pop(key) for key in ("noise", "unrest", "planned") if key in more
    }
    world = {"arm": "s2", "scanner": "none", **more.pop("world", {})}
    operator = {"kind": "hand", "tasks": list(tasks), **traits}
    chosen = scenario(*more.pop("faults", ()), world=world, operator=operator, time=30.0, **more)
    return run(chosen, operator_of(chosen.operator, beside=None), folder=folder)


def arms(found: Run) -> Sequence[ArmState]:
    """Return the arm with each tick."""
    return [arm for tick in found.ticks if (arm := tick.drive.arm) is not None]


def tips(found: Run) -> FloatArray:
    return np.array([arm.tip.position for arm in arms(found)])


def test_hand_leads_the_tip_where_it_is_wanted_and_the_run_is_over() -> None:
    to = [0.26, 0.05, 0.08]
    found = done({"kind": "move", "to": "ready"}, {"kind": "reach", "to": to}, **QUIET)
    assert found.session.ending == "the operator is done"
    assert np.linalg.norm(tips(found)[-1] - to) < 0.005
    assert ArmMode.HAND in {arm.mode for arm in arms(found)}


def test_hand_in_circles_moves_the_tip_in_circles() -> None:
    tasks = ({"kind": "move", "to": "ready"}, {"kind": "sweep", "radius": 0.04, "lasting": 5})
    moved = tips(done(*tasks, **QUIET))[-120:]
    assert np.ptp(moved, axis=0) == pytest.approx([0.0, 0.08, 0.08], abs=0.012)


def test_drive_and_jog_last_as_long_as_they_say() -> None:
    rates = [0.4, 0.0, 0.0, 0.0, 0.0]
    found = done(
        {"kind": "jog", "rates": rates, "lasting": 1}, {"kind": "drive", "speed": 0.1, "lasting": 1}
    )
    assert arms(found)[-1].angles[0] == pytest.approx(0.4, abs=0.06)
    assert found.x[-1] - found.x[0] == pytest.approx(0.1, abs=0.04)


def test_joints_are_sent_as_they_are_and_refused_if_they_are_bad() -> None:
    good = {
        "kind": "joints",
        "times": [0, 2],
        "angles": [[0, 30, -120, 0, 0], [20, 60, -90, 0, -30]],
    }
    jump = {**good, "angles": [[60, 0, 0, 0, 0], [0, 0, 0, 0, 0]]}
    short = {**good, "angles": [[1, 2]]}
    found = done(good, jump, short)
    assert arms(found)[-1].angles == pytest.approx(READY + [math.radians(20), 0, 0, 0, 0], abs=0.03)
    assert found.session.referee.judged()[1]["arm_refused"] == 1


def test_lost_track_is_sent_as_the_task_says() -> None:
    found = done({"kind": "lose", "by": [0.5, 0.0, 0.0], "drift": 0.1}, **QUIET)
    wishes = [m.wish for tick in found.ticks for m in tick.inbox if isinstance(m, ArmWish)]
    hands = [wish for wish in wishes if isinstance(wish, Hand)]
    places = [h.pose.position[0] for h in hands if h.engaged and not h.tracked]
    assert 0.0 < max(places) <= 0.1
    assert hands[-2].pose.position[0] == pytest.approx(0.5)
    assert hands[-2].tracked
    assert not hands[-1].engaged


@pytest.mark.parametrize("planned", [False, True], ids=["by hand", "planned"])
def test_box_is_picked_and_put_and_the_run_repeats(planned: bool, tmp_path: Path) -> None:
    world = {"arm": "s2", "scanner": "none", "parcels": [{"name": "box", "at": [3.02, 4.0]}]}
    tasks = [
        {"kind": "grip", "opening": 0.06},
        {"kind": "move", "to": "ready"},
        {"kind": "pick", "at": [0.228, 0.0, -0.186], "down": 70},
        {"kind": "put", "at": [0.2, 0.1, -0.18], "down": 70},
    ]
    chosen = scenario(
        world=world, operator={"kind": "hand", "tasks": tasks, "planned": planned}, time=40.0
    )
    runs = [
        run(chosen, operator_of(chosen.operator, beside=None), folder=folder)
        for folder in (tmp_path / "run", None)
    ]
    figures = runs[0].session.referee.judged()[1]
    assert {n: figures[n] for n in ("picked", "dropped", "arm_contacts")} == {
        "picked": 1.0,
        "dropped": 0.0,
        "arm_contacts": 0.0,
    }
    assert 0.0 < figures["slip"] < 0.01
    assert [t for t in runs[0].texts if "box" in t] == ["picked up box", "let go of box"]
    assert digests(runs[0].ticks) == digests(runs[1].ticks)
    assert len(read_inboxes(tmp_path / "run" / "inbox.jsonl")) > 50
