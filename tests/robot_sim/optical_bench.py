"""Hand-made worlds for light: a few geoms with materials, and scanners that stand still in them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from localization.types import Pose, Scan
from robot_sim.casting import MujocoRayCaster, RayCaster
from robot_sim.casting.moving import Moved
from robot_sim.effects import Echoes, Effects, Panes
from robot_sim.lidar import Scanner
from robot_sim.materials import MATERIALS
from robot_sim.optics import look, optics_of
from robot_sim.scanner_config import ScannerConfig
from robot_sim.track import Track


class Bench:
    """Geoms around a scanner that stands at the origin and looks along x."""

    def __init__(self, geoms: str, movers: Sequence[Moved] = ()) -> None:
        """Set up geoms and mocap bodies, and compile them.

        Args:
            geoms: MJCF below ``worldbody``.
            movers: Of its mocap bodies.
        """
        materials = "".join(f'<material name="{name}"/>' for name in MATERIALS)
        self.model = mujoco.MjModel.from_xml_string(
            f"<mujoco><asset>{materials}</asset><worldbody>{geoms}</worldbody></mujoco>"
        )
        self.data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, self.data)
        self.caster: RayCaster = MujocoRayCaster(self.model, self.data, movers)

    def echoes(self, directions: np.ndarray, far: float = 30.0) -> Echoes:
        """Cast rays from the origin along ``directions`` (N, 3), through panes and off mirrors."""
        n = len(directions)
        return look(
            self.caster,
            optics_of(self.model, self.data),
            Panes(),
            np.zeros((n, 3)),
            directions / np.linalg.norm(directions, axis=1, keepdims=True),
            np.zeros(n, dtype=np.int64),
            far,
        )

    def sweeps(self, count: int, *, seed: int = 0, **parameters: Any) -> list[Scan]:
        """Return sweeps of the horizontal scanner, which stands at the origin."""
        defaults: dict[str, Any] = {"sigma": 0.0, "effects": Effects()}
        config = ScannerConfig("laser_horizontal", **(defaults | parameters))
        scanner = Scanner(
            config,
            Pose.identity(),
            self.caster,
            np.random.SeedSequence(seed),
            optics_of(self.model, self.data),
        )
        end = (count + 1) * config.period_ns
        still = Track(np.array([0, end]), np.zeros((2, 3)), np.tile([1.0, 0.0, 0.0, 0.0], (2, 1)))
        return [scanner.sweep(still) for _ in range(count)]


def box(
    x: float, y: float, half: tuple[float, float, float], material: str, yaw: float = 0.0
) -> str:
    """Return a box geom about (x, y, 0)."""
    size = " ".join(f"{h:g}" for h in half)
    return (
        f'<geom type="box" pos="{x!r} {y!r} 0" size="{size}" material="{material}"'
        f' euler="0 0 {math.degrees(yaw)!r}"/>'
    )


def wall(x: float, material: str = "wall") -> str:
    """Return a broad wall whose face is the plane at ``x``."""
    return box(x + 0.1, 0.0, (0.1, 20.0, 5.0), material)


def pane(x: float, yaw: float = 0.0, material: str = "glass") -> str:
    """Return a pane 6 mm thick whose middle is at ``x``."""
    return box(x, 0.0, (0.003, 4.0, 2.0), material, yaw)
