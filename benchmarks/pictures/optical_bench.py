"""Optical bench: a scanner at rest among a few objects, to measure single effects.

It uses the simulation's casters, materials and effects, without a robot.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from localization.types import Pose, Scan
from robot_sim.actors.movers import Mover
from robot_sim.array_types import FloatArray
from robot_sim.raycasting import MujocoRayCaster, RayCaster
from robot_sim.scene_objects.materials import MATERIALS
from robot_sim.sensors.echoes import Echoes
from robot_sim.sensors.lidar import Scanner, scans_until
from robot_sim.sensors.lidar_effects import Panes
from robot_sim.sensors.light_paths import LightTracer
from robot_sim.sensors.pose_history import PoseHistory
from robot_sim.sensors.scanner_config import ScannerConfig
from robot_sim.sensors.surface_optics import optics_of


class OpticalBench:
    """Objects around a scanner at the origin that faces along x."""

    def __init__(self, things: str, movers: Sequence[Mover] = ()) -> None:
        """Build the bench.

        Args:
            things: MJCF below ``worldbody``, such as from ``box_xml`` and ``wall_xml``; materials of
                the catalogue can be named.
            movers: Movers of its mocap bodies.
        """
        materials = "".join(f'<material name="{name}"/>' for name in MATERIALS)
        self.model = mujoco.MjModel.from_xml_string(
            f"<mujoco><asset>{materials}</asset><worldbody>{things}</worldbody></mujoco>"
        )
        self.data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, self.data)
        self.caster: RayCaster = MujocoRayCaster(self.model, self.data, movers)

    def echoes(self, directions: FloatArray, far: float = 30.0) -> Echoes:
        """Cast rays from the origin, through panes and off mirrors.

        Args:
            directions: (N, 3) vectors of any length.
            far: Greatest range [m].
        """
        n = len(directions)
        unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
        tracer = LightTracer(self.caster, optics_of(self.model, self.data), Panes(), far)
        times = np.zeros(n, dtype=np.int64)
        found = tracer.trace_beams(np.zeros((3, 1, n)), unit.T[:, None], times)
        return Echoes(found.distances[0], found.remissions[0], found.cosines[0])

    def sweeps(self, count: int, config: ScannerConfig, *, seed: int = 0) -> list[Scan]:
        """Return the first ``count`` sweeps of a scanner whose plane is level."""
        optics = optics_of(self.model, self.data)
        scanner = Scanner(
            config, Pose.identity(), self.caster, np.random.SeedSequence(seed), optics
        )
        end = config.phase_ns + (count + 1) * config.period_ns
        unturned = np.tile([1.0, 0.0, 0.0, 0.0], (2, 1))
        still = PoseHistory(np.array([0, end], dtype=np.int64), np.zeros((2, 3)), unturned)
        every = (scans_until(scanner.end, [scanner], self.caster, still) for _ in range(count))
        return [scan for scans in every for scan in scans]


def bench_scanner(**parameters: Any) -> ScannerConfig:
    """Return a scanner without noise and effects, except for ``parameters`` of ``ScannerConfig``."""
    return ScannerConfig("laser_horizontal", **({"sigma": 0.0} | parameters))


def box_xml(
    x: float,
    y: float,
    half: tuple[float, float, float],
    material: str,
    yaw: float = 0.0,
) -> str:
    """Return a box about (x, y, 0).

    Args:
        x: x of the centre [m].
        y: y of the centre [m].
        half: Half its size along its own axes [m].
        material: Name of a material of the catalogue.
        yaw: Yaw [rad].
    """
    size = " ".join(f"{float(h)!r}" for h in half)
    turn = math.degrees(float(yaw))
    return (
        f'<geom type="box" pos="{float(x)!r} {float(y)!r} 0" size="{size}" material="{material}"'
        f' euler="0 0 {turn!r}"/>'
    )


def wall_xml(x: float, material: str = "wall") -> str:
    """Return a wide wall whose face is the plane at ``x`` [m]."""
    return box_xml(x + 0.1, 0.0, (0.1, 20.0, 5.0), material)


def pane_xml(x: float, yaw: float = 0.0, material: str = "glass") -> str:
    """Return a pane 6 mm thick and 8 m wide whose middle is at ``x`` [m], turned by ``yaw`` [rad]."""
    return box_xml(x, 0.0, (0.003, 4.0, 2.0), material, yaw)
