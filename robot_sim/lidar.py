"""Planar scanners: every beam is cast from where the scanner was at that beam's own time."""

from __future__ import annotations

import copy
from typing import Protocol

import mujoco
import numpy as np

from localization.types import Pose, Scan
from robot_sim.arrays import BoolArray, FloatArray
from robot_sim.p3at import ROBOT_GROUP
from robot_sim.scanner_config import ScannerConfig as ScannerConfig
from robot_sim.track import Track as Track


class RayCaster(Protocol):
    """Whatever can tell how far it is to the nearest surface."""

    def cast(self, origins: FloatArray, directions: FloatArray, max_range: float) -> FloatArray:
        """Return distances (N,) [m], ``inf`` where nothing is within ``max_range``.

        Args:
            origins: (N, 3) in ``map`` [m].
            directions: (N, 3) unit vectors in ``map``.
            max_range: [m].
        """
        ...


class MujocoRayCaster:
    """Casts each ray from its very own origin, with ``mj_ray`` behind it.

    ``mj_multiRay`` would take one origin per call and look at every geom in each call, which costs
    ten times more for a moving scanner. ``mj_ray`` alone looks at every geom for every ray; but the
    rays of a planar scanner stay near one plane, and most geoms do not come near it, the more so for
    a vertical plane. Those are hidden first, by a bound that is conservative for any set of rays.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        self._data = data
        # A copy, for the groups of its geoms are rewritten before each cast.
        self._model = copy.copy(model)
        self._surroundings = model.geom_group != ROBOT_GROUP
        self._half, self._bounded = _half_extents(model)
        self._groups = np.zeros(mujoco.mjNGROUP, dtype=np.uint8)
        self._groups[_SHOWN] = 1

    def cast(self, origins: FloatArray, directions: FloatArray, max_range: float) -> FloatArray:
        """See ``RayCaster.cast``."""
        shown = self._surroundings & self._near(origins, directions, max_range)
        self._model.geom_group[:] = np.where(shown, _SHOWN, _HIDDEN)
        model, data, groups, geom = self._model, self._data, self._groups, np.zeros(1, np.int32)
        ray = mujoco.mj_ray
        distances = np.array(
            [
                ray(model, data, origin, direction, groups, True, -1, geom)
                for origin, direction in zip(origins, directions, strict=True)
            ]
        )
        distances[(distances < 0.0) | (distances > max_range)] = np.inf
        return distances

    def _near(self, origins: FloatArray, directions: FloatArray, max_range: float) -> BoolArray:
        """Return which geoms (G,) may come near the plane that fits the rays best."""
        centre = origins.mean(axis=0)
        normal = np.linalg.eigh(directions.T @ directions)[1][:, 0]
        # A point of a ray is off the plane by at most the origin's offset plus range times slope.
        offset = float(np.abs((origins - centre) @ normal).max())
        slope = float(np.abs(directions @ normal).max())
        axes = self._data.geom_xmat.reshape(-1, 3, 3)
        thickness = np.einsum("gi,gi->g", np.abs(np.einsum("gji,j->gi", axes, normal)), self._half)
        height = np.abs((self._data.geom_xpos - centre) @ normal)
        near: BoolArray = height <= thickness + offset + slope * max_range
        return near | ~self._bounded


_SHOWN = 0
_HIDDEN = 1


def _half_extents(model: mujoco.MjModel) -> tuple[FloatArray, BoolArray]:
    """Return half sizes of boxes around the geoms (G, 3) [m] in their frames, and which have one."""
    kind, size = model.geom_type, model.geom_size
    half = np.repeat(model.geom_rbound[:, None], 3, axis=1)
    is_box = kind == mujoco.mjtGeom.mjGEOM_BOX
    half[is_box] = size[is_box]
    is_cylinder = kind == mujoco.mjtGeom.mjGEOM_CYLINDER
    half[is_cylinder] = size[is_cylinder][:, [0, 0, 1]]
    return half, np.asarray(kind != mujoco.mjtGeom.mjGEOM_PLANE)


class Scanner:
    """One scanner: knows when its next sweep ends, and casts it then."""

    def __init__(
        self, config: ScannerConfig, mount: Pose, caster: RayCaster, seed: np.random.SeedSequence
    ) -> None:
        self._config = config
        self._mount = mount
        self._caster = caster
        self._rng = np.random.default_rng(seed)
        patterns = [
            config.scan(0, np.zeros(config.beams_of(part)), part=part)
            for part in range(config.interlace)
        ]
        self._offsets = [pattern.offsets for pattern in patterns]
        self._rays_in_base = [
            np.stack([np.cos(p.angles), np.sin(p.angles), np.zeros(len(p.angles))], axis=1)
            @ mount.rotation.T
            for p in patterns
        ]
        self._picture = config.phase_ns
        self._part = 0

    @property
    def start(self) -> int:
        """Time of the first beam of the next sweep [ns]."""
        return self._picture + self._config.start_of(self._part)

    @property
    def end(self) -> int:
        """Time of its last beam [ns]."""
        return self.start + int(self._offsets[self._part][-1])

    def sweep(self, track: Track) -> Scan:
        """Cast the sweep that has just ended; ``track`` must reach from ``start`` to ``end``."""
        config, part, start = self._config, self._part, self.start
        positions, rotations = track.at(start + self._offsets[part])
        origins = positions + rotations @ self._mount.position
        directions = np.einsum("nij,nj->ni", rotations, self._rays_in_base[part])
        ranges = self._caster.cast(origins, directions, config.range_max)
        scan = config.scan(start, self._measured(ranges), part=part)
        self._part = (part + 1) % config.interlace
        self._picture += config.period_ns if self._part == 0 else 0
        return scan

    def _measured(self, ranges: FloatArray) -> FloatArray:
        c = self._config
        noisy = ranges + c.noise.at(ranges) * self._rng.standard_normal(len(ranges))
        noisy[noisy < c.range_min] = np.nan
        noisy[noisy > c.range_max] = np.inf
        return noisy
