"""Planar scanners: every beam is cast from where the scanner was at that beam's own time."""

from __future__ import annotations

import numpy as np

from localization.types import Pose, Scan
from robot_sim.arrays import FloatArray
from robot_sim.casting import RayCaster
from robot_sim.scanner_config import ScannerConfig as ScannerConfig
from robot_sim.track import Track as Track


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
        times = start + self._offsets[part]
        positions, rotations = track.at(times)
        origins = positions + rotations @ self._mount.position
        directions = np.einsum("nij,nj->ni", rotations, self._rays_in_base[part])
        ranges = self._caster.distances(origins, directions, times, config.range_max)
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
