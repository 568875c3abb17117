"""A drive as its clients see it: the robot's messages, tick by tick, without a socket."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from localization.cloud import Cloud
from localization.localizer import Localizer
from localization.prepared import prepare
from localization.types import SECOND, Hint, Twist
from robot_sim import Simulation, World
from teleop.joystick import Wish
from teleop.robot import topics
from teleop.robot.robot import Drive, Message, Reset, Robot, Stop
from teleop.scenario.driver import TourDriver
from teleop.scenario.mission import HINT_STAMP, Mission

Published: TypeAlias = tuple[str, dict[str, Any]]
"""A topic and a message on it."""

_NEUTRAL = Wish(Twist.planar(0.0, 0.0), enabled=True)


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
    robot = Robot(simulation, Localizer(prepare(cloud, cache=cache), simulation.mounts))
    driver = TourDriver(world.tour)
    hint = Mission().hint(simulation.truth().map_from_base)
    latched: tuple[Published, ...] = tuple(
        (kind.name, message) for kind, message in topics.latched(cloud, simulation.mounts).items()
    )
    inbox: list[Message] = [Drive("test", _NEUTRAL)]
    twist = Twist.planar(0.0, 0.0)
    tick = 0
    while not driver.done and simulation.stamp < seconds * SECOND:
        given = hint if simulation.stamp == HINT_STAMP else None
        snapshot = robot.tick(simulation.stamp, inbox if given is None else [*inbox, given])
        published = [
            (topic.name, message)
            for topic in topics.OUTPUTS
            if tick % max(1, topic.every) == 0 and (message := topic.build(snapshot)) is not None
        ]
        yield Moment(snapshot.stamp, twist, given, (*latched, *published))
        latched, tick = (), tick + 1
        estimate = snapshot.estimate
        twist = driver.command(estimate.map_from_base, estimate.health)
        now = simulation.stamp / SECOND
        if estop[0] <= now < estop[1]:
            inbox = [Stop("test")]
        elif estop[1] <= now < estop[1] + 0.02:
            inbox = [Reset("test")]
        elif estop[1] <= now < estop[1] + 0.2:
            inbox = [Drive("test", _NEUTRAL)]
        else:
            inbox = [Drive("test", Wish(twist, enabled=True))]
