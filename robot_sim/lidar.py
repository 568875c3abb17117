"""Planar scanners: every beam is cast from where the scanner was at that beam's own time."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from localization.types import Pose, Scan
from robot_sim.arrays import FloatArray
from robot_sim.casting import RayCaster
from robot_sim.errors import SensorError
from robot_sim.fan import Fan
from robot_sim.optics import Optics
from robot_sim.receiver import Receiver
from robot_sim.scanner_config import ScannerConfig as ScannerConfig
from robot_sim.track import Track as Track


class Scanner:
    """One scanner: knows when its next sweep ends, and casts it then."""

    def __init__(
        self,
        config: ScannerConfig,
        mount: Pose,
        caster: RayCaster,
        seed: np.random.SeedSequence,
        optics: Optics | None = None,
    ) -> None:
        """Mount a scanner.

        Args:
            config: What it is.
            mount: ``base_from_scanner``.
            caster: Of the world.
            seed: Of its noise and effects.
            optics: Of the world's geoms; needed by effects that depend on what a beam hits.

        Raises:
            SensorError: Such an effect is on, and there are no optics.
        """
        if config.effects.optical and optics is None:
            raise SensorError(
                f"effects of scanner {config.name!r} need the world's optics_of(model)"
            )
        self._config = config
        self._mount = mount
        self._caster = caster
        self._optics = None
        if config.effects.optical and optics is not None:
            self._optics = optics.opaque() if config.effects.panes is None else optics
        self._receiver = Receiver(config.effects, config.beam, config.noise, seed)
        patterns = [
            config.scan(0, np.zeros(config.beams_of(part)), part=part)
            for part in range(config.interlace)
        ]
        self._offsets = [pattern.offsets for pattern in patterns]
        self._patterns = patterns
        self._fans = [Fan(mount, pattern.angles, pattern.offsets) for pattern in patterns]
        self._axes_in_base = [mount.rotation @ _axes(pattern.angles) for pattern in patterns]
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
        if self._optics is None:
            origins, directions = self._fans[part].rays(track, start)
            distances = self._caster.distances(origins, directions, times, config.range_max)
            ranges, remissions = self._receiver.measured(distances), _NO_REMISSIONS
        else:
            positions, rotations = track.at(times)
            origins = positions + rotations @ self._mount.position
            axes = rotations @ self._axes_in_base[part]
            limits = (config.range_min, config.range_max)
            ranges, remissions = self._receiver.sensed(
                self._caster, self._optics, origins, axes, times, limits
            )
        ranges[ranges < config.range_min] = np.nan
        ranges[ranges > config.range_max] = np.inf
        # A scan has the resolution of its message, which is that of float32.
        scan = replace(
            self._patterns[part],
            stamp=start,
            ranges=ranges.astype(np.float32).astype(float),
            intensities=remissions.astype(np.float32).astype(float),
        )
        self._part = (part + 1) % config.interlace
        self._picture += config.period_ns if self._part == 0 else 0
        return scan


_NO_REMISSIONS: Final = np.zeros(0)


def _axes(angles: FloatArray) -> FloatArray:
    """Return for each beam (N, 3, 3), in columns: its direction, left of it, and up."""
    c, s, zero, one = np.cos(angles), np.sin(angles), np.zeros_like(angles), np.ones_like(angles)
    rows = [[c, -s, zero], [s, c, zero], [zero, zero, one]]
    return np.moveaxis(np.array(rows), 2, 0)
