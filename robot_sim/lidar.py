"""Planar scanners: every beam is cast from where the scanner was at that beam's own time."""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass
from typing import Protocol

import mujoco
import numpy as np

from localization.types import Pose, Scan
from robot_sim.arrays import BoolArray, FloatArray
from robot_sim.p3at import MOUNTS, ROBOT_GROUP
from robot_sim.track import Track as Track


@dataclass(frozen=True, slots=True)
class ScannerConfig:
    """A turning-mirror scanner like the SICK LMS1xx at 10 Hz."""

    name: str
    """Frame, a key of ``MOUNTS``."""
    field_of_view: float = math.radians(270.0)
    """[rad], symmetric about the scanner's x axis."""
    resolution: float = math.radians(0.5)
    """Angle between beams [rad]."""
    period_ns: int = 100_000_000
    """One turn of the mirror [ns]; the field of view takes its share of it."""
    phase_ns: int = 0
    """Time of the first beam of the first sweep [ns]."""
    range_min: float = 0.1
    """Nearer returns are invalid, ``NaN`` [m]."""
    range_max: float = 20.0
    """Farther surfaces give no return, ``+inf`` [m]."""
    sigma: float = 0.012
    """Standard deviation of a range [m]; the LMS1xx' statistical error."""

    def __post_init__(self) -> None:
        if self.name not in MOUNTS:
            raise ValueError(f"no mount for scanner {self.name!r}; there are: {', '.join(MOUNTS)}")
        if self.period_ns <= 0 or self.phase_ns < 0:
            raise ValueError(
                f"scanner {self.name!r} needs a period > 0 and a phase >= 0 ns, got"
                f" {self.period_ns} and {self.phase_ns}"
            )

    @property
    def beams(self) -> int:
        """Number of beams in a sweep."""
        return round(self.field_of_view / self.resolution) + 1

    def scan(self, stamp: int, ranges: FloatArray) -> Scan:
        """Return the message-like scan of ``ranges`` (beams,) [m] whose first beam was at ``stamp``."""
        return Scan.uniform(
            stamp,
            self.name,
            angle_min=-0.5 * self.field_of_view,
            angle_increment=self.resolution,
            time_increment=1e-9 * self.period_ns * self.resolution / (2.0 * math.pi),
            ranges=ranges,
            range_min=self.range_min,
            range_max=self.range_max,
        )


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
        pattern = config.scan(0, np.zeros(config.beams))
        self._offsets = pattern.offsets
        rays = np.stack(
            [np.cos(pattern.angles), np.sin(pattern.angles), np.zeros(config.beams)], axis=1
        )
        self._rays_in_base = rays @ mount.rotation.T
        self._next = config.phase_ns

    @property
    def start(self) -> int:
        """Time of the first beam of the next sweep [ns]."""
        return self._next

    @property
    def end(self) -> int:
        """Time of its last beam [ns]."""
        return self._next + int(self._offsets[-1])

    def sweep(self, track: Track) -> Scan:
        """Cast the sweep that has just ended; ``track`` must reach from ``start`` to ``end``."""
        positions, rotations = track.at(self._next + self._offsets)
        origins = positions + rotations @ self._mount.position
        directions = np.einsum("nij,nj->ni", rotations, self._rays_in_base)
        ranges = self._caster.cast(origins, directions, self._config.range_max)
        scan = self._config.scan(self._next, self._measured(ranges))
        self._next += self._config.period_ns
        return scan

    def _measured(self, ranges: FloatArray) -> FloatArray:
        c = self._config
        noisy = ranges + c.sigma * self._rng.standard_normal(len(ranges))
        noisy[noisy < c.range_min] = np.nan
        noisy[noisy > c.range_max] = np.inf
        return noisy
