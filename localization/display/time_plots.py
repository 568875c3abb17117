"""Lanes of states, plots of numbers, and the log of events."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum

import rerun as rr

from localization.display.colours import Colour
from localization.display.entity_paths import LANES, LEGEND, LOG, PLOTS
from localization.display.rerun_sink import Canvas


class Level(StrEnum):
    """How much an event matters."""

    INFO = "INFO"
    WARNING = "WARN"
    ALARM = "ERROR"


class Instruments:
    """Writes lanes, plots and log at whatever time the stream stands."""

    def __init__(
        self,
        canvas: Canvas,
        lanes: Mapping[str, Mapping[str, Colour]],
        series: Mapping[str, tuple[str, Colour]],
        legend: str,
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
