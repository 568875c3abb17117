"""A scenario whose robot carries an arm: its operators have the arm's interface, and its runs repeat."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from teleop.scenario.operators.operator import Briefing, Operator
from teleop.scenario.operators.wire import Wire
from teleop.scenario.session.inbox_file import read_inboxes
from tests.teleop.scenario.session.support import digests, run, scenario


class Jogger(Operator):
    """Turns the arm's first joint."""

    def begin(self, wire: Wire, briefing: Briefing) -> None:
        """Need nothing."""

    def act(self, wire: Wire, now: int) -> None:
        """Send a rate with each tick."""
        rate = {"joint_names": ["arm_joint_1"], "velocities": [0.4]}
        wire.publish("/servo_node/delta_joint_cmds", "control_msgs/msg/JointJog", rate)


def test_operators_move_the_arm_and_the_run_repeats_to_the_bit(tmp_path: Path) -> None:
    chosen = scenario(world={"arm": "s2", "scanner": "none"})
    first = run(chosen, Jogger(), folder=tmp_path / "run")
    arm = first.ticks[-1].drive.arm
    assert arm is not None
    assert arm.wanted[0] > 0.25
    assert np.isfinite(arm.speed_limit), "off its stow pose"
    again = run(chosen, Jogger())
    assert digests(again.ticks, inboxes=False) == digests(first.ticks, inboxes=False)
    assert len(read_inboxes(tmp_path / "run" / "inbox.jsonl")) > 40


def test_speed_off_the_stow_pose_is_a_field_of_the_scenario() -> None:
    world = {"arm": "s2", "scanner": "none", "arm_speed": 0.35}
    arm = run(scenario(world=world), Jogger()).ticks[-1].drive.arm
    assert arm is not None
    assert arm.speed_limit == 0.35


def test_scenario_without_an_arm_has_none() -> None:
    (tick,) = run(scenario(world={"scanner": "none"}), ticks=1).ticks
    assert tick.drive.arm is None
