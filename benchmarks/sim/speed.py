"""Benchmarks of the simulation: worlds against real time, ray casting against MuJoCo's, start-up."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.metadata import version

import mujoco
import numpy as np

from localization.types import IntArray, Twist
from robot_sim import MOUNTS, Simulation, SimulationConfig, World, load_world, scene_names
from robot_sim.array_types import FloatArray
from robot_sim.raycasting import MujocoRayCaster, caster_for
from robot_sim.raycasting.embree_caster import EmbreeRayCaster
from robot_sim.raycasting.embree_scene import StaticGeometry
from robot_sim.sensors.scanner_config import ScannerConfig
from robot_sim.simulation import TICK_NS
from robot_sim.worlds.world import WorldOptions

ROUNDS = 7
"""Contenders take turns; the least CPU time of a turn counts, because the machine is shared."""
TICKS = 50
BEAMS = 541
RANGE = 30.0
CONTENDERS = ("physics", "scanners", "effects", "alive")
"""Without scanners; with plain ones; with all optical effects; plain, among people and doors."""
STARTUP = """
import time
from pathlib import Path
from robot_sim import Simulation
Simulation("office").step()
cpu = time.process_time()
(peak,) = [x for x in Path("/proc/self/status").read_text().splitlines() if "VmHWM" in x]
print(cpu, int(peak.split()[1]) / 1024)
"""


@dataclass(frozen=True)
class Taken:
    """Seconds that one call of a contender took: the least of all rounds."""

    cpu: float
    wall: float


def race(contenders: Mapping[str, Callable[[], object]], rounds: int = ROUNDS) -> dict[str, Taken]:
    """Let contenders take turns, and keep each one's best."""
    best = {name: Taken(float("inf"), float("inf")) for name in contenders}
    for _ in range(rounds):
        for name, run in contenders.items():
            wall, cpu = time.perf_counter(), time.process_time()
            run()
            cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
            best[name] = Taken(min(best[name].cpu, cpu), min(best[name].wall, wall))
    return best


def scanners(*, realistic: bool) -> SimulationConfig:
    """Return both scanners with 541 beams at 25 Hz."""
    return SimulationConfig(
        scanners=tuple(
            ScannerConfig.of(
                name, "sick_lms111", rate_hz=25.0, resolution_deg=0.5, realistic=realistic
            )
            for name in MOUNTS
        )
    )


def driving(world: World, config: SimulationConfig) -> Callable[[], None]:
    """Return a function that drives on in a circle for ``TICKS`` ticks."""
    simulation = Simulation(world, config=config)
    simulation.command(Twist.planar(0.15, 0.8))

    def run() -> None:
        for _ in range(TICKS):
            simulation.step()

    run()
    return run


def real_time_factors() -> None:
    """Print simulated over elapsed time for every world."""
    print(f"  times real time, two scanners of {BEAMS} beams at 25 Hz, CPU time (wall-clock)")
    print(f"  {'world':12s}" + "".join(f"{name:>20s}" for name in CONTENDERS))
    seconds = TICKS * TICK_NS * 1e-9
    for name in scene_names():
        world = load_world(name)
        alive = load_world(name, options=WorldOptions(alive=True))
        plain = scanners(realistic=False)
        taken = race(
            {
                "physics": driving(world, SimulationConfig(scanners=())),
                "scanners": driving(world, plain),
                "effects": driving(world, scanners(realistic=True)),
                "alive": driving(alive, plain),
            }
        )
        cells = [f"{seconds / t.cpu:8.1f} ({seconds / t.wall:6.1f})" for t in taken.values()]
        print(f"  {name:12s}" + "".join(f"{cell:>20s}" for cell in cells))


def boxes(count: int) -> mujoco.MjSpec:
    """Return a hall of 40 m with ``count`` boxes in it."""
    rng = np.random.default_rng(count)
    spec, box = mujoco.MjSpec(), mujoco.mjtGeom.mjGEOM_BOX
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=(20, 20, 1))
    for x, y in ((20, 0), (-20, 0), (0, 20), (0, -20)):
        walls = (0.1, 20, 2) if x else (20, 0.1, 2)
        spec.worldbody.add_geom(type=box, pos=(x, y, 2), size=walls)
    for _ in range(count):
        x, y = rng.uniform(-19.0, 19.0, 2)
        size, yaw = rng.uniform((0.1, 0.1, 0.3), (0.5, 0.5, 1.2)), rng.uniform(0.0, np.pi)
        quat = (np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2))
        spec.worldbody.add_geom(type=box, pos=(x, y, size[2]), size=size, quat=quat)
    return spec


def hills(cells: int) -> mujoco.MjSpec:
    """Return rolling ground of 40 m with 50 boxes on it."""
    rng = np.random.default_rng(cells)
    spec = boxes(50)
    line = np.linspace(0.0, 4.0 * np.pi, cells)
    heights = (
        0.5 + 0.2 * np.add.outer(np.sin(line), np.cos(line)) + 0.05 * rng.random((cells, cells))
    )
    spec.add_hfield(
        name="hills", nrow=cells, ncol=cells, size=(20, 20, 0.5, 0.1), userdata=heights.ravel()
    )
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_HFIELD, hfieldname="hills")
    return spec


