"""How fast the simulation is: ``python -m benchmarks.simulation``."""

from __future__ import annotations

import platform
import sys
import time

import mujoco
import numpy as np

from localization.types import Twist
from robot_sim.lidar import MujocoRayCaster
from robot_sim.p3at import MOUNTS
from robot_sim.simulation import TICK_NS, Simulation, SimulationConfig
from robot_sim.worlds import World, load_world

BEAMS = 541
SWEEPS = 40
TICKS = 500


def rays_per_second(world: World, scanner: str) -> float:
    """Cast sweeps of a scanner that drives at 0.6 m/s, each beam from its own origin."""
    data = mujoco.MjData(world.model)
    mujoco.mj_forward(world.model, data)
    caster = MujocoRayCaster(world.model, data)
    angles = np.radians(np.linspace(-135.0, 135.0, BEAMS))
    fan = np.stack([np.cos(angles), np.sin(angles), np.zeros(BEAMS)], axis=1)
    path = np.linspace(0.0, 0.6 * 0.075, BEAMS)[:, None]
    rays, seconds = 0, 0.0
    for place in world.places.values():
        pose = place @ MOUNTS[scanner]
        origins = pose.position + path * place.rotation[:, 0]
        directions = fan @ pose.rotation.T
        began = time.perf_counter()
        for _ in range(SWEEPS // len(world.places) + 1):
            caster.cast(origins, directions, 20.0)
            rays += BEAMS
        seconds += time.perf_counter() - began
    return rays / seconds


def real_time_factor(world: World, config: SimulationConfig) -> float:
    """Drive in a circle and divide simulated by elapsed time."""
    simulation = Simulation(world, config=config)
    simulation.command(Twist.planar(0.3, 0.8))
    simulation.step()
    began = time.perf_counter()
    for _ in range(TICKS):
        simulation.step()
    return TICKS * TICK_NS * 1e-9 / (time.perf_counter() - began)


def main() -> None:
    """Print the table."""
    world = load_world("office")
    rows = [
        ("physics, wheels, IMU", f"{real_time_factor(world, SimulationConfig(scanners=())):.0f} x"),
        ("... and both scanners", f"{real_time_factor(world, SimulationConfig()):.0f} x"),
    ]
    rows += [(f"rays, {s}", f"{rays_per_second(world, s) / 1e6:.2f} M/s") for s in MOUNTS]
    heading = f"office, {world.model.ngeom} geoms, 2 x {BEAMS} beams at 10 Hz, one thread"
    machine = (
        f"mujoco {mujoco.__version__}, Python {platform.python_version()}, {platform.machine()}"
    )
    lines = [heading, machine, *(f"  {name:28s}{value:>10s}" for name, value in rows)]
    sys.stdout.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
