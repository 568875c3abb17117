"""Planar scanners: every beam is cast from where the scanner was at that beam's own time."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import mujoco
import numpy as np

from localization.types import FloatArray, IntArray, Pose, Scan
from robot_sim.p3at import MOUNTS, ROBOT_GROUP

SHARING_DISTANCE = 0.0005
"""Beams whose origins lie this close together [m] are cast from the first one's origin."""


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
    """Casts with ``mj_multiRay``, which takes one origin per call.

    Consecutive rays share a call while their origins lie within ``SHARING_DISTANCE``. Their ranges
    are then brought to their own origins along the plane that was hit, which is exact for flat
    surfaces; what remains is that an edge may appear up to ``SHARING_DISTANCE`` beside its place.
    At rest, one call serves a whole sweep and nothing is shared that is not the same.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        self._model = model
        self._data = data
        self._groups = np.ones(mujoco.mjNGROUP, dtype=np.uint8)
        self._groups[ROBOT_GROUP] = 0

    def cast(self, origins: FloatArray, directions: FloatArray, max_range: float) -> FloatArray:
        """See ``RayCaster.cast``."""
        n = len(origins)
        distances = np.empty(n)
        normals = np.empty((n, 3))
        geoms = np.empty(n, dtype=np.int32)
        vectors = np.ascontiguousarray(directions, dtype=float)
        starts = bundle_starts(origins, SHARING_DISTANCE)
        shared = np.empty((n, 3))
        for i, j in zip(starts, [*starts[1:], n], strict=True):
            shared[i:j] = origins[i]
            mujoco.mj_multiRay(
                m=self._model,
                d=self._data,
                pnt=origins[i],
                vec=vectors[i:j].reshape(-1),
                geomgroup=self._groups,
                flg_static=True,
                bodyexclude=-1,
                geomid=geoms[i:j],
                dist=distances[i:j],
                normal=normals[i:j].reshape(-1),
                nray=j - i,
                cutoff=max_range,
            )
        distances[geoms < 0] = np.inf
        facing = np.einsum("ij,ij->i", vectors, normals)
        shift = np.einsum("ij,ij->i", origins - shared, normals)
        # A ray that grazes a surface says nothing about where it would meet it from elsewhere.
        usable = (np.abs(facing) > 0.02) & (geoms >= 0)
        distances[usable] -= shift[usable] / facing[usable]
        distances[distances > max_range] = np.inf
        return distances


def bundle_starts(origins: FloatArray, reach: float) -> list[int]:
    """Return the index of the first ray of each bundle that keeps within ``reach`` [m] of its first."""
    starts = []
    i, n = 0, len(origins)
    while i < n:
        starts.append(i)
        far = np.einsum("ij,ij->i", origins[i:] - origins[i], origins[i:] - origins[i]) > reach**2
        i += int(np.argmax(far)) if far.any() else n - i
    return starts


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """Where ``base_link`` was at each physics step, oldest first."""

    stamps: IntArray
    """(K,) [ns], increasing by one step."""
    positions: FloatArray
    """(K, 3) in ``map`` [m]."""
    quaternions_wxyz: FloatArray
    """(K, 4)."""

    def at(self, times: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return positions (N, 3) [m] and rotations (N, 3, 3) of ``base_link`` at ``times`` (N,) [ns].

        Quaternions are blended linearly: between steps of 2 ms the robot turns by 5 mrad at most,
        for which that is exact to 1e-8 rad.
        """
        last = np.clip(np.searchsorted(self.stamps, times, "right"), 1, len(self.stamps) - 1)
        before = last - 1
        span = (self.stamps[last] - self.stamps[before]).astype(float)
        f = ((times - self.stamps[before]) / span)[:, None]
        positions = self.positions[before] * (1.0 - f) + self.positions[last] * f
        q = self.quaternions_wxyz[before] * (1.0 - f) + self.quaternions_wxyz[last] * f
        q /= np.linalg.norm(q, axis=1, keepdims=True)
        return positions, _rotations(q)


def _rotations(quaternions_wxyz: FloatArray) -> FloatArray:
    w, x, y, z = quaternions_wxyz.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


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
