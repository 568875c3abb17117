"""A scripted operator as a process of its own: it has the map file and a socket, and nothing else.

``python -m teleop.scenario.scripted_operator script.json`` connects, compares maps, gives the hint, drives the
tour by Joy from what it receives, steps the robot in lockstep and records its display.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import signal
import sys
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from localization.display.rerun_sink import Sink
from localization.maps.map_files import load_cloud
from localization.types import SECOND, Pose
from teleop.interfaces import registry
from teleop.operator.display import Display
from teleop.operator.operator_client import Station
from teleop.operator.threaded_display import Aside
from teleop.rosbridge.client.client import Client
from teleop.scenario.tour_driver import TourDriver

TICKS_PER_STEP = 5
"""The operator looks and steers ten times a second, as a Unity scene with ROS# does."""
_TICK = 20_000_000


class OperatorError(RuntimeError):
    """The operator cannot do its work; one line says why."""


@dataclass(frozen=True, slots=True)
class Script:
    """What the scripted operator is told; it knows nothing else of the mission."""

    url: str
    map_path: str
    tour: tuple[tuple[float, float], ...]
    hint_stamp: int
    """When to give the hint [ns]."""
    hint_position: tuple[float, float, float]
    hint_quaternion_wxyz: tuple[float, float, float, float]
    hint_covariance: tuple[float, ...]
    """36 numbers, row by row."""
    duration: float | None
    """Stop after so much robot time [s]."""
    recording: str | None
    """Where the display is recorded (.rrd)."""

    def save(self, path: Path) -> None:
        """Write it as JSON."""
        path.write_text(json.dumps(asdict(self), indent=2) + "\n", encoding="utf-8")

    @classmethod
    def load(cls, path: Path) -> Script:
        """Read what ``save`` wrote."""
        values = json.loads(path.read_text(encoding="utf-8"))
        values["tour"] = tuple((float(x), float(y)) for x, y in values["tour"])
        for name in ("hint_position", "hint_quaternion_wxyz", "hint_covariance"):
            values[name] = tuple(values[name])
        return cls(**values)

    @property
    def hint(self) -> Pose:
        """The hint's pose."""
        return Pose(np.array(self.hint_position), np.array(self.hint_quaternion_wxyz))

    def over(self, now: int) -> bool:
        """Return whether the time for the tour is up."""
        return self.duration is not None and now >= self.duration * SECOND


async def operate(script: Script) -> None:
    """Do what the script says.

    Raises:
        OperatorError: if the maps differ or the robot does not step.
    """
    cloud = load_cloud(script.map_path)
    display = None
    if script.recording is not None:
        display = Aside(Display(cloud, sink=Sink(file=Path(script.recording))), patient=True)
    # In lockstep the robot may think for long; a dead one ends the socket.
    client = Client(script.url, registry=registry(), reconnect=False, keepalive=None, timeout=60.0)
    station = Station(client, cloud, display)
    driver = TourDriver(script.tour)
    hinted = False
    try:
        await client.connect()
        await station.start()
        await _step(station, 1)
        if station.map_complaint or not station.map_sha256:
            raise OperatorError(station.map_complaint or "the robot does not say what map it has")
        while not driver.done and not script.over(station.now):
            if not hinted and station.now >= script.hint_stamp:
                hinted = True
                await station.hint(script.hint, np.array(script.hint_covariance).reshape(6, 6))
            twist = driver.command(station.map_from_base, station.health)
            await station.drive(twist, enabled=True)
            await _step(station, TICKS_PER_STEP - station.now // _TICK % TICKS_PER_STEP)
    finally:
        await client.close()
        if display is not None:
            display.close()


async def _until_told(script: Script) -> None:
    """Do what the script says; told to terminate, end the recording before the process."""
    task = asyncio.current_task()
    if task is not None:
        with contextlib.suppress(NotImplementedError, RuntimeError, ValueError):
            asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, task.cancel)
    await operate(script)


async def _step(station: Station, ticks: int) -> None:
    complaint = await station.step(ticks)
    if complaint is not None:
        raise OperatorError(f"the robot does not step: {complaint}")


def main() -> int:
    """Read the script named on the command line and follow it."""
    try:
        asyncio.run(_until_told(Script.load(Path(sys.argv[1]))))
    except (KeyboardInterrupt, asyncio.CancelledError):
        return 130
    except (OperatorError, ValueError, OSError, RuntimeError) as error:
        sys.stderr.write(f"operator: {error}\n")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
