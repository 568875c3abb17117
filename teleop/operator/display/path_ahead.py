"""Where the robot will go, drawn before it: the way to where a command sent now takes effect, and the stick's path."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final, Literal, TypeAlias

import rerun as rr

from localization.display.colours import GREY, ORANGE, SKY, Colour
from localization.display.entity_paths import BASE
from localization.display.rerun_sink import Canvas
from localization.types import SECOND
from teleop.operator.message_decoding import Message
from teleop.prediction.command_history import CommandHistory, Followed
from teleop.prediction.foresight import foreseen
from teleop.prediction.predicted_motion import Command, DriveLimits, Motion

PathWhen: TypeAlias = Literal["late", "always", "never"]
"""When the path is drawn: ``late`` while the round trip is over 0.2 s."""

LATE: Final = 0.2
"""Round trip from which driving becomes worse [s]: 200 to 300 ms (Chen et al., arXiv 2508.18074, 10 people)."""
_AHEAD: Final = f"{BASE}/ahead"
_LIFT: Final = 0.05
"""Height of the lines over the floor [m]."""


class PathAhead:
    """Owns what is known of the commands; a robot without `/drive_limits` has no path."""

    def __init__(self, canvas: Canvas, when: PathWhen) -> None:
        """Draw on a canvas."""
        self._canvas, self._when = canvas, when
        self._history = CommandHistory()
        self._limits: DriveLimits | None = None
        self._newest = 0.0
        self._drawn = False
        self.round_trip = 0.0
        """Measured last [s]."""

    def limits(self, message: Message, _: int) -> None:
        """Take ``/drive_limits``."""
        self._limits = DriveLimits(**{name: float(value) for name, value in message.items()})

    def state(self, message: Message, stamp: int) -> None:
        """Take ``/teleop/state`` of a stamp [ns]."""
        at = stamp / SECOND
        self._newest = max(self._newest, at)
        guard, late = (float(message.get(name, 1.0)) for name in ("guard_factor", "late_factor"))
        ahead = float(message.get("guard_ahead", float("inf")))
        command = Command(at, float(message["linear"]), float(message["angular"]))
        self._history.followed(Followed(command, guard, late, ahead))

    def sent(self, forward: float, turn: float) -> None:
        """Take what this operator sends now [m/s, rad/s]."""
        self._history.sent(Command(self._newest + self.round_trip, forward, turn))

    def draw(self, stamp: int) -> None:
        """Draw the path from the pose of a stamp [ns] on."""
        at = stamp / SECOND
        self._newest = max(self._newest, at)
        wanted = self._when == "always" or (self._when == "late" and self.round_trip > LATE)
        if not wanted or self._limits is None or self._history.newest is None:
            if self._drawn:
                self._canvas.draw(_AHEAD, rr.Clear(recursive=True))
                self._drawn = False
            return
        shown = foreseen(self._history, at, self._newest + self.round_trip, self._limits)
        self._line("committed", shown.motions[: shown.effect + 1], GREY)
        self._line("path", shown.motions[shown.effect :], ORANGE if shown.cut else SKY)
        self._drawn = True

    def _line(self, name: str, motions: Iterable[Motion], colour: Colour) -> None:
        points = [(motion.x, motion.y, _LIFT) for motion in motions]
        line = rr.LineStrips3D([points], colors=[colour], radii=rr.Radius.ui_points(2.5))
        self._canvas.draw(f"{_AHEAD}/{name}", line)
