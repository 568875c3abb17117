"""Mixed pixels: sub-rays over the spot, and ranges at edges."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st

from benchmarks.pictures.optical_bench import (
    box_xml,
    wall_xml,
)
from robot_sim.sensors.echoes import (
    Echoes,
)
from robot_sim.sensors.lidar_effects import (
    Beam,
    Effects,
    Mixing,
)
from robot_sim.sensors.mixed_pixels import SUB_BEAMS, mixed, sub_beam_places
from tests.robot_sim.sensors.support import AHEAD, EffectsBench


def test_sub_beams_cover_the_spot_evenly() -> None:
    places = sub_beam_places(np.random.default_rng(0).random((2, 20_000)))
    assert places.shape == (SUB_BEAMS, 2, 20_000)
    assert np.linalg.norm(places, axis=1).max() <= 1.0
    np.testing.assert_allclose(places.sum(axis=0), 0.0, atol=1e-12)
    # A disc of even light has a mean square of a quarter along each axis. The centre stands for the
    # inner third of the area, whose mean square is a third of a quarter.
    squares = (places**2).mean(axis=(0, 2))
    np.testing.assert_allclose(squares, 0.25 - 0.25 / SUB_BEAMS**2, atol=0.004)


def test_wide_beam_on_a_plain_wall_measures_the_same_as_a_thin_one() -> None:
    bench = EffectsBench(wall_xml(5.0))
    (thin,), (wide,) = bench.sweeps(1), bench.sweeps(1, effects=Effects(mixing=Mixing()))
    steep = np.abs(thin.angles) < math.radians(45.0)
    np.testing.assert_allclose(wide.ranges[steep], thin.ranges[steep], atol=1e-3)
    assert wide.intensities[AHEAD] == pytest.approx(0.8, abs=1e-3)
    assert len(thin.intensities) == 0


@pytest.mark.parametrize("offset", [-0.5, 0.1, 0.6])
def test_share_of_the_light_on_the_near_surface_is_that_of_the_disc(offset: float) -> None:
    """A beam whose middle misses a post's edge by ``offset`` radii is lit by a segment of the disc."""
    beam = Beam(divergence=0.0, aperture=0.1, pulse_length=10.0)
    edge = 0.05 * offset
    bench = EffectsBench(box_xml(2.1, 1.0 + edge, (0.1, 1.0, 1.0), "wall") + wall_xml(3.0))
    effects = Effects(mixing=Mixing(blend=1.0))
    scans = bench.sweeps(90, effects=effects, beam=beam, field_of_view=1e-5, resolution=5e-8)
    ranges = np.array([scan.ranges for scan in scans]).ravel()
    # Ranges blend by power: of a share s on the near one, s / 4 and (1 - s) / 9 of it come back.
    weight = (3.0 - ranges) / (3.0 - 2.0)
    share = weight / 9.0 / (weight / 9.0 + (1.0 - weight) / 4.0)
    lit = (math.acos(offset) - offset * math.sqrt(1.0 - offset**2)) / math.pi
    # The centre's ray stands for a third of the light: it is all on or all off.
    lit_by_rays = (float(offset < 0.0) + 2.0 * _ring_share(offset)) / 3.0
    assert share.mean() == pytest.approx(lit_by_rays, abs=0.02)
    assert share.mean() == pytest.approx(lit, abs=0.14)
    # Shares are not just thirds: sub-rays leave open what lies between.
    thirds = share[(share > 0.01) & (share < 0.99)] * SUB_BEAMS
    assert np.mean(np.abs(thirds - np.rint(thirds)) > 0.25) == pytest.approx(0.5, abs=0.05)


def _ring_share(offset: float) -> float:
    """Return which share of the outer two thirds of a unit disc has y > ``offset``."""
    y, x = np.mgrid[-1:1:801j, -1:1:801j]
    square = x**2 + y**2
    ring = (square <= 1.0) & (square >= 1.0 / 3.0)
    return float((ring & (y > offset)).sum() / ring.sum())


def edge_ranges(gap: float, mixing: Mixing, count: int = 400) -> np.ndarray:
    """Return ranges of the beams that sit on the edge of a post, ``gap`` before a wall at 5 m."""
    bench = EffectsBench(box_xml(5.0 - gap + 0.01, 0.0, (0.01, 0.25, 2.0), "wall") + wall_xml(5.0))
    scans = bench.sweeps(count, effects=Effects(mixing=mixing), field_of_view=math.radians(20.0))
    # At 4.6 m a spot is 77 mm wide and beams are 40 mm apart: the edge cuts these.
    edge = np.abs(np.abs(scans[0].angles) - math.atan2(0.25, 5.0 - gap)) < 0.006
    return np.array([scan.ranges[edge] * np.cos(scan.angles[edge]) for scan in scans]).ravel()


@pytest.mark.slow
def test_edges_nearer_than_the_pulse_blend_as_often_as_configured() -> None:
    between = {}
    for blend in (0.0, 0.4, 0.8):
        x = edge_ranges(0.4, Mixing(blend=blend))
        between[blend] = float(np.mean((x > 4.65) & (x < 4.95)))
    assert between[0.0] == 0.0
    assert between[0.4] == pytest.approx(0.5 * between[0.8], rel=0.1)
    assert between[0.8] > 0.5


def test_edges_farther_than_the_pulse_give_one_of_the_two_surfaces() -> None:
    x = edge_ranges(1.0, Mixing(blend=1.0))
    near, far = np.abs(x - 4.0) < 0.05, np.abs(x - 5.0) < 0.05
    assert (near | far).all()
    assert 0.2 < near.mean() < 0.9


@given(
    st.integers(1, SUB_BEAMS - 1),
    st.floats(0.5, 20.0),
    st.floats(0.06, 5.0),
    st.floats(0.0, 0.999),
    st.floats(0.0, 0.999),
)
def test_mixed_range_lies_between_its_surfaces(
    near: int, distance: float, gap: float, blend: float, pick: float
) -> None:
    distances = np.where(np.arange(SUB_BEAMS) < near, distance, distance + gap)[:, None]
    echoes = Echoes(distances, np.full_like(distances, 0.5), np.ones_like(distances))
    result = mixed(Beam(), Mixing(), echoes, np.array([blend]), np.array([pick]))
    told = float(result.distances[0])
    assert distance - 1e-9 <= told <= distance + gap + 1e-9
    assert 0.0 < float(result.remissions[0]) <= 0.5 + 1e-12
    if gap > Beam().pulse_length:
        assert told == pytest.approx(distance) or told == pytest.approx(distance + gap)


def test_beam_partly_on_a_post_before_nothing_measures_the_post_with_less_light() -> None:
    distances = np.array([[3.0, np.inf, np.inf]]).T
    echoes = Echoes(distances, np.where(np.isfinite(distances), 0.5, 0.0), np.ones((3, 1)))
    result = mixed(Beam(), Mixing(), echoes, np.array([0.5]), np.array([0.99]))
    np.testing.assert_allclose(result.distances, [3.0])
    np.testing.assert_allclose(result.remissions, [0.5 / 3])


def test_beam_without_a_hit_has_no_echo() -> None:
    echoes = Echoes(np.full((3, 2), np.inf), np.zeros((3, 2)), np.ones((3, 2)))
    result = mixed(Beam(), Mixing(), echoes, np.zeros(2), np.zeros(2))
    assert np.isposinf(result.distances).all()
    np.testing.assert_array_equal(result.remissions, 0.0)
