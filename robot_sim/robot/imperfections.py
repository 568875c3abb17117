"""Imperfections of a particular robot against its data sheet, which drivetrain and encoders assume."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True)
class Imperfections:
    """Deviations of the physical robot from its nominal parameters; none by default.

    All of them are built into the body: tyre radii, friction of joints, positions of masses. None is
    known to the firmware, to the encoders or to a localiser.

    Raises:
        ValueError: a number is not finite or outside what its docstring allows.
    """

    left_radius: float = 1.0
    """True over nominal rolling radius of the left tyres, in 0.5 to 1.5. Identified on a P3-AT:
    0.9464 (figures in public ROS packages, attributed to Mandow, Martinez et al., IROS 2007)."""
    right_radius: float = 1.0
    """True over nominal rolling radius of the right tyres, in 0.5 to 1.5; 0.9253 on that P3-AT."""
    stiction: float = 0.0
    """Dry friction in each wheel's bearings and gear [N m], >= 0. No measurement of a P3-AT was
    available; 0.5 to 2 are plausible sizes."""
    integral_control: bool = True
    """Whether the wheels' controllers have an integral term. Without it, turning in place has a
    dead band: commands whose gain times rate is below friction move nothing."""
    com_offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Offset of the whole robot's centre of mass from the nominal one, in ``base_link`` [m], each
    within 0.1 m: shifted batteries, cargo, an arm."""

    def __post_init__(self) -> None:
        for name in ("left_radius", "right_radius"):
            value = getattr(self, name)
            if not 0.5 <= value <= 1.5:
                raise ValueError(f"{name} must be within 0.5 and 1.5 of nominal, got {value}")
        if not (math.isfinite(self.stiction) and self.stiction >= 0.0):
            raise ValueError(f"stiction must be >= 0 N m, got {self.stiction}")
        if len(self.com_offset) != 3 or not all(abs(v) <= 0.1 for v in self.com_offset):
            raise ValueError(
                f"com_offset must be three lengths within 0.1 m, got {self.com_offset}"
            )

    def radius_scale(self, side: str) -> float:
        """Return true over nominal rolling radius of the tyres of a side, ``left`` or ``right``."""
        return self.left_radius if side == "left" else self.right_radius


AS_DRAWN: Final = Imperfections()
"""A robot without imperfections."""
MANDOW_2007: Final = Imperfections(left_radius=0.9464, right_radius=0.9253)
"""Rolling radii identified on a real P3-AT, tyres loaded and unevenly inflated."""