def casting() -> None:
    """Print rays per second of Embree, of our fallback and of plain ``mj_multiRay``."""
    names = ("Embree", "with hits", "mj_ray, culled", "mj_multiRay")
    print(f"  casting, million rays/s/core, {BEAMS} rays from one origin per call, CPU time")
    print(f"  {'world':24s}" + "".join(f"{n:>16s}" for n in names) + "    ratio  farthest apart")
    scenes = [(f"{n} boxes", boxes(n)) for n in (50, 200, 1000)]
    for label, spec in [*scenes, ("heightfield 256 x 256", hills(256))]:
        model = spec.compile()
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        embree = EmbreeRayCaster(StaticGeometry(model), model, data)
        fallback = MujocoRayCaster(model, data)
        angles = np.radians(np.linspace(-135.0, 135.0, BEAMS))
        fan = np.stack(
            [np.cos(angles), np.sin(angles), np.full(BEAMS, -0.03 if "field" in label else -0.003)],
            axis=1,
        )
        fan /= np.linalg.norm(fan, axis=1, keepdims=True)
        origin, times = (
            np.array([0.3, -0.2, 0.60 if "field" in label else 0.95]),
            np.zeros(BEAMS, dtype=np.int64),
        )
        origins = np.tile(origin, (BEAMS, 1))
        flat = fan.ravel().copy()
        geoms, native = np.zeros(BEAMS, dtype=np.int32), np.zeros(BEAMS)
        slow = "field" in label

        def multi_ray(
            model: mujoco.MjModel = model,
            data: mujoco.MjData = data,
            flat: FloatArray = flat,
            origin: FloatArray = origin,
            geoms: object = geoms,
            native: FloatArray = native,
        ) -> None:
            mujoco.mj_multiRay(
                model, data, origin, flat, None, True, -1, geoms, native, None, BEAMS, RANGE
            )

        def repeat(run: Callable[[], object], slow: bool = slow) -> Callable[[], None]:
            def runs() -> None:
                for _ in range(1 if slow else 20):
                    run()

            return runs

        args = (origins, fan, times, RANGE)
        taken = race(
            {
                names[0]: repeat(lambda e=embree, a=args: e.distances(*a), False),  # type: ignore[misc]
                names[1]: repeat(lambda e=embree, a=args: e.hits(*a), False),  # type: ignore[misc]
                names[2]: repeat(lambda f=fallback, a=args: f.distances(*a)),  # type: ignore[misc]
                names[3]: repeat(multi_ray),
            }
        )
        counts = [20, 20, 1 if slow else 20, 1 if slow else 20]
        rates = [n * BEAMS / t.cpu / 1e6 for n, t in zip(counts, taken.values(), strict=True)]
        native[(native < 0.0) | (native > RANGE)] = np.inf
        apart = np.abs(np.nan_to_num(embree.distances(*args) - native, nan=0.0)).max()
        print(
            f"  {label:24s}"
            + "".join(f"{rate:16.4f}" for rate in rates)
            + f"{rates[0] / rates[3]:8.1f}x  {1e6 * apart:8.4f} um"
        )


def moving() -> None:
    """Print the cost of one sweep of a moving scanner among movers."""
    world = load_world("office", options=WorldOptions(alive=True))
    model, data = world.model, mujoco.MjData(world.model)
    mujoco.mj_forward(model, data)
    caster = caster_for(world, data)
    angles = np.radians(np.linspace(-135.0, 135.0, BEAMS))
    fan = np.stack([np.cos(angles), np.sin(angles), np.zeros(BEAMS)], axis=1)
    pose = world.spawn @ MOUNTS["laser_horizontal"]
    origins = pose.position + np.linspace(0.0, 0.03, BEAMS)[:, None] * pose.rotation[:, 0]
    directions = fan @ pose.rotation.T
    times: IntArray = np.linspace(0, 15_000_000, BEAMS).astype(np.int64)
    geom, distance, groups = np.zeros(1, dtype=np.int32), np.zeros(1), np.ones(6, dtype=np.uint8)
    groups[3] = 0

    def beam_by_beam() -> None:
        for origin, direction in zip(origins, directions, strict=True):
            mujoco.mj_multiRay(
                model, data, origin, direction, groups, True, -1, geom, distance, None, 1, RANGE
            )

    taken = race(
        {
            "ours": lambda: caster.distances(origins, directions, times, RANGE),
            "theirs": beam_by_beam,
        },
        rounds=30,
    )
    ours, theirs = 1e6 * taken["ours"].wall, 1e6 * taken["theirs"].wall
    print(f"  one sweep of a scanner in motion among {len(world.movers)} movers in the office:")
    print(f"    each mover where it is at the beam's time {ours:9.0f} us")
    print(f"    mj_multiRay beam by beam, movers frozen   {theirs:9.0f} us")


def startup() -> None:
    """Print the time of a fresh process to the first tick of the office, and its memory."""
    runs = []
    for _ in range(5):
        began = time.perf_counter()
        out = subprocess.run(
            [sys.executable, "-c", STARTUP], capture_output=True, text=True, check=True
        ).stdout
        cpu, memory = (float(v) for v in out.split())
        runs.append((time.perf_counter() - began, cpu, memory))
    wall, cpu, memory = (min(column) for column in zip(*runs, strict=True))
    print(
        "  fresh process to the first tick of the office:"
        f" {wall:.2f} s, {cpu:.2f} s CPU, {memory:.0f} MiB"
    )


def main() -> None:
    """Print the tables."""
    print(f"  mujoco {mujoco.__version__}, numpy {np.__version__}, embreex {version('embreex')}")
    real_time_factors()
    casting()
    moving()
    startup()


if __name__ == "__main__":
    main()
