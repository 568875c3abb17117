"""Tables of what worlds and robots are made of, from the catalogues in the code: scanners, inertial units, materials, furniture."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from robot_sim.scene_objects.furniture import FURNITURE
from robot_sim.scene_objects.materials import MATERIALS
from robot_sim.sensors.imu_models import INERTIAL_UNITS, STANDARD_GRAVITY
from robot_sim.sensors.lidar_models import LIDARS

_DEGREE = math.radians(1.0)
TIMES = " \N{MULTIPLICATION SIGN} "
"""Between the sizes of a piece of furniture."""


def scanners() -> str:
    """Return the table of scanner models."""
    heads = (
        "model",
        "field of view",
        "resolution and rate",
        "range [m]",
        "at 10 % [m]",
        "sigma [mm]",
    )
    rows = []
    for m in LIDARS.values():
        modes = "; ".join(
            f"{mode.resolution_deg:g}° at {mode.rate_hz:g} Hz"
            + (f", {mode.interlace} turns" if mode.interlace > 1 else "")
            for mode in m.modes
        )
        bands = "".join(f", {1e3 * s:g} from {r:g} m" for r, s in m.sigma_bands)
        rows.append((
            f"`{m.name}`", f"{m.field_of_view_deg:g}°", modes,
            f"{m.range_min:g} to {m.range_max:g}", f"{m.range_at_10_percent:g}", f"{1e3 * m.sigma:g}{bands}",
            f"±{1e3 * m.systematic:g}", f"{1e3 * m.beam.divergence:g} mrad + {1e3 * m.beam.aperture:g} mm",
            f"{1e3 * m.quantum:g}",
        ))  # fmt: skip
    return _table((*heads, "systematic [mm]", "spot", "step [mm]"), rows)


def inertial_units() -> str:
    """Return the table of inertial units."""
    parts = "noise", "instability", "switch-on", "range", "step"
    heads = ("model", *(f"gyro {p}" for p in parts), *(f"accelerometer {p}" for p in parts))
    rows = []
    for m in INERTIAL_UNITS.values():
        g, f = m.gyro, m.force
        rows.append((
            f"`{m.name}`", f"{g.noise / _DEGREE:.3g} °/√s", f"{3600.0 * g.instability / _DEGREE:.3g} °/h",
            f"{g.bias_sigma / _DEGREE:.3g} °/s", f"±{g.full_scale / _DEGREE:.4g} °/s",
            f"{g.quantum / _DEGREE:.3g} °/s" if g.quantum else "none",
            f"{1e6 * f.noise / STANDARD_GRAVITY:.3g} µg√s", f"{1e6 * f.instability / STANDARD_GRAVITY:.3g} µg",
            f"{f.bias_sigma:.3g} m/s²", f"±{f.full_scale / STANDARD_GRAVITY:.3g} g",
            f"{1e3 * f.quantum:.2g} mm/s²" if f.quantum else "none",
        ))  # fmt: skip
    return _table(heads, rows)


def materials() -> str:
    """Return the table of materials."""
    rows = ((f"`{m.name}`", f"{100.0 * m.reflectivity:g}") for m in MATERIALS.values())
    return _table(("material", "remission [%]"), rows)


def furniture() -> str:
    """Return the table of furniture with its default sizes."""
    rows = (
        (f"`{name}`", TIMES.join(f"{x:g}" for x in kind.size)) for name, kind in FURNITURE.items()
    )
    return _table(("type", TIMES.join(("width", "depth", "height [m]"))), rows)


def _table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [f"| {' | '.join(heads)} |", "|" + "---|" * len(heads)]
    return "\n".join((*lines, *(f"| {' | '.join(row)} |" for row in rows)))
