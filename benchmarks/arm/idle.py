"""What an arm at rest costs: the simulation, and the whole loop of a robot, with and without one, in one run."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

from benchmarks.common.figures import Figure
from benchmarks.sim.speed import race
from localization import prepare
from localization.types import Twist
from robot_sim import Simulation, SimulationConfig, WorldOptions, load_world
from teleop.robot.assembly import RobotParts, build_stepped_robot
from teleop.robot.serving.serve_config import ServeConfig
from teleop.scene_clouds import load_scene_cloud

SCENE = "office"
TICKS = 50
ROUNDS = 15
ROBOTS: Mapping[str, WorldOptions] = {
    "without an arm": WorldOptions(),
    "idle arm": WorldOptions(arm="s2"),
}


def _driving(options: WorldOptions, config: SimulationConfig) -> Callable[[], None]:
    simulation = Simulation(load_world(SCENE, options=options), config=config)
    simulation.command(Twist.planar(0.15, 0.8))

    def run() -> None:
        for _ in range(TICKS):
            simulation.step()

    run()
    return run


def _loops() -> dict[str, Callable[[], None]]:
    cloud = load_scene_cloud(SCENE)
    prepared = prepare(cloud)

    def loop(options: WorldOptions) -> Callable[[], None]:
        parts = RobotParts(load_world(SCENE, options=options), seed=0)
        robot = build_stepped_robot(parts, cloud, prepared, ServeConfig(port=0, lockstep=True))

        def run() -> None:
            for _ in range(TICKS):
                robot.tick()

        run()
        return run

    return {name: loop(options) for name, options in ROBOTS.items()}


def idle() -> Iterator[Figure]:
    """Measure a tick of physics, wheels and inertial unit; with scanners; and of a robot that localises, standing."""
    plain, blind = SimulationConfig(), SimulationConfig(scanners=())
    cases = {
        "physics": ({n: _driving(o, blind) for n, o in ROBOTS.items()}, None),
        "with both scanners": ({n: _driving(o, plain) for n, o in ROBOTS.items()}, None),
        "whole loop": (_loops(), 15.0),
    }
    for case, (contenders, most) in cases.items():
        taken = race(contenders, ROUNDS)
        ticks = {name: 1e6 * one.cpu / TICKS for name, one in taken.items()}
        for name, tick in ticks.items():
            yield Figure(case, name, "tick", tick, "us", ROUNDS)
        without, arm = ticks.values()
        yield Figure(
            case, "idle arm", "more", 100.0 * (arm / without - 1.0), "%", ROUNDS, most=most
        )
