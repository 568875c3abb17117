"""Simulations that run for some ticks, and models as they stand at time zero."""

from __future__ import annotations

from typing import TypeVar

import mujoco

from localization.types import Reading, Twist
from robot_sim.simulation import Simulation, SimulationConfig

BLIND = SimulationConfig(scanners=())
"""A robot without scanners, for what moves only."""
Kind = TypeVar("Kind")


def run(simulation: Simulation, ticks: int, twist: Twist | None = None) -> list[Reading]:
    """Command a twist, if one is given, and return the readings of the ticks that follow."""
    if twist is not None:
        simulation.command(twist)
    return [reading for _ in range(ticks) for reading in simulation.step()]


def readings_of(kind: type[Kind], simulation: Simulation, ticks: int) -> list[Kind]:
    """Return the readings of a kind of the next ticks."""
    return [reading for reading in run(simulation, ticks) if isinstance(reading, kind)]


def state_of(model: mujoco.MjModel) -> mujoco.MjData:
    """Return the state of a model at time zero, with all that follows from it."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return data
