"""Lanes of states, plots of numbers, and the log of events."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from typing import Final

import rerun as rr

from teleop.operator import colours as palette
from teleop.operator.colours import ORANGE, SKY, WHITE, YELLOW, Colour
from teleop.operator.rerun_blueprint import LANES, LEGEND, LOG, PLOTS
from teleop.operator.rerun_sink import Canvas


class Level(StrEnum):
    """How much an event matters."""

    INFO = "INFO"
    WARNING = "WARN"
    ALARM = "ERROR"


LANE_COLOURS: Final = {
    "health": palette.HEALTH,
    "control": palette.CONTROL,
    "deadman": palette.DEADMAN,
    "link": palette.LINK,
    "map": palette.MAP,
}
"""Every lane with the states it knows; an unknown one gets a colour of the viewer's."""

SERIES: Final[dict[str, tuple[str, Colour]]] = {
    "position/sigma": ("sigma", SKY),
    "position/error": ("true error (simulation only)", WHITE),
    "fit/fit": ("fit", SKY),
    "nis/nis": ("NIS", SKY),
    "speed/stick": ("my stick", YELLOW),
    "speed/command": ("command in force", ORANGE),
    "speed/measured": ("measured", SKY),
}
"""Every curve by its path under ``plots``, with its name and colour."""


_LEGEND: Final = f"""\
**Grey** the prebuilt map, lighter with height. **Live points** by their distance to it: **teal** none,
green to **yellow** {palette.DISTANCE_FULL} m or more, **pink** nothing is mapped near. Live points beside
the map's walls mean that the pose is wrong: give a hint.

**Red robot, white bar ahead** the estimate. **Ellipse and wedge** its 95 % bounds, in the colour of its health.
**Blue path** the estimate, **white rim** the truth, if a simulation publishes it.

**Orange ghost and ring** a hint and the 95 % of its window; then green accepted, blue kept, orange ambiguous, red
rejected, and an arrow to the pose that was taken.
"""


class Instruments:
    """Writes lanes, plots and log at whatever time the stream stands."""

    def __init__(
        self,
        canvas: Canvas,
        lanes: Mapping[str, Mapping[str, Colour]] = LANE_COLOURS,
        series: Mapping[str, tuple[str, Colour]] = SERIES,
        legend: str = _LEGEND,
    ) -> None:
        """Declare lanes with the colours of their states, curves with name and colour, and the legend."""
        self._canvas = canvas
        self._states: dict[str, str] = {}
        document = rr.TextDocument(legend, media_type=rr.MediaType.MARKDOWN)
        canvas.draw(LEGEND, document, static=True)
        for lane, colours in lanes.items():
            states = rr.StateConfiguration(
                values=list(colours), colors=[(*c, 255) for c in colours.values()]
            )
            canvas.draw(f"{LANES}/{lane}", states, static=True)
        for path, (name, colour) in series.items():
            line = rr.SeriesLines(names=[name], colors=[colour], widths=[1.5])
            canvas.draw(f"{PLOTS}/{path}", line, static=True)

    def is_new(self, lane: str, state: str) -> bool:
        """Return whether a state is not the one that a lane is in."""
        return self._states.get(lane) != state

    def state(self, lane: str, state: str) -> bool:
        """Note the state of a lane; return whether it is a new one."""
        if not self.is_new(lane, state):
            return False
        self._states[lane] = state
        self._canvas.draw(f"{LANES}/{lane}", rr.StateChange(state=state))
        return True

    def plot(self, path: str, value: float) -> None:
        """Add a point to a curve."""
        self._canvas.draw(f"{PLOTS}/{path}", rr.Scalars(value))

    def event(self, text: str, level: Level = Level.INFO) -> None:
        """Add a line to the log."""
        self._canvas.draw(LOG, rr.TextLog(text, level=level.value))
