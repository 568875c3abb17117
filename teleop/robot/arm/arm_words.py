"""What the arm does and why, in words for people and in the codes of MoveIt Servo."""

from __future__ import annotations

from typing import Final

from teleop.robot.arm.arm_commands import ArmTwist, Hand, JointJog, Stream, TipTarget
from teleop.robot.arm.arm_state import ArmMode, ServoCode
from teleop.robot.arm.hand_control import HandStep
from teleop.robot.arm.hindrance import Hindrance

MODES: Final[dict[type[Stream], tuple[ArmMode, str]]] = {
    Hand: (ArmMode.HAND, "follows the hand"),
    ArmTwist: (ArmMode.TWIST, "its tip moves as wanted"),
    JointJog: (ArmMode.JOG, "its joints move as wanted"),
    TipTarget: (ArmMode.POSE, "is led to a pose"),
}
"""Mode and words while a command of a kind is followed without hindrance."""
_CODES: Final = {
    Hindrance.REACH: ServoCode.JOINT_BOUND,
    Hindrance.LIMIT: ServoCode.JOINT_BOUND,
    Hindrance.SINGULAR: ServoCode.SINGULARITY,
}
WAYS_OUT: Final = {
    "turn_over": "turn the wrist over",
    "back_off": "move away from what is near",
    "stow": "fold the arm",
}
"""What each way out does."""


def servo_code(step: HandStep, *, moved: bool, refused: bool) -> ServoCode:
    """Return the state as MoveIt Servo reports it.

    Args:
        step: What was done in the tick.
        moved: Whether an operator moves the arm.
        refused: Whether a command was refused.
    """
    if refused:
        return ServoCode.INVALID
    if not moved:
        return ServoCode.NO_WARNING
    hindrance, share = step.finding.hindrance, step.share
    if share < 1.0 or hindrance is Hindrance.NEAR:
        return ServoCode.HALTED_FOR_COLLISION if share == 0.0 else ServoCode.SLOWED_FOR_COLLISION
    return _CODES.get(hindrance, ServoCode.NO_WARNING)
