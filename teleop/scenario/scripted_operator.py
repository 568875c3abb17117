"""A scripted operator in a process of its own, which has the map file and a socket, and nothing else.

``python -m teleop.scenario.scripted_operator script.json`` connects, compares the maps, sends the hint, drives
the tour by Joy messages from the received estimate, steps the robot in lockstep and records its display.
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

from localization.maps.map_files import load_cloud
from localization.types import SECOND, Pose
from teleop.errors import TeleopError
from teleop.interfaces import registry
from teleop.operator.display.threaded_display import ThreadedDisplay
from teleop.operator.operator_client import CAMERA, TOPICS, OperatorClient
from teleop.rosbridge.client.client import Client
from teleop.scenario.tour_driver import TourDriver

TICKS_PER_STEP = 5
"""Number of ticks between Joy messages: ten messages a second, as from a Unity scene with ROS#."""
_TICK = 20_000_000
"""Duration of a tick [ns]."""


class ScriptError(TeleopError):
    """The script cannot be followed; the message is one line."""


@dataclass(frozen=True, slots=True)
class OperatorScript:
    """Instructions for the scripted operator; it knows nothing else of the mission."""

    url: str
    """Address of the robot."""
    map_path: str
    """File of the map (PLY)."""
    tour: tuple[tuple[float, float], ...]
    """Way-points (x, y) in ``map`` [m]."""
    hint_stamp: int
    """Robot time at which to send the hint [ns]."""
    hint_position: tuple[float, float, float]
    """Position of the hinted pose in ``map`` [m]."""
    hint_quaternion_wxyz: tuple[float, float, float, float]
    """Orientation of the hinted pose in ``map``."""
    hint_covariance: tuple[float, ...]
    """Covariance of the hinted pose, 36 numbers row by row [m, rad]."""
    duration: float | None
    """Robot time after which to stop [s]; None to drive the whole tour."""
    recording: str | None
    """File for the recording of the display (.rrd); None for no display."""
    camera: bool = False
    """Whether to watch the robot's camera."""

    def save(self, path: Path) -> None:
        """Write it as JSON."""
        path.write_text(json.dumps(asdict(self), indent=2) + "\n", encoding="utf-8")

    @classmethod
    def load(cls, path: Path) -> OperatorScript:
        """Read what ``save`` wrote."""
        values = json.loads(path.read_text(encoding="utf-8"))
        values["tour"] = tuple((float(x), float(y)) for x, y in values["tour"])
        for name in ("hint_position", "hint_quaternion_wxyz", "hint_covariance"):
            values[name] = tuple(values[name])
        return cls(**values)

    @property
    def hint(self) -> Pose:
        """The hinted pose, ``map_from_base``."""
        return Pose(np.array(self.hint_position), np.array(self.hint_quaternion_wxyz))

    def over(self, now: int) -> bool:
        """Return whether the duration has passed at a robot time [ns]."""
        return self.duration is not None and now >= self.duration * SECOND


async def operate(script: OperatorScript) -> None:
    """Follow the script.

    Raises:
        OperatorError: if the maps differ or the robot does not step.
    """
    cloud = load_cloud(script.map_path)
    display = None
    if script.recording is not None:
        # Imported here, since a drive that is not recorded needs no rerun.
        from localization.display.rerun_sink import Sink
        from teleop.operator.display.display import Display

        display = ThreadedDisplay(
            Display(cloud, sink=Sink(file=Path(script.recording)), camera=script.camera),
            blocking=True,
        )
    # In lockstep a step may take long; if the robot's process ends, so does the socket.
    client = Client(script.url, registry=registry(), reconnect=False, keepalive=None, timeout=60.0)
    topics = {**TOPICS, **CAMERA} if script.camera else TOPICS
    operator = OperatorClient(client, cloud, display, topics=topics)
    driver = TourDriver(script.tour)
    hinted = False
    try:
        await client.connect()
        await operator.start()
        await _step(operator, 1)
        if operator.map_mismatch or not operator.map_sha256:
            raise ScriptError(
                operator.map_mismatch or "the robot has not published the hash of its map"
            )
        while not driver.done and not script.over(operator.now):
            if not hinted and operator.now >= script.hint_stamp:
                hinted = True
                await operator.hint(script.hint, np.array(script.hint_covariance).reshape(6, 6))
            twist = driver.command(operator.map_from_base, operator.health)
            await operator.drive(twist, enabled=True)
            await _step(operator, TICKS_PER_STEP - operator.now // _TICK % TICKS_PER_STEP)
    finally:
        await client.close()
        if display is not None:
            display.close()


async def _operate_until_terminated(script: OperatorScript) -> None:
    """Follow the script; on SIGTERM, complete the recording before the process ends."""
    task = asyncio.current_task()
    if task is not None:
        with contextlib.suppress(NotImplementedError, RuntimeError, ValueError):
            asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, task.cancel)
    await operate(script)


async def _step(operator: OperatorClient, ticks: int) -> None:
    failure = await operator.step(ticks)
    if failure is not None:
        raise ScriptError(f"the robot does not step: {failure}")


def main() -> int:
    """Read the script named on the command line and follow it."""
    # The robot waits for the main thread, which must not wait 5 ms for the thread of the display.
    sys.setswitchinterval(0.0005)
    try:
        asyncio.run(_operate_until_terminated(OperatorScript.load(Path(sys.argv[1]))))
    except (KeyboardInterrupt, asyncio.CancelledError):
        return 130
    except (ScriptError, ValueError, OSError, RuntimeError) as error:
        sys.stderr.write(f"operator: {error}\n")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
