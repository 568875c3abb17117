"""Mixed pixels: a beam with a footprint, sampled by sub-rays, on the edge of two surfaces."""

from __future__ import annotations

from typing import Final

import numpy as np

from robot_sim.array_types import FloatArray
from robot_sim.sensors.echoes import Echoes, footprint_depth, received_power
from robot_sim.sensors.lidar_effects import Beam, Mixing

SUB_BEAMS: Final = 3
"""Number of sub-rays of a beam with a footprint: its centre, and two opposite each other around it."""


def sub_beam_places(uniforms: FloatArray) -> FloatArray:
    """Return positions of each beam's sub-rays in a unit disc, (SUB_BEAMS, 2, B).

    The first is at the centre and represents the inner third of the area; the other two are anywhere in
    the ring around it, opposite each other, so that a slanted plane's mean is its centre.

    Args:
        uniforms: (2, B) random numbers in [0, 1).
    """
    inner = 1.0 / SUB_BEAMS
    radius = np.sqrt(inner + (1.0 - inner) * uniforms[0])
    angle = 2.0 * np.pi * uniforms[1]
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    zero = np.zeros_like(x)
    return np.array([[zero, zero], [x, y], [-x, -y]])


def sub_rays(
    beam: Beam, places: FloatArray, origins: FloatArray, axes: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return origins and unit directions (3, SUB_BEAMS, B) of the beams' sub-rays.

    Args:
        beam: Spot of the beams.
        places: (SUB_BEAMS, 2, B) from ``sub_beam_places``: the centre, and two opposite each other.
        origins: (B, 3) origins of the beams [m].
        axes: (B, 3, 3) direction of each beam, and two axes across it, in the columns.
    """
    x, y = places[1]
    ahead, left, up = axes.T
    across = x * left + y * up
    half = 0.5 * beam.divergence
    scale = 1.0 / np.sqrt(1.0 + half**2 * (x * x + y * y))
    starts, directions = np.empty((2, 3, SUB_BEAMS, len(origins)))
    starts[:, 0], directions[:, 0] = origins.T, ahead
    aside = 0.5 * beam.aperture * across
    starts[:, 1], starts[:, 2] = origins.T + aside, origins.T - aside
    across *= half
    directions[:, 1], directions[:, 2] = (ahead + across) * scale, (ahead - across) * scale
    return starts, directions


def mixed(
    beam: Beam, mixing: Mixing, echoes: Echoes, blend_draws: FloatArray, pick_draws: FloatArray
) -> Echoes:
    """Return one echo per beam from the echoes of its sub-rays.

    Sub-rays on one surface give its mean. Where they form a near and a far group, or a group and
    nothing, the beam is on an edge. Echoes less than a pulse length apart blend, in ``mixing.blend`` of
    the cases, to the mean weighted by power; otherwise the beam gives the range of one group, with the
    probability of its share of the power; with nothing behind, always that of the near group.

    Args:
        beam: Spot and pulse of the beams.
        mixing: Share of ranges that blend.
        echoes: (K, N) echoes of the sub-rays.
        blend_draws: (N,) random numbers in [0, 1).
        pick_draws: (N,) random numbers in [0, 1).
    """
    seen = np.isfinite(echoes.distances)
    finite = np.where(seen, echoes.distances, 0.0)
    powers = received_power(echoes.remissions, finite) * seen
    # Sub-rays without power (an absorber) still give a distance; it is lost at the detection threshold.
    powers += _LEAST * seen
    lights = seen.astype(float)

    # There is an edge only where sub-rays are farther apart than a slanted plane explains.
    extent = finite.max(axis=0) - np.where(seen, finite, np.inf).min(axis=0)
    doubtful = np.flatnonzero(extent > _EDGE)
    if len(doubtful):
        lights[:, doubtful] *= _lights_kept(
            beam,
            mixing,
            echoes.distances.take(doubtful, axis=1),
            echoes.cosines.take(doubtful, axis=1),
            powers.take(doubtful, axis=1),
            blend_draws[doubtful],
            pick_draws[doubtful],
        )
    weights = powers * lights
    weight = weights.sum(axis=0)
    found = weight > 0.0
    scale = np.where(found, weight, 1.0)
    return Echoes(
        np.where(found, (weights * finite).sum(axis=0) / scale, np.inf),
        # Every sub-ray carries its share of the beam's light, whether it returns or not.
        (echoes.remissions * lights).sum(axis=0) / len(lights),
        np.where(found, (weights * echoes.cosines).sum(axis=0) / scale, 1.0),
    )


def _lights_kept(
    beam: Beam,
    mixing: Mixing,
    distances: FloatArray,
    cosines: FloatArray,
    powers: FloatArray,
    blend_draws: FloatArray,
    pick_draws: FloatArray,
) -> FloatArray:
    """Return the weight of each sub-ray (K, N) in the echo of its beam; see ``mixed``."""
    ordered = np.sort(distances, axis=0)
    # The widest gap between neighbours splits the sub-rays.
    with np.errstate(invalid="ignore"):
        gaps = np.diff(ordered, axis=0)
    gaps = np.where(np.isfinite(gaps), gaps, 0.0)
    split, beams = gaps.argmax(axis=0), np.arange(gaps.shape[1])
    gap, last = gaps[split, beams], ordered[split, beams]
    near = distances <= last
    slant = footprint_depth(beam, distances, cosines).max(axis=0)
    edge = gap > _EDGE + slant
    picks_near = pick_draws < (powers * near).sum(axis=0) / powers.sum(axis=0)
    blends = edge & (gap < beam.pulse_length) & (blend_draws < mixing.blend)
    kept = np.where(edge & ~blends, near == picks_near, 1.0)

    # Sub-rays give the near surface's share of the light to half a sub-ray; the remainder of the random
    # number by which they blend decides within that interval.
    rays = len(distances)
    lit, all_lit = near.sum(axis=0), np.isfinite(distances).sum(axis=0)
    even = np.where(blends, blend_draws / max(mixing.blend, 1e-12) - 0.5, 0.0)
    even[all_lit < rays] = 0.0
    shift_near = 1.0 + even / np.maximum(lit, 1)
    shift_far = 1.0 - even / np.maximum(rays - lit, 1)
    return np.asarray(kept * np.where(near, shift_near, shift_far))


_LEAST: Final = 1e-15
"""Negligible power that avoids a division by zero."""
_EDGE: Final = 0.05
"""Distance of sub-rays, beyond what a slanted plane explains, from which on they lie on two
surfaces [m]."""
