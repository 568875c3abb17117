"""What all parts of a scenario's schema share: strictness, and fields with units."""

from __future__ import annotations

from typing import Annotated, Final, TypeAlias

from pydantic import ConfigDict, Field

STRICT: Final = ConfigDict(
    extra="forbid", use_attribute_docstrings=True, allow_inf_nan=False, strict=False
)
"""Unknown fields and numbers that are not finite are refused; docstrings describe the fields."""

Seconds: TypeAlias = Annotated[float, Field(ge=0.0, le=86_400.0)]
"""A time from the start of the run, or a duration [s]."""

Metres: TypeAlias = Annotated[float, Field(ge=0.0, le=1e6)]
"""A distance [m]."""

Degrees: TypeAlias = Annotated[float, Field(ge=-360.0, le=360.0)]
"""An angle [degrees], as in the world's own files."""

Share: TypeAlias = Annotated[float, Field(ge=0.0, le=1.0)]
"""A part of a whole, 0 to 1."""

Point: TypeAlias = tuple[float, float] | tuple[float, float, float]
"""[x, y] or [x, y, heading] in ``map`` [m, degrees]."""

Place: TypeAlias = str | tuple[float, float] | tuple[float, float, float]
"""The name of a place of the world, or [x, y] or [x, y, heading] in ``map`` [m, degrees]."""
