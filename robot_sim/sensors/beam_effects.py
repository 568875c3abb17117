"""What befalls a beam of light: pure functions on arrays, and the numbers that steer them.

Powers are relative: 1 is what a matt white surface, met square on at 1 m, sends back. A *remission*
is a power with the range taken out: what the surface does, whatever its distance. Sources that end
in (M) were quoted from memory of the data sheet or paper named.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Final

import numpy as np

from robot_sim.array_types import BoolArray, FloatArray
from robot_sim.errors import SensorError

SUB_BEAMS: Final = 3
"""Rays that stand for one beam with a footprint: its centre, and two opposite each other around it."""


@dataclass(frozen=True, slots=True)
class Beam:
    """The laser pulse as it leaves the scanner; the defaults are the LMS1xx'."""

    divergence: float = 0.015
    """Full angle [rad]; SICK, LMS1xx operating instructions: spot = 15 mrad x distance + 8 mm."""
    aperture: float = 0.008
    """Spot at the front window [m]; as above."""
    pulse_length: float = 0.6
    """Echoes nearer to each other than this [m] reach the receiver as one: half of what light goes in
    a pulse of 4 ns; chosen, for the makers do not say, and diodes at 905 nm give 3 to 5 ns."""

    def __post_init__(self) -> None:
        _not_negative(self)

    def spot(self, distances: FloatArray) -> FloatArray:
        """Return the beam's diameter at ``distances`` (N,) [m]."""
        return self.aperture + self.divergence * distances


@dataclass(frozen=True, slots=True)
class RangeNoise:
    """The statistical error of a range."""

    sigma: float
    """One standard deviation [m]."""
    bands: tuple[tuple[float, float], ...] = ()
    """Pairs of a range [m] and the sigma from there on [m], in order of range."""

    def __post_init__(self) -> None:
        starts = [start for start, _ in self.bands]
        if not all(0.0 <= s < math.inf for s in (self.sigma, *(s for _, s in self.bands))):
            raise SensorError(f"sigma must be >= 0 and finite, got {self.sigma} and {self.bands}")
        if starts != sorted(starts):
            raise SensorError(f"sigma_bands must be in order of range, got {self.bands}")

    def at(self, distances: FloatArray) -> FloatArray | float:
        """Return sigma [m] at ``distances`` (N,) [m]; one number if it is the same everywhere."""
        if not self.bands:
            return self.sigma
        starts = np.array([start for start, _ in self.bands])
        sigmas = np.array([self.sigma, *(sigma for _, sigma in self.bands)])
        return sigmas[np.searchsorted(starts, distances, side="right")]


@dataclass(frozen=True, slots=True)
class Mixing:
    """Beams are as wide as their spot; at an edge they see both surfaces (mixed pixels)."""

    blend: float = 0.7
    """Share of edge beams, with echoes less than a pulse length apart, whose range lies in between; the
    others tell one of the two. Chosen: Ye and Borenstein 2002 report both kinds for the LMS-200."""

    def __post_init__(self) -> None:
        _share(self, "blend")


@dataclass(frozen=True, slots=True)
class Spreading:
    """A footprint on a slanted surface is stretched in range: a weaker and less certain echo."""

    gain: float = 0.05
    """Standard deviation that is added, as a share of the footprint's depth. Chosen; it doubles an
    LMS1xx' 12 mm at 5 m and 79 deg, where Soudarissanane et al. 2011 and Ye and Borenstein 2002 see
    errors grow (M)."""

    def __post_init__(self) -> None:
        _not_negative(self)


@dataclass(frozen=True, slots=True)
class Sensitivity:
    """Echoes below what the receiver needs are lost: dark, distant and grazed surfaces."""

    range_at_10_percent: float = 18.0
    """How far a surface of 10 % remission, met square on, is measured reliably [m]; of the data sheet,
    here the LMS111's."""
    softness: float = 0.10
    """Width of the step from seen to lost, in natural logarithms of power; chosen (speckle)."""
    reliability: float = 0.95
    """Share of beams measured at that range; chosen for the data sheets' "reliably"."""

    def __post_init__(self) -> None:
        _positive(self, "range_at_10_percent", "softness")
        if not 0.5 <= self.reliability < 1.0:
            raise SensorError(f"reliability must be in [0.5, 1), got {self.reliability}")

    @property
    def threshold(self) -> float:
        """Power that every second beam is measured at."""
        odds = self.reliability / (1.0 - self.reliability)
        return float(0.1 / self.range_at_10_percent**2 * odds**-self.softness)


@dataclass(frozen=True, slots=True)
class Panes:
    """Glass lets light through and mirrors it; mirrors mirror it."""

    depth: int = 3
    """How often a ray is cast on, beyond what it has hit first. Two panes are not all that matters: of
    the light that crosses three, 0.82 each, 0.30 is left both ways, and with the LMS111's threshold a
    wall of 50 % remission is still seen from 25 m, beyond its range. What makes light not worth
    following is its power, which is looked at ray by ray."""
    lobe: float = math.radians(1.0)
    """Half-width of incidence within which the mirrored beam comes straight back [rad]; chosen: a beam's
    divergence plus a pane's flatness. Papers on finding glass see it within one to a few degrees."""
    glint: float = 30.0
    """Remission of a perfect mirror met square on; chosen, of a retroreflector's size."""

    def __post_init__(self) -> None:
        if self.depth < 1:
            raise SensorError(f"depth must be at least 1, got {self.depth}")
        _positive(self, "lobe")
        _not_negative(self)


