"""Processor time of a frame in each scene, at all of its start poses and places."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np

from benchmarks.common.figures import Figure
from localization.types import Pose
from robot_sim import Simulation, World, WorldOptions, load_world, scene_names
from robot_sim.cameras import CAMERAS, VisualState, points
from robot_sim.cameras.renderer import CameraRenderer

FRAMES = 15
"""Rounds; of each view the fastest counts."""


def scenes() -> Iterator[Figure]:
    """Yield the processor time of frames of the Kinect-like camera, with people."""
    camera = CAMERAS["kinect"]
    for name in scene_names():
        world = load_world(name, options=WorldOptions(alive=True))
        simulation = Simulation(world)
        simulation.step()
        start = time.process_time()
        with CameraRenderer(world, camera) as renderer:
            made = time.process_time() - start
            views = [fastest(renderer, state) for state in states(simulation, world)]
            frame = renderer.render(simulation.visual_state())
            clouds = min(timed(lambda f=frame: points(f, camera)) for _ in range(FRAMES))
        for quantity, value, unit in (
            ("median view", 1e3 * float(np.median(views)), "ms"),
            ("slowest view", 1e3 * max(views), "ms"),
            ("cloud of points", 1e3 * clouds, "ms"),
            ("making the renderer", made, "s"),
        ):
            yield Figure(name, "colours and depth, 640 x 480", quantity, value, unit, len(views))


def states(simulation: Simulation, world: World) -> Iterator[VisualState]:
    """Yield the present state with the robot at each start pose and place."""
    for pose in {**world.spawns, **world.places}.values():
        yield moved(simulation, pose)


def moved(simulation: Simulation, pose: Pose) -> VisualState:
    """Return the present state with the robot elsewhere."""
    state = simulation.visual_state()
    address = int(simulation.world.model.joint("base_link").qposadr[0])
    state.qpos[address : address + 7] = (*pose.position, *pose.quaternion_wxyz)
    return state


def fastest(renderer: CameraRenderer, state: VisualState) -> float:
    """Return the least processor time of several frames [s]."""
    return min(timed(lambda: renderer.render(state)) for _ in range(FRAMES))


def timed(call: object) -> float:
    """Return the processor time of a call [s]."""
    start = time.process_time()
    call()  # type: ignore[operator]
    return time.process_time() - start
