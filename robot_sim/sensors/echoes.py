"""Echoes of laser beams: received power by the lidar equation, detection, and errors of the range.

Powers are relative: 1 is what a matt white surface, met at normal incidence at 1 m, sends back. A
*remission* is a power without the effect of range: a property of the surface.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robot_sim.array_types import BoolArray, FloatArray
from robot_sim.sensors.lidar_effects import Beam, Sensitivity


def received_power(remissions: FloatArray, distances: FloatArray) -> FloatArray:
    """Return the echoes' power by the lidar equation of a surface that fills the beam; 0 from afar."""
    near = np.maximum(distances, 1e-3)
    return np.asarray(remissions / (near * near))


def footprint_depth(beam: Beam, distances: FloatArray, cosines: FloatArray) -> FloatArray:
    """Return over how much range the spot is spread on a plane surface [m]: spot x tan(incidence)."""
    c = np.clip(cosines, 1e-3, 1.0)
    finite = np.isfinite(distances)
    spots = beam.spot(np.where(finite, distances, 0.0))
    return np.where(finite, spots * np.sqrt(1.0 - c * c) / c, 0.0)


def dilution(beam: Beam, depths: FloatArray) -> FloatArray:
    """Return what a stretched echo's peak has left: pulse and footprint add up in quadrature."""
    return np.asarray(1.0 / np.sqrt(1.0 + (depths / beam.pulse_length) ** 2))


@dataclass(frozen=True, slots=True, eq=False)
class Echoes:
    """One echo of each of N beams, or of each sub-ray (K, N) of them."""

    distances: FloatArray
    """[m]; ``inf`` where there is none."""
    remissions: FloatArray
    """Against a white surface met square on; 0 where there is none."""
    cosines: FloatArray
    """|cos| of the incidence; of no meaning where there is no echo."""

    def of(self, beams: slice) -> Echoes:
        """Return those of some of the beams."""
        return Echoes(
            self.distances[..., beams], self.remissions[..., beams], self.cosines[..., beams]
        )


def detection_chances(power: FloatArray, sensitivity: Sensitivity, sun: float) -> FloatArray:
    """Return how likely echoes of ``power`` (N,) are measured.

    Args:
        power: See the module.
        sensitivity: The receiver.
        sun: By how much daylight raises the power needed, as a share.
    """
    ratio = np.maximum(power, 1e-12) / (sensitivity.threshold * (1.0 + sun))
    return np.asarray(
        1.0 / (1.0 + np.exp(np.minimum(-np.log(ratio) / sensitivity.softness, 500.0)))
    )


def sunlit_sigma(sigma: FloatArray, power: FloatArray, threshold: float, sun: float) -> FloatArray:
    """Return ``sigma`` (N,) [m] as daylight swells it: the more, the weaker the echo."""
    weakness = np.minimum(threshold / np.maximum(power, 1e-12), 1.0)
    return np.asarray(sigma * (1.0 + sun * weakness))


def false_echoes(
    lost: BoolArray, chance: float, nearest: float, farthest: float, draws: FloatArray
) -> FloatArray:
    """Return random ranges (N,) [m] where ``chance`` gives a lost beam one; ``inf`` elsewhere.

    Args:
        lost: (N,) beams without an echo.
        chance: Share of them.
        nearest: Least range [m].
        farthest: Greatest range [m].
        draws: (N, 2) random numbers in [0, 1).
    """
    told = lost & (draws[:, 0] < chance)
    return np.where(told, nearest + (farthest - nearest) * draws[:, 1], np.inf)


def quantised_ranges(ranges: FloatArray, step: float) -> FloatArray:
    """Return ``ranges`` (N,) [m] in whole steps; what is not finite stays."""
    return np.asarray(np.rint(ranges / step) * step)
