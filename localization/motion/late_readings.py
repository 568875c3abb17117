"""Settings for readings that arrive late."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from localization.errors import LocalizationError
from localization.geometry import so3_log
from localization.types import SECOND, Pose


@dataclass(frozen=True, slots=True)
class LateReadingsConfig:
    """How readings that arrive late are replayed."""

    horizon: int = 2 * SECOND
    """A reading later than this is rejected [ns]; with 0, every reading that is out of order is."""
    stamp_error: int = SECOND // 4
    """Largest difference of the stamps of two readings of one source, against their order of arrival, that is
    taken for an error of the stamps [ns]; see ``ArrivalOrder``. For robots whose motion comes as poses; with 0,
    the stamps decide."""
    reuse_distance: float = 0.005
    """A sweep that was registered already keeps its match unless the prediction moved farther [m]. The match
    does not contain the prediction, and is accurate to some 3 mm. With 0 every sweep is registered again,
    and the result is that of readings in order, bit for bit."""
    reuse_angle: float = np.deg2rad(0.2)
    """A sweep that was registered already keeps its match unless the prediction turned farther [rad]."""

    def __post_init__(self) -> None:
        if min(self.horizon, self.stamp_error, self.reuse_distance, self.reuse_angle) < 0:
            raise LocalizationError("settings of late readings must be >= 0")

    @property
    def exact(self) -> bool:
        """Whether a replay computes everything again."""
        return self.reuse_distance == 0.0

    def same(self, a: Pose, b: Pose) -> bool:
        """Return whether two predictions are so near to each other that one registration serves for both."""
        if np.array_equal(a.position, b.position) and np.array_equal(a.rotation, b.rotation):
            return True
        if float(np.abs(a.position - b.position).max()) > self.reuse_distance:
            return False
        return float(np.abs(so3_log(a.rotation.T @ b.rotation)).max()) <= self.reuse_angle
