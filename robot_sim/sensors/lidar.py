"""Planar scanners: every beam is cast from where the scanner was at that beam's own time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from localization.types import IntArray, Pose, Scan
from robot_sim.array_types import FloatArray
from robot_sim.errors import SensorError
from robot_sim.raycasting import RayCaster
from robot_sim.sensors.beam_pattern import BeamPattern
from robot_sim.sensors.echoes import Echoes
from robot_sim.sensors.light_paths import LightTracer
from robot_sim.sensors.pose_history import PoseHistory as PoseHistory
from robot_sim.sensors.range_receiver import RangeReceiver
from robot_sim.sensors.scanner_config import ScannerConfig as ScannerConfig
from robot_sim.sensors.surface_optics import SurfaceOptics


class Scanner:
    """One scanner: knows when its next sweep ends, and casts it then."""

    def __init__(
        self,
        config: ScannerConfig,
        mount: Pose,
        caster: RayCaster,
        seed: np.random.SeedSequence,
        optics: SurfaceOptics | None = None,
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
        self._caster = caster
        self._receiver = RangeReceiver(config.effects, config.beam, config.noise, seed)
        self.tracer: LightTracer | None = None
        """What follows its light; None where a beam is one ray, whose distance alone matters."""
        if config.effects.optical and optics is not None:
            self.tracer = self._receiver.tracer(caster, optics, config.range_max)
        patterns = [
            config.scan(0, np.zeros(config.beams_of(part)), part=part)
            for part in range(config.interlace)
        ]
        self._offsets = [pattern.offsets for pattern in patterns]
        self._patterns = patterns
        self._fans = [BeamPattern(mount, pattern.angles, pattern.offsets) for pattern in patterns]
        # Asked for in every tick, hence plain attributes.
        self.plain = self.tracer is None
        """Whether a beam is one ray, whose distance alone matters."""
        self.rays_per_beam = self._receiver.rays_per_beam
        """How many rays stand for one beam."""
        self.range_max = config.range_max
        """Farther surfaces give no return [m]."""
        self.start = 0
        """Time of the first beam of the next sweep [ns]."""
        self.end = 0
        """Time of its last beam [ns]."""
        self._picture = config.phase_ns
        self._wait_for(0)

    @property
    def beams(self) -> int:
        """Number of beams of the next sweep."""
        return len(self._offsets[self._part])

    def _wait_for(self, part: int) -> None:
        self._part = part
        self.start = self._picture + self._config.start_of(part)
        self.end = self.start + int(self._offsets[part][-1])

    def sweep(self, track: PoseHistory) -> Scan:
        """Cast the sweep that has just ended; ``track`` must reach from ``start`` to ``end``."""
        if self.plain:
            rays = self.rays_of_sweep(track)
            return self.scan_from_distances(self._caster.distances(*rays, self.range_max))
        assert self.tracer is not None
        return self.scan_from_echoes(self.tracer.trace_beams(*self.emitted_rays(track)))

    def rays_of_sweep(self, track: PoseHistory) -> tuple[FloatArray, FloatArray, IntArray]:
        """Return origins (N, 3) [m], directions (N, 3) and times (N,) [ns] of the sweep that has ended."""
        origins, directions = self._fans[self._part].rays(track, self.start)
        return origins, directions, self.start + self._offsets[self._part]

    def scan_from_distances(self, distances: FloatArray) -> Scan:
        """Return the scan for the distances (N,) [m] that the rays of ``rays_of_sweep`` went."""
        return self._scan(self._receiver.measured(distances), _NO_REMISSIONS)

    def emitted_rays(self, track: PoseHistory) -> tuple[FloatArray, FloatArray, IntArray]:
        """Return the light of the sweep that has ended, as ``Sight.trace_beams`` takes it."""
        origins, axes = self._fans[self._part].axes(track, self.start)
        starts, directions = self._receiver.sent(origins, axes)
        return starts, directions, self.start + self._offsets[self._part]

    def scan_from_echoes(self, echoes: Echoes) -> Scan:
        """Return the scan for the echoes (K, N) of what ``emitted_rays`` has sent."""
        limits = (self._config.range_min, self._config.range_max)
        return self._scan(*self._receiver.sensed(echoes, limits))

    def _scan(self, ranges: FloatArray, remissions: FloatArray) -> Scan:
        """Return the scan of the sweep that has ended, and wait for the next one."""
        config, part = self._config, self._part
        np.putmask(ranges, ranges < config.range_min, np.nan)
        np.putmask(ranges, ranges > config.range_max, np.inf)
        pattern = self._patterns[part]
        # A scan has the resolution of its message, which is that of float32. What is its own and
        # cannot be written to, it does not copy.
        told, intensities = (
            values.astype(np.float32).astype(float) for values in (ranges, remissions)
        )
        told.flags.writeable = intensities.flags.writeable = False
        scan = Scan(
            stamp=self.start,
            scanner=pattern.scanner,
            angles=pattern.angles,
            ranges=told,
            intensities=intensities,
            offsets=pattern.offsets,
            range_min=pattern.range_min,
            range_max=pattern.range_max,
        )
        if part + 1 == config.interlace:
            self._picture += config.period_ns
        self._wait_for((part + 1) % config.interlace)
        return scan


def scans_until(
    stamp: int, scanners: Sequence[Scanner], caster: RayCaster, track: PoseHistory
) -> list[Scan]:
    """Return the sweeps of all scanners that have ended by ``stamp`` [ns], by their ends.

    Sweeps that end in the same tick are cast together, those with effects where they see alike: half the
    cost of a sweep is in handing it over, however many its rays are.

    Args:
        stamp: Until when [ns].
        scanners: Of one robot; ties are in their order.
        caster: The one they all cast with.
        track: From the first of these sweeps' begin until ``stamp``.
    """
    scans: list[Scan] = []
    while due := [scanner for scanner in scanners if scanner.end <= stamp]:
        together = [scanner for scanner in due if scanner.plain]
        if len(together) > 1:
            rays = [scanner.rays_of_sweep(track) for scanner in together]
            origins = np.concatenate([r[0] for r in rays])
            directions = np.concatenate([r[1] for r in rays])
            times = np.concatenate([r[2] for r in rays])
            reach = max([scanner.range_max for scanner in together])
            distances = caster.distances(origins, directions, times, reach)
        heard = _seen_together([scanner for scanner in due if not scanner.plain], track)
        first = 0
        for scanner in due:
            if scanner in heard:
                scans.append(scanner.scan_from_echoes(heard[scanner]))
                continue
            if not scanner.plain or len(together) == 1:
                scans.append(scanner.sweep(track))
                continue
            mine = distances[first : first + scanner.beams]
            first += scanner.beams
            if scanner.range_max < reach:
                mine[mine > scanner.range_max] = np.inf
            scans.append(scanner.scan_from_distances(mine))
    if len(scans) > 1:
        scans.sort(key=lambda scan: scan.end_stamp)
    return scans


def _seen_together(scanners: Sequence[Scanner], track: PoseHistory) -> dict[Scanner, Echoes]:
    """Return the echoes of scanners' sweeps, cast together; of none unless all see alike."""
    sights = [scanner.tracer for scanner in scanners if scanner.tracer is not None]
    if len(sights) < 2 or not all(sight.traces_like(sights[0]) for sight in sights[1:]):
        return {}
    if len({scanner.rays_per_beam for scanner in scanners}) > 1:
        return {}
    sent = [scanner.emitted_rays(track) for scanner in scanners]
    echoes = sights[0].trace_beams(
        *(np.concatenate(part, axis=-1) for part in zip(*sent, strict=True))
    )
    ends = np.cumsum([scanner.beams for scanner in scanners])
    return {
        scanner: echoes.of(slice(end - scanner.beams, end))
        for scanner, end in zip(scanners, ends, strict=True)
    }


_NO_REMISSIONS: Final = np.zeros(0)
