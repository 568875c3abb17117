"""Time plots of the display: lanes of states, curves of numbers, and the list of events."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum

import rerun as rr

from localization.display.colours import Colour
from localization.display.entity_paths import LANES, LEGEND, LOG, PLOTS
from localization.display.rerun_sink import Canvas


class Level(StrEnum):
    """Severity of an event."""

    INFO = "INFO"
    WARNING = "WARN"
    ALARM = "ERROR"


class TimePlots:
    """Writes lanes, curves and events at the present time of the canvas."""

    def __init__(
        self,
        canvas: Canvas,
        lanes: Mapping[str, Mapping[str, Colour]],
        series: Mapping[str, tuple[str, Colour]],
        legend: str,
    ) -> None:
        """Declare lanes and curves.

        Args:
            canvas: Canvas to draw on.
            lanes: Colours of the states of each lane, by lane and state.
            series: Name and colour of each curve, by its path.
            legend: Markdown text of the legend.
        """
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
        """Return whether a state differs from the present one of a lane."""
        return self._states.get(lane) != state

    def state(self, lane: str, state: str) -> bool:
        """Set the state of a lane; return whether it changed."""
        if not self.is_new(lane, state):
            return False
        self._states[lane] = state
        self._canvas.draw(f"{LANES}/{lane}", rr.StateChange(state=state))
        return True

    def plot(self, path: str, value: float) -> None:
        """Add a point to a curve."""
        self._canvas.draw(f"{PLOTS}/{path}", rr.Scalars(value))

    def event(self, text: str, level: Level = Level.INFO) -> None:
        """Add an event."""
        self._canvas.draw(LOG, rr.TextLog(text, level=level.value))
