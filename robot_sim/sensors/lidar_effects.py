"""Optical effects of a lidar: which ones a scanner has, and their parameters.

Sources that end in (M) were quoted from memory of the data sheet or paper named.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Final

import numpy as np

from robot_sim.array_types import FloatArray
from robot_sim.errors import SensorError


@dataclass(frozen=True, slots=True)
class Beam:
    """The laser beam as it leaves the scanner; the defaults are those of the LMS1xx."""

    divergence: float = 0.015
    """Full angle of divergence [rad]; SICK, LMS1xx operating instructions: spot = 15 mrad x
    distance + 8 mm."""
    aperture: float = 0.008
    """Diameter of the spot at the front window [m]; same source."""
    pulse_length: float = 0.6
    """Distance within which echoes merge in the receiver [m]: half of the length of a pulse of 4
    ns; chosen, because the makers do not publish it, and diodes at 905 nm have 3 to 5 ns."""

    def __post_init__(self) -> None:
        _not_negative(self)

    def spot(self, distances: FloatArray) -> FloatArray:
        """Return the beam's diameter [m] at ``distances`` (N,) [m]."""
        return self.aperture + self.divergence * distances


@dataclass(frozen=True, slots=True)
class RangeNoise:
    """Statistical error of a range."""

    sigma: float
    """Standard deviation [m]."""
    bands: tuple[tuple[float, float], ...] = ()
    """Pairs of a range [m] and the sigma from there on [m], in order of range."""

    def __post_init__(self) -> None:
        starts = [start for start, _ in self.bands]
        if not all(0.0 <= s < math.inf for s in (self.sigma, *(s for _, s in self.bands))):
            raise SensorError(f"sigma must be >= 0 and finite, got {self.sigma} and {self.bands}")
        if starts != sorted(starts):
            raise SensorError(f"sigma_bands must be in order of range, got {self.bands}")

    def at(self, distances: FloatArray) -> FloatArray | float:
        """Return sigma [m] at ``distances`` (N,) [m]; one number if it is constant."""
        if not self.bands:
            return self.sigma
        starts = np.array([start for start, _ in self.bands])
        sigmas = np.array([self.sigma, *(sigma for _, sigma in self.bands)])
        return sigmas[np.searchsorted(starts, distances, side="right")]


@dataclass(frozen=True, slots=True)
class Mixing:
    """Mixed pixels: beams have a footprint, and at an edge they see both surfaces."""

    blend: float = 0.7
    """Share of edge beams, with echoes less than a pulse length apart, whose range lies in between;
    the others give one of the two. Chosen: Ye and Borenstein 2002 report both kinds for the
    LMS-200."""

    def __post_init__(self) -> None:
        _share(self, "blend")


@dataclass(frozen=True, slots=True)
class Spreading:
    """A footprint on a slanted surface is stretched in range: a weaker and less certain echo."""

    gain: float = 0.05
    """Added standard deviation as a share of the footprint's depth. Chosen; it doubles an LMS1xx'
    12 mm at 5 m and 79 deg, where Soudarissanane et al. 2011 and Ye and Borenstein 2002 see errors
    grow (M)."""

    def __post_init__(self) -> None:
        _not_negative(self)


@dataclass(frozen=True, slots=True)
class Sensitivity:
    """Detection threshold: echoes of dark, distant and grazed surfaces are lost."""

    range_at_10_percent: float = 18.0
    """Range at which a surface of 10 % remission, met at normal incidence, is measured reliably
    [m]; from the data sheet, here the LMS111's."""
    softness: float = 0.10
    """Width of the transition from detected to lost, in natural logarithms of power; chosen
    (speckle)."""
    reliability: float = 0.95
    """Share of beams that are measured at that range; chosen for the data sheets' "reliably"."""

    def __post_init__(self) -> None:
        _positive(self, "range_at_10_percent", "softness")
        if not 0.5 <= self.reliability < 1.0:
            raise SensorError(f"reliability must be in [0.5, 1), got {self.reliability}")

    @property
    def threshold(self) -> float:
        """Power at which half of the beams are measured, relative to a white surface at 1 m."""
        odds = self.reliability / (1.0 - self.reliability)
        return float(0.1 / self.range_at_10_percent**2 * odds**-self.softness)


@dataclass(frozen=True, slots=True)
class Panes:
    """Glass transmits light and reflects a part of it; mirrors reflect it."""

    depth: int = 3
    """Number of surfaces at which a ray is followed beyond its first hit. More than two panes
    matter: of the light that crosses three, with transmittance 0.82 each, 0.30 is left both ways,
    and with the LMS111's threshold a wall of 50 % remission is still seen from 25 m, beyond its
    range. Light is followed as long as its power suffices, which is tested ray by ray."""
    lobe: float = math.radians(1.0)
    """Half-width of incidence within which a reflected beam returns to the scanner [rad]; chosen: a
    beam's divergence plus a pane's flatness. Papers on glass detection see it within one to a few
    degrees."""
    glint: float = 30.0
    """Remission of a perfect mirror at normal incidence; chosen, of the size of a retroreflector."""

    def __post_init__(self) -> None:
        if self.depth < 1:
            raise SensorError(f"depth must be at least 1, got {self.depth}")
        _positive(self, "lobe")
        _not_negative(self)


@dataclass(frozen=True, slots=True)
class Sunlight:
    """Daylight in the receiver: weak echoes are lost, or their ranges are wrong."""

    level: float = 0.7
    """Irradiance as a share of full sun, 0 to 1; 1 is 100 klx on the target."""
    threshold_rise: float = 1.0
    """Increase of the detection threshold in full sun, as a share; chosen: some 30 % less range, of
    the size that makers allow for their outdoor scanners (UTM-30LX at 100 klx) (M)."""
    false_echoes: float = 0.02
    """Share of beams without an echo that give a random range in full sun; chosen."""
    jitter: float = 1.0
    """Increase of sigma in full sun for an echo at the threshold, as a factor minus 1; chosen."""

    def __post_init__(self) -> None:
        _share(self, "level")
        _share(self, "false_echoes")
        _not_negative(self)


@dataclass(frozen=True, slots=True)
class Bias:
    """Constant range error of a unit, drawn once per seed."""

    bound: float = 0.030
    """Largest absolute error [m]: the data sheet's systematic error, here the LMS111's."""

    def __post_init__(self) -> None:
        _not_negative(self)


@dataclass(frozen=True, slots=True)
class Quantisation:
    """Ranges are reported in integer steps."""

    step: float = 0.001
    """Step of the scanner's protocol [m]."""

    def __post_init__(self) -> None:
        _positive(self, "step")


@dataclass(frozen=True, slots=True)
class Effects:
    """Effects of a scanner; ``None`` switches one off, and all are off by default."""

    mixing: Mixing | None = None
    """Mixed pixels at edges."""
    spreading: Spreading | None = None
    """Footprints stretched by slanted surfaces."""
    sensitivity: Sensitivity | None = None
    """Detection threshold."""
    panes: Panes | None = None
    """Glass and mirrors."""
    sunlight: Sunlight | None = None
    """Daylight in the receiver."""
    bias: Bias | None = None
    """Constant range error."""
    quantisation: Quantisation | None = None
    """Resolution of ranges."""

    @property
    def optical(self) -> bool:
        """Whether any effect needs the surface that a beam has hit."""
        return any((self.mixing, self.spreading, self.sensitivity, self.panes, self.sunlight))


NO_EFFECTS: Final = Effects()
"""A scanner without effects."""


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