@dataclass(frozen=True, slots=True)
class Sunlight:
    """Daylight in the receiver: weak echoes drown, or are told wrong."""

    level: float = 0.7
    """Irradiance as a share of full sun, 0 to 1: 1 is 100 klx on what is looked at."""
    deafness: float = 1.0
    """By how much full sun raises the power needed, as a share; chosen: some 30 % less range, of
    the size that makers grant their outdoor scanners (UTM-30LX at 100 klx) (M)."""
    false_echoes: float = 0.02
    """Share of beams without an echo that tell a random range in full sun; chosen."""
    jitter: float = 1.0
    """Growth of sigma in full sun for an echo at the threshold, as a factor minus 1; chosen."""

    def __post_init__(self) -> None:
        _share(self, "level")
        _share(self, "false_echoes")
        _not_negative(self)


@dataclass(frozen=True, slots=True)
class Bias:
    """A unit's constant error, drawn once per seed."""

    bound: float = 0.030
    """Largest size [m]: the data sheet's systematic error, here the LMS111's."""

    def __post_init__(self) -> None:
        _not_negative(self)


@dataclass(frozen=True, slots=True)
class Quantisation:
    """Ranges come in whole steps."""

    step: float = 0.001
    """[m]; of the scanner's protocol."""

    def __post_init__(self) -> None:
        _positive(self, "step")


@dataclass(frozen=True, slots=True)
class Effects:
    """Which effects a scanner has; ``None`` switches one off, and all are off by default."""

    mixing: Mixing | None = None
    spreading: Spreading | None = None
    sensitivity: Sensitivity | None = None
    panes: Panes | None = None
    sunlight: Sunlight | None = None
    bias: Bias | None = None
    quantisation: Quantisation | None = None

    @property
    def optical(self) -> bool:
        """Whether any effect needs to know what a beam has hit."""
        return any((self.mixing, self.spreading, self.sensitivity, self.panes, self.sunlight))


NO_EFFECTS: Final = Effects()


def sub_beam_places(uniforms: FloatArray) -> FloatArray:
    """Return where each beam's sub-rays cross a unit disc (SUB_BEAMS, 2, B): even over its area.

    The first goes through the centre and stands for the inner third of the area; the other two fall
    anywhere in the ring around that, opposite each other, so that a slanted plane's mean is its centre.

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
        beam: Its spot.
        places: (SUB_BEAMS, 2, B) of ``sub_beam_places``: the centre, and two opposite each other.
        origins: (B, 3) of the beams [m].
        axes: (B, 3, 3): in its columns the direction of each beam, and two across it.
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


def mixed(
    beam: Beam, mixing: Mixing, echoes: Echoes, blend_draws: FloatArray, pick_draws: FloatArray
) -> Echoes:
    """Return what the receiver makes of each beam's sub-rays.

    Sub-rays that belong to one surface give its mean. Where they fall into a near and a far group, or
    a group and nothing, the beam sits on an edge. Echoes less than a pulse length apart blend, in
    ``mixing.blend`` of the cases, to the mean by power; else the beam tells one group's
    range, each as likely as its share of the power; with nothing behind, always the near one.

    Args:
        beam: Its spot and pulse.
        mixing: How often ranges blend.
        echoes: (K, N) of the sub-rays.
        blend_draws: (N,) random numbers in [0, 1).
        pick_draws: (N,) random numbers in [0, 1).
    """
    seen = np.isfinite(echoes.distances)
    finite = np.where(seen, echoes.distances, 0.0)
    powers = received_power(echoes.remissions, finite) * seen
    # Sub-rays of no power (an absorber) still tell a distance; it will be lost for want of power.
    powers += _LEAST * seen
    lights = seen.astype(float)

    # Only where sub-rays are farther apart than a slanted plane explains is there an edge.
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
        # Every sub-ray carries its share of the beam's light, whether it comes back or not.
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
    """Return how much each sub-ray (K, N) counts in what the receiver makes of them; see ``mixed``."""
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

    # Sub-rays tell the near surface's share of the light to half a ray's; it may be anything between,
    # and what is left of the draw that let them blend says what.
    rays = len(distances)
    lit, all_lit = near.sum(axis=0), np.isfinite(distances).sum(axis=0)
    even = np.where(blends, blend_draws / max(mixing.blend, 1e-12) - 0.5, 0.0)
    even[all_lit < rays] = 0.0
    shift_near = 1.0 + even / np.maximum(lit, 1)
    shift_far = 1.0 - even / np.maximum(rays - lit, 1)
    return np.asarray(kept * np.where(near, shift_near, shift_far))


_LEAST: Final = 1e-15
"""A power that counts for nothing, but in a division."""

_EDGE: Final = 0.05
"""Sub-rays farther apart than this, and than a slanted plane explains, lie on two surfaces [m]."""


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


def _not_negative(config: object) -> None:
    for name in (f.name for f in fields(config)):  # type: ignore[arg-type]
        value = getattr(config, name)
        if not 0.0 <= value < math.inf:
            raise SensorError(f"{name} must be >= 0 and finite, got {value}")


def _positive(config: object, *names: str) -> None:
    for name in names:
        value = getattr(config, name)
        if not 0.0 < value < math.inf:
            raise SensorError(f"{name} must be > 0 and finite, got {value}")


def _share(config: object, name: str) -> None:
    value = getattr(config, name)
    if not 0.0 <= value <= 1.0:
        raise SensorError(f"{name} must be a share between 0 and 1, got {value}")
