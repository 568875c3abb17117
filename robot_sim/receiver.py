"""From the light that comes back to the ranges a scanner tells."""

from __future__ import annotations

from typing import Final

import numpy as np

from localization.types import IntArray
from robot_sim.arrays import FloatArray
from robot_sim.casting.caster import RayCaster
from robot_sim.effects import (
    SUB_BEAMS,
    Beam,
    Echoes,
    Effects,
    RangeNoise,
    detection_chances,
    dilution,
    false_echoes,
    footprint_depth,
    mixed,
    quantised,
    received_power,
    sub_beam_places,
    sub_rays,
    sunlit_sigma,
)
from robot_sim.optics import Optics
from robot_sim.sight import Light, Sight

_STREAMS: Final = ("footprint", "blend", "detection", "sunlight", "bias")
"""Whose random numbers are whose: children of the scanner's seed, in this order for good."""
_NOTICED: Final = 0.2
"""Of the threshold: echoes weaker than this are seen once in ten million times."""


class Receiver:
    """Owns the effects of one scanner and their random numbers.

    Each effect draws from a stream of its own, the same amount for each sweep, so that one effect
    more or less leaves the draws of the others, and the range noise, as they are.
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
        bound = effects.bias.bound if effects.bias is not None else 0.0
        self.bias = float(self._streams["bias"].uniform(-bound, bound))
        """This unit's constant error [m]."""

    def measured(self, distances: FloatArray) -> FloatArray:
        """Return ranges (N,) [m] of plain ``distances``: noise, bias and steps, and no optics."""
        sigma = self._noise.at(distances)
        return self._told(distances + sigma * self._rng.standard_normal(len(distances)))

    def sensed(
        self,
        caster: RayCaster,
        optics: Optics,
        origins: FloatArray,
        axes: FloatArray,
        times: IntArray,
        limits: tuple[float, float],
    ) -> tuple[FloatArray, FloatArray]:
        """Return ranges and remissions (N,) of beams: ``inf`` and 0 where there is no echo.

        Args:
            caster: Of the world.
            optics: Of its geoms.
            origins: (N, 3) in ``map`` [m].
            axes: (N, 3, 3): in its columns the direction of each beam, and two across it.
            times: (N,) of each beam [ns].
            limits: Least and greatest range [m].
        """
        effects, beam, n = self._effects, self._beam, len(origins)
        echoes = self._echoes(caster, optics, origins, axes, times, limits[1])
        depths = np.zeros(n)
        if effects.spreading is not None:
            depths = footprint_depth(beam, echoes.distances, echoes.cosines)
        power = received_power(echoes.remissions * dilution(beam, depths), echoes.distances)
        distances = echoes.distances
        sun = effects.sunlight
        if effects.sensitivity is not None:
            deafness = sun.level * sun.deafness if sun is not None else 0.0
            chances = detection_chances(power, effects.sensitivity, deafness)
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
        return self._told(distances + sigma * self._rng.standard_normal(n)), remissions

    def _echoes(
        self,
        caster: RayCaster,
        optics: Optics,
        origins: FloatArray,
        axes: FloatArray,
        times: IntArray,
        max_range: float,
    ) -> Echoes:
        """Return one echo of each beam: of its centre, or of what its sub-rays add up to."""
        effects, beam, n = self._effects, self._beam, len(origins)
        least = 0.0 if effects.sensitivity is None else _NOTICED * effects.sensitivity.threshold
        sight = Sight(caster, optics, effects.panes, max_range, least)
        if effects.mixing is None:
            return sight.look(Light.sent(origins, axes[:, :, 0], times))
        places = sub_beam_places(self._streams["footprint"].random((2, n)))
        light = Light.sent(*sub_rays(beam, places, origins, axes), np.tile(times, SUB_BEAMS))
        grid = _seen_by_all(sight, light, n)
        draws = self._streams["blend"].random((2, n))
        return mixed(beam, effects.mixing, grid, draws[0], draws[1])

    def _told(self, ranges: FloatArray) -> FloatArray:
        quantisation = self._effects.quantisation
        ranges = ranges + self.bias
        return ranges if quantisation is None else quantised(ranges, quantisation.step)


def _seen_by_all(sight: Sight, light: Light, beams: int) -> Echoes:
    """Return the echoes of all sub-rays (SUB_BEAMS, beams).

    Beyond clear things a beam is as thin as its centre: where that and another sub-ray have both hit
    something clear, they see the same.
    """
    echoes, hits = sight.first(light)
    shape = (SUB_BEAMS, beams)
    grid = Echoes(
        echoes.distances.reshape(shape),
        echoes.remissions.reshape(shape),
        echoes.cosines.reshape(shape),
    )
    clear = sight.optics.clear[hits.geoms].reshape(shape)
    same = clear & clear[0]
    same[0] = False
    sight.follow(light, echoes, hits, (clear & ~same).ravel())
    if same.any():
        for values in (grid.distances, grid.remissions, grid.cosines):
            values[same] = np.broadcast_to(values[0], shape)[same]
    return grid
