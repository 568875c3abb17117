"""Text summary of a calibration for the terminal and the mount file."""

from __future__ import annotations

import numpy as np

from localization.calibration.extrinsic_calibration import Calibration
from localization.geometry import FloatArray
from localization.mount_estimation.calibration_config import AXES


def summary(found: Calibration) -> tuple[str, ...]:
    """Return lines with the corrections, the unobservable axes and the mounts that are off."""
    lines = [
        f"mounts from {found.samples} sweeps; corrections with one sigma, about base_link's axes",
        f"  {'':20s}"
        + "".join(f"{a + ' cm':>14s}" for a in AXES[:3])
        + "".join(f"{a + ' deg':>14s}" for a in AXES[3:]),
    ]
    for m in found.mounts:
        lines.append(f"  {m.scanner:20s}" + _cells(m.correction, m.sigma))
    for m in found.mounts[1:]:
        apart, sigma = found.relative_to_first(m)
        lines.append(f"  {'  relative to first':20s}" + _cells(apart, sigma))
    for m in found.mounts:
        unobservable = [axis for axis, known in zip(AXES, m.observable, strict=True) if not known]
        if unobservable:
            lines.append(f"{m.scanner}: {', '.join(unobservable)} not observable from this drive")
    far = [m for m in found.mounts if m.off]
    for m in far:
        lines.append(f"{m.scanner} differs from its given mount: {m.words}")
    if not far:
        lines.append("all scanners agree with their given mounts on the observable axes")
    return tuple(lines)


def _cells(values: FloatArray, sigmas: FloatArray) -> str:
    scale = np.repeat([100.0, 180.0 / np.pi], 3)
    pairs = zip(values * scale, sigmas * scale, strict=True)
    return "".join(f"{f'{v:+.2f} ± {s:.2f}':>14s}" for v, s in pairs)
