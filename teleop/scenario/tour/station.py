"""A station in a process of its own, which has the map file and a socket, and nothing else.

``python -m teleop.scenario.tour.station`` connects, compares the maps, sends the hint, drives past the goals by Joy
messages from the received estimate, steps the robot in lockstep and records its display. Address, map file
and goals are in its environment, as for each client of a scenario, and its orders in ``FARSTEER_STATION``.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import signal
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np

from localization.maps.cloud import Cloud
from localization.maps.map_files import load_cloud
from localization.types import Pose
from teleop.clock import PERIOD
from teleop.errors import TeleopError
from teleop.operator.display.threaded_display import UnhurriedDisplay
from teleop.operator.operator_client import CAMERA, TOPICS, OperatorClient
from teleop.ros_types import registry
from teleop.rosbridge.client.client import Client
from teleop.scenario.tour_driver import DriverConfig, TourDriver

TICKS_PER_STEP = 5
"""Number of ticks between Joy messages: ten messages a second, as from a Unity scene with ROS#."""
_STATE = "/scenario/state"
"""The topic that says when the run is over."""


class StationError(TeleopError):
    """The orders cannot be followed; the message is one line."""


@dataclass(frozen=True, slots=True)
class Orders:
    """What the station is given besides address, map file and goals."""

    speed: float
    """Speed on straight stretches [m/s]."""
    hint_stamp: int
    """Robot time at which to send the hint [ns]."""
    hint_position: Sequence[float]
    """Position of the hinted pose in ``map``, x, y, z [m]."""
    hint_quaternion_wxyz: Sequence[float]
    """Orientation of the hinted pose in ``map``."""
    hint_covariance: Sequence[float]
    """Covariance of the hinted pose, 36 numbers row by row [m, rad]."""
    recording: str | None
    """File for the recording of the display (.rrd); None for no display."""
    camera: bool
    """Whether to watch the robot's camera."""

    @classmethod
    def read(cls, text: str) -> Self:
        """Read them from JSON."""
        return cls(**json.loads(text))

    async def give_hint(self, operator: OperatorClient) -> None:
        """Send the hint."""
        pose = Pose(np.array(self.hint_position), np.array(self.hint_quaternion_wxyz))
        await operator.hint(pose, np.array(self.hint_covariance).reshape(6, 6))

    def display(self, cloud: Cloud) -> UnhurriedDisplay | None:
        """Return the display that is recorded, if one is."""
        if self.recording is None:
            return None
        # Imported here, since a drive that is not recorded needs no rerun.
        from localization.display.rerun_sink import Sink
        from teleop.operator.display.display import Display

        sink = Sink(file=Path(self.recording))
        return UnhurriedDisplay(Display(cloud, sink=sink, camera=self.camera))


async def operate(
    url: str, map_file: str, way: Sequence[tuple[float, float]], orders: Orders
) -> None:
    """Drive past the way-points until the run is over.

    Args:
        url: Address of the robot.
        map_file: File of the map (PLY).
        way: Way-points (x, y) in ``map`` [m].
        orders: The orders.

    Raises:
        StationError: If the maps differ or the robot does not step.
    """
    cloud = load_cloud(map_file)
    display = orders.display(cloud)
    # In lockstep a step may take long; if the robot's process ends, so does the socket.
    client = Client(url, registry=registry(), reconnect=False, keepalive=None, timeout=60.0)
    topics = {**TOPICS, **CAMERA} if orders.camera else TOPICS
    operator = OperatorClient(client, cloud, display, topics=topics)
    robot = _SteppedRobot(operator, display)
    try:
        await client.connect()
        await operator.start()
        await client.subscribe(_STATE, "farsteer_msgs/msg/ScenarioState", robot.receive)
        await robot.step(1)
        if operator.map_mismatch or not operator.map_sha256:
            raise StationError(
                operator.map_mismatch or "the robot has not published the hash of its map"
            )
        await _drive(robot, TourDriver(way, DriverConfig(speed=orders.speed)), orders)
    finally:
        await client.close()
        if display is not None:
            display.close()


@dataclass(slots=True)
class _SteppedRobot:
    """The robot in lockstep, and what shows it."""

    operator: OperatorClient
    display: UnhurriedDisplay | None
    over: bool = False
    """Whether the run is over."""

    def receive(self, message: Mapping[str, Any]) -> None:
        """Take a message of the topic that says whether it is."""
        self.over = message["phase"] == "over"

    async def step(self, ticks: int) -> None:
        """Step it; what was received before is drawn meanwhile."""
        if self.display is not None:
            asyncio.get_running_loop().call_soon(self.display.draw)  # once the call has been sent
        failure = await self.operator.step(ticks)
        if failure is not None and not self.over:
            raise StationError(f"the robot does not step: {failure}")


async def _drive(robot: _SteppedRobot, driver: TourDriver, orders: Orders) -> None:
    hinted, operator = False, robot.operator
    while not robot.over:
        if not hinted and operator.now >= orders.hint_stamp:
            hinted = True
            await orders.give_hint(operator)
        twist = driver.command(operator.map_from_base, operator.health)
        await operator.drive(twist, enabled=True)
        await robot.step(TICKS_PER_STEP - operator.now // PERIOD % TICKS_PER_STEP)


async def _operate_until_terminated() -> None:
    """Follow the environment's orders; on SIGTERM, complete the recording before the process ends."""
    task = asyncio.current_task()
    if task is not None:
        with contextlib.suppress(NotImplementedError, RuntimeError, ValueError):
            asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, task.cancel)
    told = os.environ
    way = [(float(x), float(y)) for x, y, _ in json.loads(told["FARSTEER_GOALS"])]
    orders = Orders.read(told["FARSTEER_STATION"])
    await operate(told["FARSTEER_URL"], told["FARSTEER_MAP"], way, orders)


def main() -> int:
    """Follow the orders of the environment, which a run of a scenario gives."""
    # The robot waits for the main thread, which must not wait 5 ms for the thread of the display.
    sys.setswitchinterval(0.0005)
    try:
        asyncio.run(_operate_until_terminated())
    except (KeyboardInterrupt, asyncio.CancelledError):
        return 130
    except KeyError as error:
        sys.stderr.write(f"station: {error.args[0]} is not set; `farsteer sim` starts a station\n")
        return 2
    except (StationError, ValueError, OSError, RuntimeError) as error:
        sys.stderr.write(f"station: {error}\n")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
