"""Point cloud of a mapped place with oriented normals."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from localization.errors import LocalizationError
from localization.geometry import FloatArray


class CloudError(LocalizationError):
    """A cloud that cannot serve as a map; the message names the reason and what would work."""


@dataclass(frozen=True, slots=True, eq=False)
class Cloud:
    """Points of a mapped place with unit normals that point to where the surface was seen from."""

    points: FloatArray
    """Coordinates (N, 3) in ``frame`` [m]."""
    normals: npt.NDArray[np.floating]
    """Unit normals (N, 3), kept as float32, whose rounding is far below the noise of any normal."""
    name: str
    """The place's name."""
    frame: str = "map"
    """The coordinate frame of points and normals."""
    sha256: str = ""
    """Hex digest of the file's bytes; empty for a cloud that was never saved."""
    position_noise: float = 0.0
    """Error of the map's surfaces relative to those beside them, one sigma along each axis [m]; 0 if the map does
    not say. Maps made without truth do: a pose in such a map is as uncertain as the map itself."""
    heading_noise: float = 0.0
    """The same of the direction of the surfaces, one sigma [rad]; 0 if the map does not say."""

    _bounds: tuple[FloatArray, FloatArray] | None = field(default=None, init=False, repr=False)

    def __post_init__(self) -> None:
        for name, kind in (("points", np.float64), ("normals", np.float32)):
            array = np.array(getattr(self, name), dtype=kind)
            if array.ndim != 2 or array.shape[1] != 3:
                raise CloudError(f"cloud {name} must have shape (N, 3), got {array.shape}")
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        for name in ("position_noise", "heading_noise"):
            if not (np.isfinite(value := getattr(self, name)) and value >= 0.0):
                raise CloudError(f"cloud {name} must be finite and >= 0, got {value}")
        if len(self.points) != len(self.normals):
            raise CloudError(f"cloud has {len(self.points)} points but {len(self.normals)} normals")

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Smallest and largest coordinates, (3,) each [m]."""
        if self._bounds is None:  # takes milliseconds
            found = self.points.min(axis=0), self.points.max(axis=0)
            for corner in found:
                corner.flags.writeable = False
            object.__setattr__(self, "_bounds", found)
            return found
        return self._bounds
