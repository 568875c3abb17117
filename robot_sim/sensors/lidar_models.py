"""Planar lidars by name, with the figures of their data sheets.

Every model lists the source of every figure. A figure marked (M) was quoted from memory of the sheet
and has not been checked against it; the others were checked, in transcripts of the sheets.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from robot_sim.errors import SensorError
from robot_sim.sensors.lidar_effects import (
    Beam,
    Bias,
    Effects,
    Mixing,
    Panes,
    Quantisation,
    Sensitivity,
    Spreading,
    Sunlight,
)

SigmaBands = tuple[tuple[float, float], ...]
"""Pairs of a range [m] and the standard deviation from there on [m], in order of range."""


@dataclass(frozen=True, slots=True)
class Mode:
    """One setting of a scanner: resolution and rate of its pictures."""

    resolution_deg: float
    """Angle between beams of a picture [deg]."""
    turn_hz: float
    """Rotation rate of the mirror [Hz]."""
    interlace: int = 1
    """Number of turns over which the beams of one picture are spread: each turn fills the others'
    gaps."""
    field_of_view_deg: float | None = None
    """Field of view in this mode [deg], where it is narrower than the scanner's own."""

    @property
    def rate_hz(self) -> float:
        """Pictures per second [Hz]."""
        return self.turn_hz / self.interlace


@dataclass(frozen=True, slots=True)
class LidarModel:
    """A commercial scanner."""

    name: str
    """Key of the model."""
    title: str
    """Maker and product."""
    field_of_view_deg: float
    """Field of view [deg]."""
    modes: tuple[Mode, ...]
    """Settings; the first is the default."""
    range_min: float
    """Least range [m]."""
    range_max: float
    """Greatest range [m]."""
    range_at_10_percent: float
    """Greatest range to a surface of 10 % remission [m]."""
    sigma: float
    """Statistical error, one standard deviation [m]."""
    systematic: float
    """Bound of the systematic error [m]."""
    beam: Beam
    """Divergence and aperture of the beam."""
    quantum: float
    """Resolution of ranges in its protocol [m]."""
    sources: Mapping[str, str]
    """Source of each figure, by its name."""
    sigma_bands: SigmaBands = ()
    """Ranges from which on sigma has another value."""

    def mode(self, resolution_deg: float | None = None, rate_hz: float | None = None) -> Mode:
        """Return the setting with this resolution [deg] that yields this rate [Hz].

        A scanner can be set to send only every n-th picture, so that any integer fraction of a rate is valid.

        Raises:
            SensorError: There is no such setting; the message lists the available ones.
        """
        modes = [
            m for m in self.modes if resolution_deg is None or m.resolution_deg == resolution_deg
        ]
        if not modes:
            known = ", ".join(f"{m.resolution_deg:g}" for m in self._distinct())
            raise SensorError(
                f"resolution_deg: {self.name} has no {resolution_deg:g} deg; it has {known}"
            )
        if rate_hz is None:
            return modes[0]
        for mode in modes:
            if _whole(mode.rate_hz / rate_hz if rate_hz > 0.0 else 0.0):
                return mode
        rates = ", ".join(f"{m.rate_hz:g} ({m.resolution_deg:g} deg)" for m in modes)
        raise SensorError(
            f"rate_hz: {self.name} has no {rate_hz:g} Hz; it has {rates} and integer fractions of those"
        )

    def _distinct(self) -> list[Mode]:
        return list({m.resolution_deg: m for m in self.modes}.values())

    def effects(self, *, sun: float = 0.0) -> Effects:
        """Return all effects with this model's figures.

        Args:
            sun: Irradiance as a share of full sun; 0 disables the effect of daylight, as indoors.
        """
        return Effects(
            mixing=Mixing(),
            spreading=Spreading(),
            sensitivity=Sensitivity(self.range_at_10_percent),
            panes=Panes(lobe=max(math.radians(1.0), 0.5 * self.beam.divergence)),
            sunlight=Sunlight(level=sun) if sun > 0.0 else None,
            bias=Bias(self.systematic),
            quantisation=Quantisation(self.quantum),
        )


def _whole(ratio: float) -> bool:
    return round(ratio) >= 1 and abs(ratio - round(ratio)) < 1e-6 * ratio


LMS1XX_BEAM: Final = Beam(divergence=0.015, aperture=0.008)
"""SICK, LMS1xx operating instructions 8012471: spot = distance x 15 mrad + 8 mm."""

