"""One trial: a robot on one surface, and steps that are driven in one way, in lockstep over the real protocol."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from localization.maps.cloud import Cloud
from localization.maps.prepared_map import PreparedMap
from localization.pipeline.localizer import Localizer
from localization.types import SECOND, Hint, Pose, WheelSpeeds
from robot_sim import Simulation, SimulationConfig, World
from robot_sim.scene_objects.floor_surfaces import Patch, surface_named
from teleop.errors import SettingError
from teleop.interfaces import registry
from teleop.robot.clients.rosbridge_adapter import RosbridgeAdapter
from teleop.robot.drive import Drive
from teleop.robot.estimation import Estimation
from teleop.robot.inbox import PoseHint
from teleop.robot.steps.precision_log import way_between
from teleop.robot.steps.wheel_odometry import Way, WheelOdometry
from teleop.robot.topics.topic_table import latched_messages
from teleop.rosbridge.limits import ClientLimits
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.rosbridge.server.server import Server
from teleop.scenario.operators.memory_transport import MemoryTransport
from teleop.scenario.precision.drivers import ByRobot, StepDriver
from teleop.step_commands.commands import Step

_WARM_UP: Final = 50
"""Ticks at rest before the first step: the hint is judged within them."""

_REST: Final = 10
"""Ticks at rest after a step that the robot drives, which ends at rest."""

_PAUSE: Final = 60
"""Ticks at rest after a step by time: the robot brakes in a third of them, and takes a stream again after 1 s."""

_PATIENCE: Final = 60 * SECOND
"""Time after which a step that does not end is an error [ns]."""


@dataclass(frozen=True, slots=True)
class Driven:
    """A step, and how far the robot went by each measure."""

    step: Step
    """What was asked for."""
    outcome: str
    """How it ended."""
    wheels: Way
    """The way by the wheels."""
    localizer: Way | None
    """The way by the estimates; None if the robot does not localise itself."""
    true: Way
    """The true way."""


@dataclass(frozen=True, slots=True)
class Trial:
    """All steps of one surface and one way of driving."""

    surface: str
    """Name of the surface."""
    method: str
    """What the steps were driven by: time, odometry or localization."""
    driven: tuple[Driven, ...]
    """The steps, in order."""


def on_surface(world: World, surface: str) -> World:
    """Return a world whose whole ground has the friction of a surface.

    Raises:
        UnknownSurfaceError: If there is no such surface.
    """
    everywhere = Patch(surface_named(surface), 0.0, 0.0, (1000.0, 1000.0))
    return replace(world, patches=(*world.patches, everywhere))


class _Trial:
    """A robot behind its protocol, and one client; without the localiser where no step needs it."""

    def __init__(
        self, world: World, cloud: Cloud, prepared: PreparedMap | None, surface: str, seed: int
    ) -> None:
        config = SimulationConfig(scanners=()) if prepared is None else SimulationConfig()
        self.simulation = Simulation(on_surface(world, surface), seed=seed, config=config)
        self._drive = Drive(self.simulation)
        self._estimation: Estimation | None = None
        if prepared is not None:
            self._estimation = Estimation(Localizer(prepared, self.simulation.mounts))
        protocol = Protocol(registry(), limits=ClientLimits.unhurried())
        server = Server(protocol, port=0, clock=lambda: self.simulation.stamp, lockstep=True)
        mounts = self.simulation.mounts
        self._adapter = RosbridgeAdapter(
            server, latched_messages(cloud, world.robot, mounts), undo_memory=0
        )
        self._timers = protocol.timers
        self._estimated: Pose | None = None
        self.wheels = WheelOdometry(world.robot)
        self.wire = MemoryTransport(protocol, lambda: self.simulation.stamp).connect()
        start = self.simulation.truth().map_from_base
        self._adapter.wishes.post(PoseHint("", Hint(0, start, np.zeros((6, 6)))))

    def tick(self, ticks: int = 1) -> None:
        """Advance the robot."""
        for _ in range(ticks):
            driven = self._drive.tick(self.simulation.stamp, self._adapter.wishes.take())
            self._adapter.driven(driven)
            for reading in driven.sensed:
                if isinstance(reading, WheelSpeeds):
                    self.wheels.add(reading)
            if self._estimation is not None:
                estimated = self._estimation.take(driven)
                self._adapter.estimated(estimated)
                self._drive.steps.take_estimate(estimated.estimate)
                self._estimated = estimated.estimate.map_from_base
            self._timers.tick(driven.stamp)

    def poses(self) -> tuple[Pose, Pose | None]:
        """Return the true pose, and the estimated one."""
        return self.simulation.truth().map_from_base, self._estimated

    def step(self, driver: StepDriver, step: Step) -> Driven:
        """Have a step driven, and measure it at rest."""
        begin, way = self.poses(), self.wheels.way
        driver.begin(self.wire, step)
        asked = self.simulation.stamp
        self.wire.deliver()
        while not driver.act(self.wire, self.simulation.stamp):
            self.tick()
            self.wire.deliver()
            if self.simulation.stamp - asked > _PATIENCE:
                raise SettingError(f"a step by {driver.name} does not end within a minute")
        self.tick(_REST if isinstance(driver, ByRobot) else _PAUSE)
        end, went = self.poses(), self.wheels.way - way
        estimated = None
        if begin[1] is not None and end[1] is not None:
            estimated = way_between(begin[1], end[1], went.angle)
        outcome = str(driver.results[-1]["outcome"]) if isinstance(driver, ByRobot) else "done"
        return Driven(step, outcome, went, estimated, way_between(begin[0], end[0], went.angle))


def run_trial(
    world: World,
    cloud: Cloud,
    prepared: PreparedMap,
    surface: str,
    driver: StepDriver,
    steps: Sequence[Step],
    *,
    seed: int,
    progress: Callable[[], object] = lambda: None,
) -> Trial:
    """Drive steps on a surface; the robot localises itself only if it measures them by that.

    Args:
        world: The world; the robot begins at its spawn.
        cloud: Its map.
        prepared: The same, prepared for the localiser.
        surface: Name of the surface.
        driver: Drives them.
        steps: The steps.
        seed: Seed of the sensors' errors.
        progress: Called after each step.

    Raises:
        SettingError: If a step does not end.
    """
    needed = prepared if driver.name == "localization" else None
    trial = _Trial(world, cloud, needed, surface, seed)
    trial.tick(_WARM_UP)
    driven = []
    for step in steps:
        driven.append(trial.step(driver, step))
        progress()
    return Trial(surface, driver.name, tuple(driven))
