"""Configuration of one planar scanner on the robot, set by hand or from a model's data sheet."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy.typing as npt

from localization.types import SECOND, Scan
from robot_sim.array_types import FloatArray
from robot_sim.errors import SensorError
from robot_sim.robot.p3at import MOUNTS
from robot_sim.sensors.lidar_effects import NO_EFFECTS, Beam, Effects, RangeNoise
from robot_sim.sensors.lidar_models import LMS1XX_BEAM, SigmaBands, lidar_model

_TURN = 2.0 * math.pi


@dataclass(frozen=True, slots=True)
class ScannerConfig:
    """A scanner with a rotating mirror; the defaults are a SICK LMS1xx at 10 Hz without effects.

    Raises:
        SensorError: A parameter is invalid; the message names it and the valid values.
    """

    name: str
    """Name and frame of the scanner, a key of ``MOUNTS``."""
    field_of_view: float = math.radians(270.0)
    """Field of view, symmetric about the scanner's x axis [rad]."""
    resolution: float = math.radians(0.5)
    """Angle between beams of one picture [rad]."""
    period_ns: int = 100_000_000
    """Time from one picture to the next [ns]."""
    phase_ns: int = 0
    """Time of the first beam of the first sweep [ns]."""
    range_min: float = 0.1
    """Range below which returns are invalid, ``NaN`` [m]."""
    range_max: float = 20.0
    """Range beyond which surfaces give no return, ``+inf`` [m]."""
    sigma: float = 0.012
    """Standard deviation of a range [m]; the LMS1xx' statistical error."""
    sigma_bands: SigmaBands = ()
    """Pairs of a range and the sigma from there on [m], where it is not constant."""
    turn_ns: int | None = None
    """Duration of one turn of the mirror, of which the field of view takes its share [ns]. None:
    the period."""
    interlace: int = 1
    """Number of turns over which the beams of a picture are spread. Each turn gives a sweep of its
    own, with its own first angle: an LMS-200 sends partial scans in this way, and only so are the
    steps of angle and time equal, as ``LaserScan`` requires."""
    beam: Beam = LMS1XX_BEAM
    """Spot and pulse of the beams."""
    effects: Effects = NO_EFFECTS
    """Optical effects and errors of the measurement."""
    model: str = ""
    """Name of the model that this was built from."""

    @classmethod
    def of(
        cls,
        name: str,
        model: str,
        *,
        rate_hz: float | None = None,
        resolution_deg: float | None = None,
        phase_ns: int = 0,
        realistic: bool = False,
        sun: float = 0.0,
    ) -> ScannerConfig:
        """Build the scanner ``name`` from a model's data sheet.

        Args:
            name: Frame, a key of ``MOUNTS``.
            model: A key of ``LIDARS``.
            rate_hz: Pictures per second: a rate of the model or an integer fraction of one; its
                default rate if not given.
            resolution_deg: A resolution of the model [deg]; its default if not given.
            phase_ns: Time of the first beam [ns].
            realistic: Whether all effects are enabled, with the model's figures.
            sun: Irradiance as a share of full sun, for the effect of daylight.

        Raises:
            SensorError: The model, or this rate or resolution of it, does not exist.
        """
        sheet = lidar_model(model)
        mode = sheet.mode(resolution_deg, rate_hz)
        turn_ns = round(SECOND / mode.turn_hz)
        period = mode.interlace * turn_ns
        if rate_hz is not None:
            period *= round(mode.rate_hz / rate_hz)
        return cls(
            name,
            field_of_view=math.radians(mode.field_of_view_deg or sheet.field_of_view_deg),
            resolution=math.radians(mode.resolution_deg),
            period_ns=period,
            phase_ns=phase_ns,
            range_min=sheet.range_min,
            range_max=sheet.range_max,
            sigma=sheet.sigma,
            sigma_bands=sheet.sigma_bands,
            turn_ns=turn_ns,
            interlace=mode.interlace,
            beam=sheet.beam,
            effects=sheet.effects(sun=sun) if realistic else NO_EFFECTS,
            model=model,
        )

    def __post_init__(self) -> None:
        if self.name not in MOUNTS:
            raise SensorError(f"no mount for scanner {self.name!r}; available: {', '.join(MOUNTS)}")
        if not 0.0 < self.field_of_view <= _TURN + 1e-9:
            raise self._error("field_of_view", "> 0 and <= 360 deg", _degrees(self.field_of_view))
        if not 0.0 < self.resolution <= self.field_of_view:
            wanted = f"> 0 and <= the field of view, {_degrees(self.field_of_view)}"
            raise self._error("resolution", wanted, _degrees(self.resolution))
        steps = self.field_of_view / self.resolution
        if abs(steps - round(steps)) > 1e-6 * steps:
            fits = _degrees(self.field_of_view / round(steps))
            wanted = f"an integer fraction of the field of view, {_degrees(self.field_of_view)}, such as {fits}"
            raise self._error("resolution", wanted, _degrees(self.resolution))
        if self.period_ns <= 0 or self.phase_ns < 0:
            raise SensorError(
                f"scanner {self.name!r} needs a period > 0 and a phase >= 0 ns, got"
                f" {self.period_ns} and {self.phase_ns}"
            )
        if not 1 <= self.interlace <= round(steps):
            raise self._error("interlace", f"from 1 to {round(steps)} turns", self.interlace)
        if not 0 < self.mirror_ns * self.interlace <= self.period_ns:
            wanted = (
                f"> 0 and at most {self.period_ns // self.interlace} ns, to fit into the period"
            )
            raise self._error("turn_ns", wanted, self.turn_ns)
        if not 0.0 <= self.range_min < math.inf:
            raise self._error("range_min", ">= 0 m", self.range_min)
        if not self.range_min < self.range_max < math.inf:
            raise self._error("range_max", f"> range_min, {self.range_min:g} m", self.range_max)
        try:
            RangeNoise(self.sigma, self.sigma_bands)
        except SensorError as error:
            raise SensorError(f"scanner {self.name!r}: {error}") from None

    def _error(self, field: str, wanted: str, got: Any) -> SensorError:
        return SensorError(f"scanner {self.name!r}: {field} must be {wanted}, got {got}")

    @property
    def mirror_ns(self) -> int:
        """Duration of one turn of the mirror [ns]."""
        return self.period_ns if self.turn_ns is None else self.turn_ns

    @property
    def noise(self) -> RangeNoise:
        """Statistical error of a range."""
        return RangeNoise(self.sigma, self.sigma_bands)

    @property
    def beams(self) -> int:
        """Number of beams in a picture."""
        return round(self.field_of_view / self.resolution) + 1

    def beams_of(self, part: int) -> int:
        """Number of beams in the ``part``-th sweep of a picture."""
        return len(range(part, self.beams, self.interlace))

    def start_of(self, part: int) -> int:
        """Time of the first beam of the ``part``-th sweep after the first beam of the picture [ns]."""
        return part * self.mirror_ns + round(self.mirror_ns * part * self.resolution / _TURN)

    def scan(
        self, stamp: int, ranges: FloatArray, *, part: int = 0, intensities: npt.ArrayLike = ()
    ) -> Scan:
        """Return the scan of one sweep, as in its message.

        Args:
            stamp: Time of its first beam [ns].
            ranges: (beams_of(part),) [m].
            part: Index of the sweep in the picture.
            intensities: (beams_of(part),), or empty.
        """
        step = self.interlace * self.resolution
        return Scan.uniform(
            stamp,
            self.name,
            angle_min=-0.5 * self.field_of_view + part * self.resolution,
            angle_increment=step,
            time_increment=1e-9 * self.mirror_ns * step / _TURN,
            ranges=ranges,
            intensities=intensities,
            range_min=self.range_min,
            range_max=self.range_max,
        )


def _degrees(angle: float) -> str:
    return f"{math.degrees(angle):.6g} deg"