_LMS200_SHEET: Final = "SICK, LMS200/211/221/291 technical description (M)"
_LMS200_SOURCES: Final = {
    "field_of_view_deg": _LMS200_SHEET,
    "modes": f"{_LMS200_SHEET}: mirror at 75 Hz; 0.5 deg in two turns, 0.25 deg in four over 100 deg",
    "range_min": "Gazebo's SickLMS200 model: 0.20 m",
    "range_max": "13 bits of mm or cm; Gazebo's SickLMS200 model: 8.192 m",
    "range_at_10_percent": f"{_LMS200_SHEET}: 10 m",
    "sigma": f"{_LMS200_SHEET}: 5 mm (mm mode, to 8 m), 10 mm (cm mode, of its step)",
    "systematic": f"{_LMS200_SHEET}: 15 mm (mm mode), 40 mm (cm mode)",
    "beam": "4.4 mrad (M); spot at the window 10 mm, chosen",
    "quantum": "1 mm or 10 mm: the unit of its telegrams",
}
_LMS200_MODES: Final = (
    Mode(0.5, 75.0, interlace=2),
    Mode(1.0, 75.0),
    Mode(0.25, 75.0, interlace=4, field_of_view_deg=100.0),
)
_LMS200_BEAM: Final = Beam(divergence=0.0044, aperture=0.010)

_CATALOGUE: Final = (
    LidarModel(
        name="sick_lms200",
        title="SICK LMS-200, millimetre mode",
        field_of_view_deg=180.0,
        modes=_LMS200_MODES,
        range_min=0.2,
        range_max=8.191,
        range_at_10_percent=10.0,
        sigma=0.005,
        systematic=0.015,
        beam=_LMS200_BEAM,
        quantum=0.001,
        sources=_LMS200_SOURCES,
    ),
    LidarModel(
        name="sick_lms200_cm",
        title="SICK LMS-200, centimetre mode",
        field_of_view_deg=180.0,
        modes=_LMS200_MODES,
        range_min=0.2,
        range_max=81.91,
        range_at_10_percent=10.0,
        sigma=0.010,
        systematic=0.040,
        beam=_LMS200_BEAM,
        quantum=0.010,
        sources=_LMS200_SOURCES,
    ),
    LidarModel(
        name="sick_lms111",
        title="SICK LMS111",
        field_of_view_deg=270.0,
        modes=(Mode(0.5, 25.0), Mode(0.5, 50.0), Mode(0.25, 25.0)),
        range_min=0.5,
        range_max=20.0,
        range_at_10_percent=18.0,
        sigma=0.012,
        systematic=0.030,
        beam=LMS1XX_BEAM,
        quantum=0.001,
        sources={
            "field_of_view_deg": "SICK data sheet LMS111-10100: 270 deg",
            "modes": "SICK data sheet LMS111-10100: 25 and 50 Hz, 0.25 and 0.5 deg",
            "range_min": "SICK data sheet LMS111-10100: working range from 0.5 m",
            "range_max": "SICK data sheet LMS111-10100: working range to 20 m",
            "range_at_10_percent": "SICK data sheet LMS111-10100: 18 m at 10 % remission",
            "sigma": "SICK data sheet LMS111-10100: statistical error 12 mm",
            "systematic": "SICK data sheet LMS111-10100: systematic error +-30 mm",
            "beam": "SICK, LMS1xx operating instructions 8012471: spot = distance x 15 mrad + 8 mm",
            "quantum": "SICK telegrams of the LMS1xx: 1 mm",
        },
    ),
    LidarModel(
        name="hokuyo_utm30lx",
        title="Hokuyo UTM-30LX",
        field_of_view_deg=270.0,
        modes=(Mode(0.25, 40.0),),
        range_min=0.1,
        range_max=30.0,
        range_at_10_percent=10.0,
        sigma=0.010,
        systematic=0.030,
        beam=Beam(divergence=0.013, aperture=0.010),
        quantum=0.001,
        sigma_bands=((10.0, 0.030),),
        sources={
            "field_of_view_deg": "Hokuyo specification: 270 deg, 1440 steps a turn (SCIP 2.0: 0 to 1080)",
            "modes": "Hokuyo specification: 25 ms a scan, 0.25 deg",
            "range_min": "Hokuyo specification: 0.1 m",
            "range_max": "Hokuyo specification: 30 m guaranteed, on white Kent sheet",
            "range_at_10_percent": "worked out: white (90 %) at 30 m sends back what 10 % does at 10 m",
            "sigma": "Hokuyo specification: sigma < 10 mm to 10 m, < 30 mm to 30 m",
            "systematic": "Hokuyo specification: +-30 mm to 10 m, +-50 mm beyond (M); the former is used",
            "beam": "400 mm spot at 30 m (M); spot at the window 10 mm, chosen",
            "quantum": "Hokuyo specification: 1 mm",
        },
    ),
)

LIDARS: Final = {model.name: model for model in _CATALOGUE}
"""Lidar models by name."""


def lidar_model(name: str) -> LidarModel:
    """Return the model of that name.

    Raises:
        SensorError: There is no such model; the message lists the available ones.
    """
    if name not in LIDARS:
        raise SensorError(f"no lidar model named {name!r}; available: {', '.join(LIDARS)}")
    return LIDARS[name]
