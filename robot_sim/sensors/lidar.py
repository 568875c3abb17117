"""Planar lidar: sweeps in which every beam is cast from the scanner's pose at that beam's time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from localization.types import IntArray, Pose, Scan
from robot_sim.array_types import FloatArray
from robot_sim.errors import SensorError
from robot_sim.raycasting import RayCaster
from robot_sim.sensors.arm_shadow import ArmShadow
from robot_sim.sensors.beam_pattern import BeamPattern
from robot_sim.sensors.echoes import Echoes
from robot_sim.sensors.light_paths import LightTracer
from robot_sim.sensors.pose_history import PoseHistory as PoseHistory
from robot_sim.sensors.range_receiver import RangeReceiver
from robot_sim.sensors.scanner_config import ScannerConfig as ScannerConfig
from robot_sim.sensors.scanner_fault import DirtyWindow, ScannerFault
from robot_sim.sensors.surface_optics import SurfaceOptics


class Scanner:
    """One scanner, which casts its sweeps when they end."""

    def __init__(
        self,
        config: ScannerConfig,
        mount: Pose,
        caster: RayCaster,
        seed: np.random.SeedSequence,
        optics: SurfaceOptics | None = None,
        *,
        faults: Sequence[ScannerFault] = (),
        shadow: ArmShadow | None = None,
    ) -> None:
        """Mount a scanner.

        Args:
            config: Configuration of the scanner.
            mount: ``base_from_scanner``.
            caster: Ray caster of the world.
            seed: Seed of its noise and effects.
            optics: Optics of the world's geoms; needed by effects that depend on the surface.
            faults: Its faults; dirt on its window is applied here.
            shadow: Shadow of the robot's arm, if it has one.

        Raises:
            SensorError: Such an effect is enabled without optics.
        """
        if config.effects.optical and optics is None:
            raise SensorError(
                f"effects of scanner {config.name!r} need the world's optics_of(model)"
            )
        self._config = config
        self._caster = caster
        self._receiver = RangeReceiver(config.effects, config.beam, config.noise, seed)
        self._shadow = shadow
        self._dirt = DirtyWindow(faults, config.beams, config.interlace, seed) if faults else None
        self.tracer: LightTracer | None = None
        """Tracer of its light; None where a beam is a single ray of which only the distance matters."""
        if config.effects.optical and optics is not None:
            self.tracer = self._receiver.tracer(caster, optics, config.range_max)
        patterns = [
            config.scan(0, np.zeros(config.beams_of(part)), part=part)
            for part in range(config.interlace)
        ]
        self._offsets = [pattern.offsets for pattern in patterns]
        self._patterns = patterns
        self._fans = [BeamPattern(mount, pattern.angles, pattern.offsets) for pattern in patterns]
        # Read in every tick, hence plain attributes.
        self.plain = self.tracer is None
        """Whether a beam is a single ray of which only the distance matters."""
        self.rays_per_beam = self._receiver.rays_per_beam
        """Number of rays that represent one beam."""
        self.range_max = config.range_max
        """Range beyond which surfaces give no return [m]."""
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

    def rays_of_sweep(self, track: PoseHistory) -> tuple[FloatArray, FloatArray, IntArray]:
        """Return origins (N, 3) [m], directions (N, 3) and times (N,) [ns] of the sweep that has ended."""
        origins, directions = self._fans[self._part].rays(track, self.start)
        return origins, directions, self.start + self._offsets[self._part]

    def scan_from_distances(self, distances: FloatArray) -> Scan:
        """Return the scan for the distances (N,) [m] of the rays of ``rays_of_sweep``."""
        return self._scan(self._receiver.measured(distances), _NO_REMISSIONS)

    def emitted_rays(self, track: PoseHistory) -> tuple[FloatArray, FloatArray, IntArray]:
        """Return the rays of the sweep that has ended, as ``LightTracer.trace_beams`` takes them."""
        origins, axes = self._fans[self._part].axes(track, self.start)
        starts, directions = self._receiver.sent(origins, axes)
        return starts, directions, self.start + self._offsets[self._part]

    def scan_from_echoes(self, echoes: Echoes) -> Scan:
        """Return the scan for the echoes (K, N) of the rays of ``emitted_rays``."""
        limits = (self._config.range_min, self._config.range_max)
        return self._scan(*self._receiver.sensed(echoes, limits))

    def _scan(self, ranges: FloatArray, remissions: FloatArray) -> Scan:
        """Return the scan of the sweep that has ended, and begin to wait for the next one."""
        config, part = self._config, self._part
        if self._shadow is not None:
            times = self.start + self._offsets[part]
            angles = self._patterns[part].angles
            self._shadow.cover(config.name, angles, times, ranges, remissions)
        if self._dirt is not None:
            self._dirt.cover(ranges, remissions, self.start + self._offsets[part], part)
        np.putmask(ranges, ranges < config.range_min, np.nan)
        np.putmask(ranges, ranges > config.range_max, np.inf)
        pattern = self._patterns[part]
        # A scan has the resolution of its message, float32. Read-only arrays that own their memory are
        # not copied by it.
        rounded, intensities = (
            values.astype(np.float32).astype(float) for values in (ranges, remissions)
        )
        rounded.flags.writeable = intensities.flags.writeable = False
        scan = Scan(
            stamp=self.start,
            scanner=pattern.scanner,
            angles=pattern.angles,
            ranges=rounded,
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
    """Return the scans of all scanners that have ended by ``stamp`` [ns], ordered by their ends.

    Sweeps that end in the same tick are cast together, those with effects if their tracers are alike:
    half the cost of a sweep does not depend on the number of its rays.

    Args:
        stamp: Time until which sweeps have ended [ns].
        scanners: Scanners of one robot; ties are in their order.
        caster: Ray caster that all of them use.
        track: Poses from the beginning of the first of these sweeps until ``stamp``.
    """
    scans: list[Scan] = []
    while due := [scanner for scanner in scanners if scanner.end <= stamp]:
        plain = [scanner for scanner in due if scanner.plain]
        optical = [scanner for scanner in due if not scanner.plain]
        measured = dict([*_measured(plain, caster, track), *_traced(optical, track)])
        scans += [measured[scanner] for scanner in due]
    if len(scans) > 1:
        scans.sort(key=lambda scan: scan.end_stamp)
    return scans


def _measured(
    scanners: Sequence[Scanner], caster: RayCaster, track: PoseHistory
) -> Iterator[tuple[Scanner, Scan]]:
    """Yield the scans of scanners whose beams are single rays, cast together."""
    if not scanners:
        return
    rays = [scanner.rays_of_sweep(track) for scanner in scanners]
    reach = max([scanner.range_max for scanner in scanners])
    origins, directions = (np.concatenate([ray[part] for ray in rays]) for part in (0, 1))
    times = np.concatenate([ray[2] for ray in rays])
    distances = caster.distances(origins, directions, times, reach)
    first = 0
    for scanner in scanners:
        mine = distances[first : first + scanner.beams]
        first += scanner.beams
        if scanner.range_max < reach:
            mine[mine > scanner.range_max] = np.inf
        yield scanner, scanner.scan_from_distances(mine)


def _traced(scanners: Sequence[Scanner], track: PoseHistory) -> Iterator[tuple[Scanner, Scan]]:
    """Yield the scans of scanners with effects, traced together if all tracers are alike."""
    tracers = [scanner.tracer for scanner in scanners if scanner.tracer is not None]
    alike = all(tracer.traces_like(tracers[0]) for tracer in tracers)
    alike &= len({scanner.rays_per_beam for scanner in scanners}) == 1
    size = len(scanners) if alike else 1
    for number in range(0, len(scanners), size):
        group = scanners[number : number + size]
        sent = zip(*(scanner.emitted_rays(track) for scanner in group), strict=True)
        echoes = tracers[number].trace_beams(*(np.concatenate(part, axis=-1) for part in sent))
        first = 0
        for scanner in group:
            mine = slice(first, first + scanner.beams)
            first += scanner.beams
            yield scanner, scanner.scan_from_echoes(echoes.of(mine))


_NO_REMISSIONS: Final = np.zeros(0)
