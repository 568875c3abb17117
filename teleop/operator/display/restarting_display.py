"""A display that starts anew with each run of the robot: another run is another recording."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from localization.geometry import FloatArray
from localization.maps.cloud import Cloud
from localization.types import Pose
from teleop.operator.display.display import Display
from teleop.operator.robot_state.robot_run import RobotRun
from teleop.operator.robot_state.station_view import Pulse

_LATCHED = ("/tf_static", "/map_info", "/drive_limits")


def recording_of(file: Path, run: int) -> Path:
    """Return the file for a run, counted from 1: the given one, then ``name-2.rrd`` and so on that do not exist."""
    number = run
    while number > 1 and (other := file.with_stem(f"{file.stem}-{number}")).exists():
        number += 1
    return file if run == 1 else other


class RestartingDisplay:
    """Shows each run of the robot on a display of its own; only the newest one is drawn on."""

    def __init__(self, make: Callable[[int], Display]) -> None:
        """Open the first display.

        Args:
            make: Returns a display for a run, counted from 1.
        """
        self._make, self._runs = make, 1
        self._display = make(1)
        self._run = RobotRun()
        self._latched: dict[str, Mapping[str, Any]] = {}
        self._cloud: Cloud | None = None
        self._link: tuple[bool, str] | None = None

    @property
    def runs(self) -> int:
        """Number of runs that were shown."""
        return self._runs

    def show(self, topic: str, message: Mapping[str, Any]) -> None:
        """Draw a message of a topic; it may be the first of another run."""
        self._run, anew = self._run.after(topic, message)
        if anew:
            self._begin_anew()
        if topic in _LATCHED:
            self._latched[topic] = message
        self._display.show(topic, message)

    def command(self, forward: float, turn: float, deadman: bool, stamp: int) -> None:
        """Draw the velocity that this operator requests."""
        self._display.command(forward, turn, deadman, stamp)

    def hint(self, map_from_base: Pose, covariance: FloatArray, stamp: int) -> None:
        """Draw the hint that this operator sends."""
        self._display.hint(map_from_base, covariance, stamp)

    def link(self, *, connected: bool, text: str, stamp: int) -> None:
        """Draw that the connection was established or lost."""
        self._link = connected, text
        if not connected:
            # The robot sends these again on the next connection, or another robot sends its own.
            self._latched.clear()
        self._display.link(connected=connected, text=text, stamp=stamp)

    def map(self, cloud: Cloud) -> None:
        """Draw a map, if it is the robot's."""
        self._cloud = cloud
        self._display.map(cloud)

    def pulse(self, pulse: Pulse) -> None:
        """Draw what is stale, and the banner."""
        self._display.pulse(pulse)

    def close(self) -> None:
        """End the display."""
        self._display.close()

    def _begin_anew(self) -> None:
        self._display.close()
        self._runs += 1
        self._display = self._make(self._runs)
        for topic, message in self._latched.items():
            self._display.show(topic, message)
        if self._cloud is not None:
            self._display.map(self._cloud)
        if self._link is not None:
            connected, text = self._link
            self._display.link(connected=connected, text=text, stamp=0)
