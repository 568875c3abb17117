"""What is shown of the future: the way to where a command sent now takes effect, and the path of the stick as it is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from teleop.prediction.command_history import CommandHistory, alike
from teleop.prediction.predicted_motion import TICK, DriveLimits, Motion, predicted

SECONDS: Final = 3.0
"""Length of the path [s]: at 0.7 m/s 2.1 m, less than the guard sees; chosen."""


@dataclass(frozen=True, slots=True)
class Foresight:
    """Motions tick by tick, from the known pose on, in its frame."""

    motions: tuple[Motion, ...]
    """All of them."""
    effect: int
    """Index of the one at which a command that is sent now takes effect; beyond the end where the guard stops before."""
    cut: bool
    """Whether the guard would end the path."""


def foreseen(
    history: CommandHistory, stamp: float, effect: float, limits: DriveLimits
) -> Foresight:
    """Return what is shown.

    Args:
        history: What the robot follows and will follow.
        stamp: Time of the known pose, by the robot's clock [s].
        effect: Time at which a command that is sent now takes effect [s].
        limits: The drive's.
    """
    commands = history.commands()
    motions = tuple(predicted(Motion(0.0, 0.0, 0.0), stamp, commands, effect + SECONDS, limits))
    end = _stopped_at(history, stamp, motions)
    return Foresight(motions[:end], round((effect - stamp) / TICK), end < len(motions))


def _stopped_at(history: CommandHistory, stamp: float, motions: tuple[Motion, ...]) -> int:
    """Return how many of the motions the guard would let pass, as far as it has looked along their arc."""
    newest, asked, gone = history.newest, history.asked, 0.0
    if newest is None or asked is None or not alike(history.stick, asked):
        return len(motions)
    straight = abs(asked.forward) > 0.1 * abs(asked.turn)
    whole = abs(asked.forward if straight else asked.turn)
    for index, motion in enumerate(motions):
        if stamp + index * TICK > newest.command.at:
            gone += TICK * abs(motion.forward if straight else motion.turn) / whole
        if gone > newest.ahead:
            return index
    return len(motions)
