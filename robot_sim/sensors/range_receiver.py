"""Receiver of a scanner: measured ranges from distances or echoes, with noise and effects."""

from __future__ import annotations

from typing import Final

import numpy as np

from robot_sim.array_types import FloatArray
from robot_sim.raycasting.ray_caster import RayCaster
from robot_sim.sensors.echoes import (
    Echoes,
    detection_chances,
    dilution,
    false_echoes,
    footprint_depth,
    quantised_ranges,
    received_power,
    sunlit_sigma,
)
from robot_sim.sensors.lidar_effects import Beam, Effects, RangeNoise
from robot_sim.sensors.light_paths import LightTracer
from robot_sim.sensors.mixed_pixels import SUB_BEAMS, mixed, sub_beam_places, sub_rays
from robot_sim.sensors.surface_optics import SurfaceOptics

_STREAMS: Final = ("footprint", "blend", "detection", "sunlight", "bias")
"""Names of the effects' random streams: children of the scanner's seed, in this fixed order."""
_NOTICED: Final = 0.2
"""Share of the threshold below which echoes are detected less than once in ten million times."""


class RangeReceiver:
    """Owns the effects of one scanner and their random numbers.

    Each effect draws from a stream of its own, the same amount for each sweep, so that enabling an effect
    does not change the draws of the others or the range noise.
    """

    def __init__(
        self, effects: Effects, beam: Beam, noise: RangeNoise, seed: np.random.SeedSequence
    ) -> None:
        self._effects = effects
        self._beam = beam
        self._noise = noise
        # Noise draws from the seed itself, as a scanner without effects does; effects from its children.
        self._rng = np.random.default_rng(seed)
        children = (
            np.random.SeedSequence(seed.entropy, spawn_key=(*seed.spawn_key, i))
            for i in range(len(_STREAMS))
        )
        self._streams = dict(
            zip(_STREAMS, (np.random.default_rng(c) for c in children), strict=True)
        )
        self.rays_per_beam = 1 if effects.mixing is None else SUB_BEAMS
        """Number of rays that represent one beam: more than one where it has a footprint."""
        bound = effects.bias.bound if effects.bias is not None else 0.0
        self.bias = float(self._streams["bias"].uniform(-bound, bound))
        """Constant range error of this unit [m]."""

    def measured(self, distances: FloatArray) -> FloatArray:
        """Return ranges (N,) [m] for ``distances``, with noise, bias and resolution only."""
        sigma = self._noise.at(distances)
        return self._reported(distances + sigma * self._rng.standard_normal(len(distances)))

    def tracer(self, caster: RayCaster, optics: SurfaceOptics, max_range: float) -> LightTracer:
        """Return the tracer of the light of this receiver's scanner.

        Args:
            caster: Ray caster of the world.
            optics: Optical properties of its geoms.
            max_range: Greatest length of a path [m].
        """
        effects = self._effects
        least = 0.0 if effects.sensitivity is None else _NOTICED * effects.sensitivity.threshold
        seen = optics.opaque() if effects.panes is None else optics
        return LightTracer(caster, seen, effects.panes, max_range, least)

    def sent(self, origins: FloatArray, axes: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return origins [m] and directions (3, K, N) of the rays that represent beams.

        K is ``rays_per_beam``.

        Args:
            origins: (N, 3) in ``map`` [m].
            axes: (N, 3, 3) direction of each beam, and two axes across it, in the columns.
        """
        if self._effects.mixing is None:
            return origins.T[:, None], axes[:, :, 0].T[:, None]
        places = sub_beam_places(self._streams["footprint"].random((2, len(origins))))
        return sub_rays(self._beam, places, origins, axes)

    def sensed(
        self, received: Echoes, limits: tuple[float, float]
    ) -> tuple[FloatArray, FloatArray]:
        """Return ranges and remissions (N,) of beams: ``inf`` and 0 where there is no echo.

        Args:
            received: (K, N) echoes of the rays of ``sent``.
            limits: Least and greatest range [m].
        """
        effects, beam = self._effects, self._beam
        echoes = self._mixed(received)
        n = len(echoes.distances)
        depths = np.zeros(n)
        if effects.spreading is not None:
            depths = footprint_depth(beam, echoes.distances, echoes.cosines)
        power = received_power(echoes.remissions * dilution(beam, depths), echoes.distances)
        distances = echoes.distances
        sun = effects.sunlight
        if effects.sensitivity is not None:
            threshold_rise = sun.level * sun.threshold_rise if sun is not None else 0.0
            chances = detection_chances(power, effects.sensitivity, threshold_rise)
            seen = self._streams["detection"].random(n) < chances
            distances = np.where(seen, distances, np.inf)
        sigma = np.broadcast_to(self._noise.at(distances), (n,))
        if effects.spreading is not None:
            sigma = np.hypot(sigma, effects.spreading.gain * depths)
        if sun is not None:
            if effects.sensitivity is not None:
                sigma = sunlit_sigma(
                    sigma, power, effects.sensitivity.threshold, sun.level * sun.jitter
                )
            draws = self._streams["sunlight"].random((n, 2))
            chance = sun.level * sun.false_echoes
            false = false_echoes(np.isposinf(distances), chance, *limits, draws)
            distances = np.minimum(distances, false)
        remissions = np.where(np.isfinite(distances), echoes.remissions, 0.0)
        return self._reported(distances + sigma * self._rng.standard_normal(n)), remissions

    def _mixed(self, received: Echoes) -> Echoes:
        """Return one echo (N,) of each beam: that of its centre, or the mix of its sub-rays."""
        if self._effects.mixing is None:
            return Echoes(received.distances[0], received.remissions[0], received.cosines[0])
        blends, picks = self._streams["blend"].random((2, received.distances.shape[1]))
        return mixed(self._beam, self._effects.mixing, received, blends, picks)

    def _reported(self, ranges: FloatArray) -> FloatArray:
        quantisation = self._effects.quantisation
        ranges = ranges + self.bias
        return ranges if quantisation is None else quantised_ranges(ranges, quantisation.step)
