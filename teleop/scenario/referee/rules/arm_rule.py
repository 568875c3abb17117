"""What the rules of an arm share: they look at its state, and are kept where there is none."""

from __future__ import annotations

from typing import Final

from teleop.robot.arm.arm_commands import ArmTwist, Hand, JointJog, Stream, TipTarget
from teleop.robot.arm.arm_state import ArmState
from teleop.robot.inbox import ArmWish
from teleop.robot.tick_record import TickRecord
from teleop.scenario.referee.rules.rule import Rule

_STREAMS: Final = (Hand, ArmTwist, JointJog, TipTarget)


class ArmRule(Rule):
    """A rule that looks at the arm."""

    def take(self, tick: TickRecord) -> str | None:
        """See ``Rule.take``."""
        arm = tick.drive.arm
        return None if arm is None or self.facts.arm is None else self.look(tick, arm)

    def look(self, tick: TickRecord, arm: ArmState) -> str | None:
        """Return how the rule is broken with this tick; None if it is not."""
        raise NotImplementedError

    @staticmethod
    def streams(tick: TickRecord) -> list[Stream]:
        """Return the commands of a tick of the one who has the robot."""
        return [
            m.wish
            for m in tick.inbox
            if isinstance(m, ArmWish)
            and m.client == tick.control.controller
            and isinstance(m.wish, _STREAMS)
        ]
