"""Surfaces by name and patches on a floor."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st

from robot_sim.errors import UnknownSurfaceError
from robot_sim.scene_objects.floor_surfaces import (
    SURFACES,
    Patch,
    Surface,
    patches_under,
    surface_named,
)

TILE = SURFACES["tile"]
coordinates = st.floats(-20.0, 20.0)


def test_every_surface_has_a_source_and_grips_like_rubber() -> None:
    for name, surface in SURFACES.items():
        assert surface.name == name
        assert len(surface.source) > 10
        assert 0.05 <= surface.mu_long <= surface.mu_lat <= 1.0
        assert 0.0 < surface.rolling_resistance < 0.2
    assert {"tile", "carpet", "wet_tile", "concrete", "asphalt", "grass", "gravel"} <= set(SURFACES)


def test_wet_surfaces_have_less_friction() -> None:
    for dry in ("tile", "concrete", "grass"):
        assert SURFACES[f"wet_{dry}"].mu_long < SURFACES[dry].mu_long


def test_unknown_surface_lists_the_available_ones() -> None:
    assert surface_named("tile") is TILE
    with pytest.raises(UnknownSurfaceError, match=r"no surface named 'lava'; available: asphalt, "):
        surface_named("lava")


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan, math.inf])
def test_invalid_friction_is_rejected_by_name(bad: float) -> None:
    with pytest.raises(ValueError, match="'x': mu_long must be > 0"):
        Surface("x", bad, 0.5, 0.0, "none")
    with pytest.raises(ValueError, match="'x': mu_lat must be > 0"):
        Surface("x", 0.5, bad, 0.0, "none")
    if bad != 0.0:
        with pytest.raises(ValueError, match="'x': rolling_resistance must be >= 0"):
            Surface("x", 0.5, 0.5, bad, "none")


def test_patch_needs_a_size_and_a_place() -> None:
    with pytest.raises(ValueError, match="patch of tile: half-lengths must be > 0"):
        Patch(TILE, 0.0, 0.0, half=(1.0, 0.0))
    with pytest.raises(ValueError, match="patch of tile: place and size must be finite"):
        Patch(TILE, math.nan, 0.0, half=(1.0, 1.0))


@given(
    x=coordinates, y=coordinates, yaw=st.floats(-4.0, 4.0),
    hx=st.floats(0.1, 5.0), hy=st.floats(0.1, 5.0), u=st.floats(-2.0, 2.0), v=st.floats(-2.0, 2.0),
)  # fmt: skip
def test_patch_covers_the_points_in_its_rotated_rectangle(
    x: float, y: float, yaw: float, hx: float, hy: float, u: float, v: float
) -> None:
    patch = Patch(TILE, x, y, half=(hx, hy), yaw=yaw)
    along, across = u * hx, v * hy
    c, s = math.cos(yaw), math.sin(yaw)
    point = x + c * along - s * across, y + s * along + c * across
    if min(abs(abs(u) - 1.0), abs(abs(v) - 1.0)) > 1e-6:
        assert patch.covers(*point) == (abs(u) < 1.0 and abs(v) < 1.0)


def test_later_patches_lie_on_earlier_ones() -> None:
    below = Patch(TILE, 0.0, 0.0, half=(2.0, 2.0))
    above = Patch(SURFACES["ice"], 1.0, 0.0, half=(0.5, 0.5))
    points = np.array([[0.0, 0.0], [1.0, 0.2], [5.0, 5.0]])
    assert patches_under((below, above), points) == (below, above, None)
    assert patches_under((), points) == (None, None, None)
