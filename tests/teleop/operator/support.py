"""A drive as its clients see it, without a socket; what is in a recording; a viewer without a screen."""

from __future__ import annotations

import os
import socket
import subprocess
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import pytest
from rerun.chunk import RrdReader
from rerun.experimental import ViewerClient

from localization.display.rerun_sink import viewer_program
from localization.maps.cloud import Cloud
from localization.maps.prepared_map import prepare
from localization.pipeline.localizer import Localizer
from localization.types import SECOND, Hint, Twist
from robot_sim import Simulation, World
from teleop.joystick import VelocityRequest
from teleop.operator.display.display import Display
from teleop.robot.drive import Drive
from teleop.robot.inbox import DriveCommand, EStop, EStopReset, InboxMessage, PoseHint
from teleop.robot.robot import Robot
from teleop.robot.tick_record import TickRecord
from teleop.robot.topics.topic_table import DRIVE_OUTPUTS, ESTIMATE_OUTPUTS, latched_messages
from teleop.scenario.files.operator_settings import Station
from teleop.scenario.session.station import HINT_STAMP, station_hint
from teleop.scenario.tour_driver import TourDriver

Published: TypeAlias = tuple[str, dict[str, Any]]
"""A topic and a message on it."""

_NEUTRAL = VelocityRequest(Twist.planar(0.0, 0.0), enabled=True)


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """One tick: what the operator did before it, and what the robot published in it."""

    stamp: int
    """At the tick's end [ns]."""
    command: Twist
    hint: Hint | None
    published: tuple[Published, ...]


def drive(
    world: World,
    cloud: Cloud,
    cache: Path,
    *,
    seconds: float,
    estop: tuple[float, float] = (1e9, 1e9),
) -> Iterator[Moment]:
    """Drive the tour from seed 0, with a hint after a second.

    Args:
        world: where.
        cloud: its map.
        cache: folder for derived files.
        seconds: how long; less if the tour ends before.
        estop: when the e-stop is pressed and when it is released [s].
    """
    simulation = Simulation(world, seed=0)
    robot = Robot(Drive(simulation), Localizer(prepare(cloud, cache=cache), simulation.mounts))
    driver = TourDriver(world.tour)
    hint = station_hint(Station("station"), 0, simulation.truth().map_from_base)
    latched: tuple[Published, ...] = tuple(
        (kind.name, message)
        for kind, message in latched_messages(
            cloud, simulation.world.robot, simulation.mounts
        ).items()
    )
    inbox: list[InboxMessage] = [DriveCommand("test", _NEUTRAL)]
    twist = Twist.planar(0.0, 0.0)
    number = 0
    while not driver.done and simulation.stamp < seconds * SECOND:
        given = hint if simulation.stamp == HINT_STAMP else None
        tick = robot.tick(
            simulation.stamp, inbox if given is None else [*inbox, PoseHint("test", given)]
        )
        published = list(_published(tick))
        yield Moment(tick.stamp, twist, given, (*latched, *published))
        latched, number = (), number + 1
        estimate = tick.estimate
        twist = driver.command(estimate.map_from_base, estimate.health)
        now = simulation.stamp / SECOND
        if estop[0] <= now < estop[1]:
            inbox = [EStop("test")]
        elif estop[1] <= now < estop[1] + 0.02:
            inbox = [EStopReset("test")]
        elif estop[1] <= now < estop[1] + 0.2:
            inbox = [DriveCommand("test", _NEUTRAL)]
        else:
            inbox = [DriveCommand("test", VelocityRequest(twist, enabled=True))]


def _published(tick: TickRecord) -> Iterator[Published]:
    """Yield the topic and the message of all that a robot publishes after a tick to those who subscribe to everything."""
    for driven in DRIVE_OUTPUTS:
        if driven.due(tick.drive):
            yield from ((driven.name, message) for message in driven.build(tick.drive))
    for estimated in ESTIMATE_OUTPUTS:
        if estimated.due(tick.estimation):
            yield from ((estimated.name, message) for message in estimated.build(tick.estimation))


def play(moments: Iterable[Moment], display: Display) -> None:
    """Show a drive: what the robot publishes, and what its operator does."""
    for moment in moments:
        twist = moment.command
        if moment.hint is not None:
            display.hint(moment.hint.map_from_base, moment.hint.covariance, moment.stamp)
        display.command(float(twist.linear[0]), float(twist.angular[2]), True, moment.stamp)
        for topic, message in moment.published:
            display.show(topic, message)


def rows(recording: Path) -> dict[str, int]:
    """Return how many rows every entity of a recording has."""
    counts: dict[str, int] = {}
    for chunk in RrdReader(recording).stream():
        entity = str(chunk.entity_path).removeprefix("/")
        counts[entity] = counts.get(entity, 0) + chunk.num_rows
    return counts


def column(recording: Path, entity: str, component: str) -> list[Any]:
    """Return the values of one component of an entity, such as ``Scalars:scalars``, by time."""
    found: list[tuple[Any, Any]] = []
    for chunk in RrdReader(recording).stream():
        if str(chunk.entity_path) != f"/{entity}":
            continue
        batch = chunk.to_record_batch()
        if component not in batch.schema.names:
            continue
        values = batch.column(component).to_pylist()
        times = range(len(values)) if chunk.is_static else batch.column("robot time").to_pylist()
        found += zip(times, values, strict=True)
    return [value for _, value in sorted(found, key=lambda pair: pair[0]) if value is not None]


def events(recording: Path) -> list[tuple[str, str]]:
    """Return level and text of every event, by time."""
    levels = column(recording, "log", "TextLog:level")
    texts = column(recording, "log", "TextLog:text")
    return [(level[0], text[0]) for level, text in zip(levels, texts, strict=True)]


def has_vulkan() -> bool:
    """Return whether there is a Vulkan driver, without which the viewer draws nothing."""
    folders = (Path("/usr/share/vulkan/icd.d"), Path("/etc/vulkan/icd.d"))
    return "VK_ICD_FILENAMES" in os.environ or any(
        path for folder in folders for path in folder.glob("*.json")
    )


@dataclass(frozen=True, slots=True, eq=False)
class Viewer:
    """A running viewer."""

    client: ViewerClient
    url: str
    pid: int


@contextmanager
def headless_viewer() -> Iterator[Viewer]:
    """Run a viewer without a screen, which only this machine can reach."""
    if not has_vulkan():
        pytest.skip("no Vulkan driver: apt-get install mesa-vulkan-drivers")
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    where = ["--bind", "127.0.0.1", "--port", str(port), "--window-size", "1600x900"]
    process = subprocess.Popen(
        [viewer_program(), "--headless", "--hide-welcome-screen", *where],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        url = f"rerun+http://127.0.0.1:{port}/proxy"
        yield Viewer(_connect(url, process), url, process.pid)
    finally:
        process.kill()
        process.wait()


def _connect(url: str, process: subprocess.Popen[bytes]) -> ViewerClient:
    for _ in range(300):
        assert process.poll() is None, "the viewer ended"
        try:
            client = ViewerClient.connect(url)
            client.get_state()
        except Exception:
            time.sleep(0.1)
        else:
            return client
    raise TimeoutError("the viewer does not answer")
