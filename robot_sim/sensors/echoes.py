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
    """Return the power of echoes by the lidar equation of a surface that fills the beam."""
    near = np.maximum(distances, 1e-3)
    return np.asarray(remissions / (near * near))


def footprint_depth(beam: Beam, distances: FloatArray, cosines: FloatArray) -> FloatArray:
    """Return the extent in range of the spot on a plane surface [m]: spot x tan(incidence)."""
    c = np.clip(cosines, 1e-3, 1.0)
    finite = np.isfinite(distances)
    spots = beam.spot(np.where(finite, distances, 0.0))
    return np.where(finite, spots * np.sqrt(1.0 - c * c) / c, 0.0)


def dilution(beam: Beam, depths: FloatArray) -> FloatArray:
    """Return the peak power that is left of a stretched echo: pulse and footprint add in quadrature."""
    return np.asarray(1.0 / np.sqrt(1.0 + (depths / beam.pulse_length) ** 2))


@dataclass(frozen=True, slots=True, eq=False)
class Echoes:
    """One echo of each of N beams, or of each of their sub-rays (K, N)."""

    distances: FloatArray
    """Distances [m]; ``inf`` without an echo."""
    remissions: FloatArray
    """Remissions, relative to a white surface at normal incidence; 0 without an echo."""
    cosines: FloatArray
    """Absolute cosines of the angle of incidence; undefined without an echo."""

    def of(self, beams: slice) -> Echoes:
        """Return the echoes of a slice of the beams."""
        return Echoes(
            self.distances[..., beams], self.remissions[..., beams], self.cosines[..., beams]
        )


def detection_chances(power: FloatArray, sensitivity: Sensitivity, sun: float) -> FloatArray:
    """Return the probability that echoes of ``power`` (N,) are measured.

    Args:
        power: (N,) received power, relative to a white surface at 1 m.
        sensitivity: Detection threshold of the receiver.
        sun: Increase of the threshold by daylight, as a share.
    """
    ratio = np.maximum(power, 1e-12) / (sensitivity.threshold * (1.0 + sun))
    return np.asarray(
        1.0 / (1.0 + np.exp(np.minimum(-np.log(ratio) / sensitivity.softness, 500.0)))
    )


def sunlit_sigma(sigma: FloatArray, power: FloatArray, threshold: float, sun: float) -> FloatArray:
    """Return ``sigma`` (N,) [m] increased by daylight: the more, the weaker the echo."""
    weakness = np.minimum(threshold / np.maximum(power, 1e-12), 1.0)
    return np.asarray(sigma * (1.0 + sun * weakness))


def false_echoes(
    lost: BoolArray, chance: float, nearest: float, farthest: float, draws: FloatArray
) -> FloatArray:
    """Return random ranges (N,) [m] for a share ``chance`` of the lost beams; ``inf`` elsewhere.

    Args:
        lost: (N,) whether a beam has no echo.
        chance: Probability of a false echo.
        nearest: Least range [m].
        farthest: Greatest range [m].
        draws: (N, 2) random numbers in [0, 1).
    """
    false = lost & (draws[:, 0] < chance)
    return np.where(false, nearest + (farthest - nearest) * draws[:, 1], np.inf)


def quantised_ranges(ranges: FloatArray, step: float) -> FloatArray:
    """Return ``ranges`` (N,) [m] in integer steps; values that are not finite are kept."""
    return np.asarray(np.rint(ranges / step) * step)
