"""A robot in memory, ticked with an operator at its wire."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from localization.maps.cloud import Cloud
from localization.maps.prepared_map import prepare
from localization.types import SECOND, Hint
from robot_sim import World
from teleop.robot.assembly import RobotParts, build_stepped_robot
from teleop.robot.inbox import PoseHint
from teleop.robot.serving.serve_config import ServeConfig
from teleop.robot.tick_record import TickRecord
from teleop.scenario.operators.memory_transport import MemoryTransport
from teleop.scenario.operators.operator import Briefing, GoalPlace, Operator
from teleop.scenario.operators.wire import Recorder, Wire


class Stage:
    """A robot in lockstep behind a server that does not listen, and the operators at its wires."""

    def __init__(
        self,
        world: World,
        cloud: Cloud,
        cache: Path,
        *,
        seed: int = 0,
        known: bool = True,
    ) -> None:
        prepared, config = prepare(cloud, cache=cache), ServeConfig(port=0, lockstep=True)
        parts = RobotParts(world, seed)
        self.stepped = build_stepped_robot(parts, cloud, prepared, config)
        self.robot, self.adapter = self.stepped.robot, self.stepped.adapter
        self.simulation = self.robot.simulation
        self.ticks: list[TickRecord] = []
        self.stepped.observers = (self.ticks.append,)
        self.protocol = protocol = self.stepped.gateway.server.protocol
        self.transport = MemoryTransport(protocol, lambda: self.simulation.stamp)
        self.seats: list[tuple[Operator, Wire]] = []
        if known:
            self.place()

    def place(self) -> None:
        """Give the robot its true pose."""
        truth = self.simulation.truth().map_from_base
        self.adapter.wishes.post(PoseHint("", Hint(0, truth, np.zeros((6, 6)))))

    def seat(
        self, operator: Operator, briefing: Briefing, recorder: Recorder | None = None
    ) -> Wire:
        """Connect an operator."""
        wire = self.transport.connect(recorder=recorder)
        operator.begin(wire, briefing)
        self.seats.append((operator, wire))
        return wire

    def tick(self) -> TickRecord:
        """Advance by one tick."""
        tick = self.stepped.tick()
        for operator, wire in self.seats:
            wire.deliver()
            operator.act(wire, tick.stamp)
        return tick

    def run(self, seconds: float, until: Callable[[], object] = lambda: False) -> float:
        """Tick for a time, or until a condition holds; return the robot time [s]."""
        end = self.simulation.stamp + round(seconds * SECOND)
        while self.simulation.stamp < end and not until():
            self.tick()
        return self.simulation.stamp / SECOND

    def run_until_done(self, operator: Operator, seconds: float) -> float:
        """Tick until an operator has done all, for a time [s] at the most; return the robot time [s]."""
        return self.run(seconds, lambda: operator.done)

    @property
    def position(self) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
        """Where the robot truly is, (2,) [m]."""
        return self.simulation.truth().map_from_base.position[:2]

    def distance(self, goal: GoalPlace) -> float:
        """True distance from a goal [m]."""
        return float(np.hypot(*(self.position - goal.at)))

    @property
    def trajectory(self) -> bytes:
        """All true poses and commands, bit by bit."""
        return b"".join(
            t.truth.map_from_base.position.tobytes()
            + t.truth.map_from_base.quaternion_wxyz.tobytes()
            + t.control.twist.linear.tobytes()
            + t.control.twist.angular.tobytes()
            for t in self.ticks
        )


def goals_along(world: World, *distances: float, within: float = 0.3) -> tuple[GoalPlace, ...]:
    """Return goals on a world's tour at these distances from its start [m]."""
    goals, way = [], [world.tour[0]]
    wanted, gone = list(distances), 0.0
    for a, b in zip(world.tour, world.tour[1:], strict=False):
        length = float(np.hypot(b[0] - a[0], b[1] - a[1]))
        while wanted and gone + length >= wanted[0]:
            share = (wanted.pop(0) - gone) / length
            at = (a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]))
            goals.append(GoalPlace(at, within, 0.0, (*way, at)))
            way = [at]
        gone += length
        way.append(b)
    return tuple(goals)
