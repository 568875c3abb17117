"""Effects on light, one by one, in worlds made by hand, against the formulas they claim."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from localization.types import IntArray, Scan
from robot_sim.array_types import FloatArray
from robot_sim.errors import SensorError, SimulationError
from robot_sim.robot.p3at import MOUNTS
from robot_sim.scene_objects.materials import MATERIALS
from robot_sim.sensors.echoes import (
    Echoes,
    detection_chances,
    dilution,
    footprint_depth,
    received_power,
)
from robot_sim.sensors.lidar import Scanner
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
from robot_sim.sensors.lidar_models import LIDARS, lidar_model
from robot_sim.sensors.mixed_pixels import SUB_BEAMS, mixed, sub_beam_places
from robot_sim.sensors.scanner_config import ScannerConfig
from robot_sim.sensors.surface_optics import pane_reflectance
from robot_sim.validation.optical_bench import (
    OpticalBench,
    bench_scanner,
    box_xml,
    pane_xml,
    wall_xml,
)


class DriveBench(OpticalBench):
    """The bench, with the scanner's parameters spelled out where it is used."""

    def sweeps(self, count: int, *, seed: int = 0, **parameters: Any) -> list[Scan]:  # type: ignore[override]
        """Return sweeps of an exact scanner, but for ``parameters``."""
        return super().sweeps(count, bench_scanner(**parameters), seed=seed)


NARROW: dict[str, Any] = {"field_of_view": 1e-5, "resolution": 1e-7}
"""A hundred beams straight ahead."""

AHEAD = 270
"""Index of the beam along x, of 541."""


def along(*degrees: float) -> np.ndarray:
    angles = np.radians(degrees)
    return np.stack([np.cos(angles), np.sin(angles), np.zeros(len(angles))], axis=1)


# Footprint and mixed pixels


def test_sub_beams_cover_the_spot_evenly() -> None:
    places = sub_beam_places(np.random.default_rng(0).random((2, 20_000)))
    assert places.shape == (SUB_BEAMS, 2, 20_000)
    assert np.linalg.norm(places, axis=1).max() <= 1.0
    np.testing.assert_allclose(places.sum(axis=0), 0.0, atol=1e-12)
    # A disc of even light has a mean square of a quarter along each axis. The centre stands for the
    # inner third of the area, whose mean square is a third of a quarter.
    squares = (places**2).mean(axis=(0, 2))
    np.testing.assert_allclose(squares, 0.25 - 0.25 / SUB_BEAMS**2, atol=0.004)


def test_wide_beam_on_a_plain_wall_tells_what_a_thin_one_does() -> None:
    bench = DriveBench(wall_xml(5.0))
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
    bench = DriveBench(box_xml(2.1, 1.0 + edge, (0.1, 1.0, 1.0), "wall") + wall_xml(3.0))
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
    bench = DriveBench(box_xml(5.0 - gap + 0.01, 0.0, (0.01, 0.25, 2.0), "wall") + wall_xml(5.0))
    scans = bench.sweeps(count, effects=Effects(mixing=mixing), field_of_view=math.radians(20.0))
    # At 4.6 m a spot is 77 mm wide and beams are 40 mm apart: the edge cuts these.
    edge = np.abs(np.abs(scans[0].angles) - math.atan2(0.25, 5.0 - gap)) < 0.006
    return np.array([scan.ranges[edge] * np.cos(scan.angles[edge]) for scan in scans]).ravel()


def test_edges_nearer_than_the_pulse_blend_as_often_as_configured() -> None:
    between = {}
    for blend in (0.0, 0.4, 0.8):
        x = edge_ranges(0.4, Mixing(blend=blend))
        between[blend] = float(np.mean((x > 4.65) & (x < 4.95)))
    assert between[0.0] == 0.0
    assert between[0.4] == pytest.approx(0.5 * between[0.8], rel=0.1)
    assert between[0.8] > 0.5


def test_edges_farther_than_the_pulse_tell_one_of_the_two_surfaces() -> None:
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


def test_beam_partly_on_a_post_before_nothing_tells_the_post_with_that_part_of_the_light() -> None:
    distances = np.array([[3.0, np.inf, np.inf]]).T
    echoes = Echoes(distances, np.where(np.isfinite(distances), 0.5, 0.0), np.ones((3, 1)))
    result = mixed(Beam(), Mixing(), echoes, np.array([0.5]), np.array([0.99]))
    np.testing.assert_allclose(result.distances, [3.0])
    np.testing.assert_allclose(result.remissions, [0.5 / 3])


def test_beam_that_meets_nothing_tells_nothing() -> None:
    echoes = Echoes(np.full((3, 2), np.inf), np.zeros((3, 2)), np.ones((3, 2)))
    result = mixed(Beam(), Mixing(), echoes, np.zeros(2), np.zeros(2))
    assert np.isposinf(result.distances).all()
    np.testing.assert_array_equal(result.remissions, 0.0)


# Slanted surfaces


def test_sigma_grows_with_the_depth_of_the_footprint() -> None:
    bench = DriveBench(box_xml(0.0, -1.0, (40.0, 0.001, 2.0), "wall"))
    spreading = Spreading(gain=0.05)
    (exact,) = bench.sweeps(1)
    scans = bench.sweeps(600, effects=Effects(spreading=spreading), sigma=0.012)
    for incidence in (0.0, 60.0, 75.0, 84.0):
        beam = int(np.abs(np.degrees(exact.angles) + 90.0 - incidence).argmin())
        depth = (0.008 + 0.015 * exact.ranges[beam]) * math.tan(math.radians(incidence))
        expected = math.hypot(0.012, 0.05 * depth)
        errors = [scan.ranges[beam] - exact.ranges[beam] for scan in scans]
        assert np.std(errors) == pytest.approx(expected, rel=0.1)


def test_grazed_surface_drops_out_where_the_stretched_echo_is_too_weak() -> None:
    """Asphalt 15 m ahead, more and more aslant: seen, then now and then, then no more."""
    sensitivity = Sensitivity()
    effects = Effects(spreading=Spreading(), sensitivity=sensitivity)
    beam = Beam()
    shares = []
    for incidence in (0.0, 50.0, 60.0, 65.0, 80.0):
        slope = math.radians(incidence)
        bench = DriveBench(box_xml(10.0, 0.0, (0.001, 6.0, 2.0), "asphalt", yaw=slope))
        scans = bench.sweeps(16, effects=effects, **NARROW)
        share = float(np.isfinite([scan.ranges for scan in scans]).mean())
        cosine = np.array([math.cos(slope)])
        depth = footprint_depth(beam, np.array([10.0]), cosine)
        power = 0.15 * cosine / 100.0 * dilution(beam, depth)
        expected = float(detection_chances(power, sensitivity, 0.0)[0])
        assert share == pytest.approx(expected, abs=0.04)
        shares.append(share)
    assert shares[0] > 0.99
    assert sorted(shares, reverse=True) == shares
    assert shares[-1] < 0.2


# Dark surfaces


def test_range_of_a_data_sheet_holds_at_ten_percent() -> None:
    for model in LIDARS.values():
        sensitivity = Sensitivity(model.range_at_10_percent)
        power = received_power(np.array([0.1]), np.array([model.range_at_10_percent]))
        assert detection_chances(power, sensitivity, 0.0)[0] == pytest.approx(0.95, abs=1e-6)


@pytest.mark.parametrize(
    ("material", "distance"),
    [
        ("wall", 18.0),
        ("dark_fabric", 18.0),
        ("dark_fabric", 21.5),
        ("rubber", 9.0),
        ("rubber", 10.5),
    ],
)
def test_dark_surfaces_are_lost_as_the_lidar_equation_says(material: str, distance: float) -> None:
    sensitivity = Sensitivity(range_at_10_percent=18.0)
    bench = DriveBench(wall_xml(distance, material))
    scans = bench.sweeps(30, effects=Effects(sensitivity=sensitivity), range_max=30.0, **NARROW)
    share = float(np.isfinite([scan.ranges for scan in scans]).mean())
    rho = MATERIALS[material].reflectivity
    # The same as the logistic of log power, by hand: 19 to 1 for 10 % at 18 m.
    odds = 19.0 * ((rho / distance**2) / (0.1 / 18.0**2)) ** (1.0 / 0.10)
    assert share == pytest.approx(odds / (1.0 + odds), abs=0.03)


def test_black_foam_rubber_is_seen_half_as_far_as_ten_percent() -> None:
    """At 2.4 % the equal power comes from 18 m x sqrt(0.24) = 8.8 m."""
    effects = Effects(sensitivity=Sensitivity())
    near, far = (
        np.isfinite(
            [s.ranges for s in DriveBench(wall_xml(x, "rubber")).sweeps(30, effects=effects)]
        )
        for x in (8.0, 17.0)
    )
    assert near[:, AHEAD].all()
    assert not far[:, AHEAD].any()


def test_retroreflectors_are_bright_from_afar_and_aslant() -> None:
    bench = DriveBench(box_xml(15.0, 0.0, (0.001, 1.0, 1.0), "retroreflector", yaw=1.0))
    (scan,) = bench.sweeps(1, effects=Effects(sensitivity=Sensitivity()))
    assert scan.intensities[AHEAD] == pytest.approx(20.0)


# Glass and mirrors


@given(st.floats(0.0, 1.0), st.floats(1.0, 2.5))
def test_panes_mirror_a_share(cosine: float, index: float) -> None:
    share = float(pane_reflectance(np.array([cosine]), np.array([index]))[0])
    assert 0.0 <= share <= 1.0 + 1e-9


def test_panes_mirror_as_fresnel_says() -> None:
    index = np.full(3, 1.52)
    cosines = np.cos(np.radians([0.0, 56.66, 89.99]))
    normal, brewster, grazing = pane_reflectance(cosines, index)
    face = ((1.52 - 1.0) / (1.52 + 1.0)) ** 2
    assert normal == pytest.approx(2 * face / (1 + face))
    # At Brewster's angle half of the light, that polarised along, is not mirrored at all.
    across = ((1.52**2 - 1.0) / (1.52**2 + 1.0)) ** 2
    assert brewster == pytest.approx(across / 2 * 2 / (1 + across / 2), rel=1e-3)
    assert grazing > 0.99


def test_glass_is_looked_through_but_for_its_own_glint() -> None:
    bench = DriveBench(pane_xml(2.0) + wall_xml(5.0))
    echoes = bench.echoes(along(0.0, 3.0, 10.0, 30.0, 60.0))
    x = echoes.distances * np.cos(np.radians([0.0, 3.0, 10.0, 30.0, 60.0]))
    np.testing.assert_allclose(x, [1.997, 5.0, 5.0, 5.0, 5.0], atol=1e-4)
    # Through the pane and back: transmittance squared, of a white wall's cosine.
    glass = MATERIALS["glass"]
    expected = 0.8 * math.cos(math.radians(10.0)) * glass.transmittance**2
    assert echoes.remissions[2] == pytest.approx(expected, rel=0.01)


def test_both_casters_look_through_the_same_glass() -> None:
    pytest.importorskip("embreex")
    from robot_sim.raycasting.embree_caster import EmbreeRayCaster
    from robot_sim.raycasting.embree_scene import StaticGeometry

    bench = DriveBench(
        pane_xml(2.0)
        + pane_xml(3.0, yaw=0.4)
        + wall_xml(5.0)
        + box_xml(0.0, 3.0, (4.0, 0.1, 2.0), "mirror")
    )
    rays = along(*np.linspace(-40.0, 80.0, 121))
    slow = bench.echoes(rays)
    bench.caster = EmbreeRayCaster(StaticGeometry(bench.model), bench.model, bench.data)
    fast = bench.echoes(rays)
    np.testing.assert_allclose(fast.distances, slow.distances, atol=1e-4)
    np.testing.assert_allclose(fast.remissions, slow.remissions, rtol=1e-4, atol=1e-6)
    assert np.isfinite(slow.distances).sum() > 80


def test_glint_fades_with_the_angle_of_incidence_as_configured() -> None:
    bench = DriveBench(pane_xml(2.0))
    degrees = np.array([0.0, 0.5, 1.0, 1.5])
    glass, panes = MATERIALS["glass"], Panes()
    expected = glass.reflectivity + panes.glint * glass.specular * np.exp(
        -((np.sin(np.radians(degrees)) / panes.lobe) ** 2)
    )
    np.testing.assert_allclose(bench.echoes(along(*degrees)).remissions, expected, rtol=5e-3)


def test_pane_before_nothing_is_told_only_near_normal_incidence() -> None:
    bench = DriveBench(pane_xml(4.0))
    effects = lidar_model("sick_lms111").effects()
    told = np.isfinite([scan.ranges for scan in bench.sweeps(40, effects=effects)]).mean(axis=0)
    degrees = np.abs(np.linspace(-135.0, 135.0, 541))
    assert told[degrees < 0.6].min() > 0.9
    assert told[(degrees > 6.0) & (degrees < 40.0)].max() < 0.1


def test_two_panes_take_the_light_of_both() -> None:
    one = DriveBench(pane_xml(2.0) + wall_xml(5.0)).echoes(along(10.0))
    two = DriveBench(pane_xml(2.0) + pane_xml(3.0) + wall_xml(5.0)).echoes(along(10.0))
    np.testing.assert_allclose(two.distances, one.distances, atol=1e-4)
    glass = MATERIALS["glass"]
    assert two.remissions[0] / one.remissions[0] == pytest.approx(glass.transmittance**2, rel=0.01)


def test_mirror_shows_what_is_before_it_as_if_behind() -> None:
    slant = box_xml(2.0, 0.0, (0.003, 1.0, 1.0), "mirror", yaw=math.radians(-45.0))
    bench = DriveBench(
        slant
        + box_xml(0.0, 3.1, (9.0, 0.1, 2.0), "wall")
        + box_xml(0.0, -3.1, (9.0, 0.1, 2.0), "wall")
    )
    echoes = bench.echoes(along(0.0))
    # Its front is 3 mm off, along a normal at 45 deg: 2 - 0.0042 m to it, then as far as the wall.
    assert echoes.distances[0] == pytest.approx(5.0 - 0.003 * math.sqrt(2.0), abs=1e-4)
    assert echoes.remissions[0] == pytest.approx(0.8 * 0.85**2, rel=1e-3)


def test_two_mirrors_face_to_face_end() -> None:
    bench = DriveBench(
        box_xml(2.0, 0.0, (0.003, 5.0, 5.0), "mirror")
        + box_xml(-2.0, 0.0, (0.003, 5.0, 5.0), "mirror")
    )
    echoes = bench.echoes(along(0.0, 20.0, 45.0))
    assert echoes.distances[0] == pytest.approx(1.997)
    assert np.isfinite(echoes.distances).all()


def test_glass_is_a_wall_while_the_effect_is_off() -> None:
    bench = DriveBench(pane_xml(2.0) + wall_xml(5.0))
    (scan,) = bench.sweeps(1, effects=Effects(sensitivity=Sensitivity()))
    assert scan.ranges[AHEAD + 40] * math.cos(math.radians(20.0)) == pytest.approx(1.997, abs=1e-4)
    assert scan.intensities[AHEAD] == pytest.approx(0.8)


# Daylight


def test_sun_shortens_the_range_by_the_power_it_costs() -> None:
    share = {}
    for level in (0.0, 1.0):
        effects = Effects(sensitivity=Sensitivity(), sunlight=Sunlight(level, false_echoes=0.0))
        bench = DriveBench(wall_xml(14.0, "dark_fabric"))
        scans = bench.sweeps(30, effects=effects, **NARROW)
        share[level] = float(np.isfinite([scan.ranges for scan in scans]).mean())
    odds = 19.0 * (18.0 / 14.0) ** (2.0 / 0.10)
    assert share[0.0] == pytest.approx(odds / (1.0 + odds), abs=0.02)
    # Full sun asks for twice the power.
    bright = odds * 0.5 ** (1.0 / 0.10)
    assert share[1.0] == pytest.approx(bright / (1.0 + bright), abs=0.03)


def test_sun_makes_up_echoes_only_where_there_are_none() -> None:
    effects = Effects(sensitivity=Sensitivity(), sunlight=Sunlight(level=0.5, false_echoes=0.04))
    bench = DriveBench(box_xml(5.1, 0.0, (0.1, 2.0, 2.0), "wall"))
    ranges = np.array([scan.ranges for scan in bench.sweeps(200, effects=effects)])
    degrees = np.abs(np.linspace(-135.0, 135.0, 541))
    np.testing.assert_allclose(
        ranges[:, degrees < 20.0] * np.cos(np.radians(degrees[degrees < 20.0])), 5.0, atol=1e-5
    )
    false = ranges[:, degrees > 25.0]
    assert np.isfinite(false).mean() == pytest.approx(0.5 * 0.04, rel=0.1)
    told = false[np.isfinite(false)]
    assert np.percentile(told, [25, 50, 75]) == pytest.approx([5.1, 10.05, 15.0], abs=0.7)


def test_sun_blurs_weak_echoes_and_leaves_strong_ones() -> None:
    sunlight = Sunlight(level=1.0, threshold_rise=0.0, false_echoes=0.0)
    sigma = {}
    for material, distance in (("wall", 3.0), ("dark_fabric", 17.0)):
        bench = DriveBench(wall_xml(distance, material))
        effects = Effects(sensitivity=Sensitivity(), sunlight=sunlight)
        scans = bench.sweeps(60, effects=effects, sigma=0.012, **NARROW)
        ranges = np.array([scan.ranges for scan in scans])
        sigma[material] = float(ranges[np.isfinite(ranges)].std())
    assert sigma["wall"] == pytest.approx(0.012, rel=0.03)
    weakness = Sensitivity().threshold / (0.1 / 17.0**2)
    assert sigma["dark_fabric"] == pytest.approx(0.012 * (1.0 + weakness), rel=0.06)


# Moving things


@dataclass(frozen=True)
class Walker:
    """A plate 0.5 m wide that goes straight ahead at a steady pace."""

    velocity: tuple[float, float]
    name: str = "walker"

    def pose_at(self, times: IntArray) -> tuple[FloatArray, FloatArray]:
        x, y = (v * 1e-9 * times for v in self.velocity)
        return np.stack([2.0 + x, y, 0.0 * x], axis=1), np.zeros(len(times))


PLATE = """<body name="walker" mocap="true" pos="2 0 0">
<geom type="box" size="0.05 0.25 0.9" pos="0.05 0 0"/></body>"""


def test_walker_who_comes_nearer_is_slanted_by_the_time_of_the_sweep() -> None:
    walker = Walker((-1.4, 0.0))
    (scan,) = DriveBench(PLATE, [walker]).sweeps(1)
    seen = np.isfinite(scan.ranges)
    x = scan.ranges[seen] * np.cos(scan.angles[seen])
    np.testing.assert_allclose(x, 2.0 - 1.4 * 1e-9 * scan.offsets[seen], atol=1e-5)
    # From one shoulder to the other the mirror takes 4 ms of its 100: 5.6 mm.
    width = np.ptp(scan.angles[seen]) / (2.0 * math.pi) * 0.1
    assert np.ptp(x) == pytest.approx(1.4 * width, rel=0.01)
    assert 0.004 < np.ptp(x) < 0.007


@pytest.mark.parametrize("speed", [-1.4, 0.0, 1.4])
def test_walker_who_goes_along_with_the_sweep_looks_wider(speed: float) -> None:
    (scan,) = DriveBench(PLATE, [Walker((0.0, speed))]).sweeps(
        1, resolution=math.radians(0.01), field_of_view=math.radians(90.0)
    )
    seen = scan.angles[np.isfinite(scan.ranges)]

    def edge(side: float) -> float:
        """Return the angle where the mirror catches up with a shoulder."""
        angle = 0.0
        for _ in range(50):
            time = (angle + math.radians(45.0)) / (2.0 * math.pi) * 0.1
            angle = math.atan2(side + speed * time, 2.0)
        return angle

    assert seen[0] == pytest.approx(edge(-0.25), abs=math.radians(0.011))
    assert seen[-1] == pytest.approx(edge(0.25), abs=math.radians(0.011))
    gain = 2.0 * (math.tan(seen[-1]) - math.tan(seen[0])) - 0.5
    assert math.copysign(1.0, gain) == math.copysign(1.0, speed) or abs(gain) < 1e-3


# Bias and steps


def test_bias_is_one_number_per_unit_within_the_sheets_bound() -> None:
    bench = DriveBench(wall_xml(5.0))
    biases = []
    for seed in range(200):
        first, second = bench.sweeps(
            2, seed=seed, effects=Effects(bias=Bias(0.03)), field_of_view=1e-5, resolution=1e-5
        )
        assert first.ranges[0] == pytest.approx(second.ranges[0], abs=1e-6)
        biases.append(first.ranges[0] - 5.0)
    assert np.abs(biases).max() < 0.0301
    assert np.std(biases) == pytest.approx(0.03 / math.sqrt(3.0), rel=0.1)
    assert abs(np.mean(biases)) < 0.004


def test_ranges_come_in_whole_steps() -> None:
    (scan,) = DriveBench(wall_xml(5.0)).sweeps(
        1, effects=Effects(quantisation=Quantisation(0.01)), sigma=0.02
    )
    steps = scan.ranges[np.isfinite(scan.ranges)] / 0.01
    np.testing.assert_allclose(steps, np.rint(steps), atol=2e-4)
    assert len(np.unique(np.rint(steps))) > 100


# All together


def test_one_effect_more_leaves_the_draws_of_the_others() -> None:
    bench = DriveBench(wall_xml(5.0))
    plain, stepped, biased = (
        bench.sweeps(2, effects=effects, sigma=0.012)[1].ranges
        for effects in (
            Effects(),
            Effects(quantisation=Quantisation(1e-4)),
            Effects(bias=Bias(0.01), panes=Panes()),
        )
    )
    seen = np.isfinite(plain)
    np.testing.assert_allclose(stepped[seen], plain[seen], atol=0.6e-4)
    shift = biased[seen] - plain[seen]
    np.testing.assert_allclose(shift, shift[0], atol=1e-5)
    assert shift[0] != 0.0


@pytest.mark.parametrize("model", LIDARS)
def test_realistic_scanner_switches_everything_on_with_its_models_figures(model: str) -> None:
    sheet = lidar_model(model)
    config = ScannerConfig.of("laser_horizontal", model, realistic=True, sun=0.7)
    effects = config.effects
    assert None not in [getattr(effects, field.name) for field in fields(Effects)]
    assert effects.sensitivity is not None
    assert effects.bias is not None
    assert effects.quantisation is not None
    assert effects.sensitivity.range_at_10_percent == sheet.range_at_10_percent
    assert effects.bias.bound == sheet.systematic
    assert effects.quantisation.step == sheet.quantum
    assert config.beam == sheet.beam
    assert ScannerConfig.of("laser_horizontal", model).effects == Effects()


def test_optical_effects_without_the_worlds_optics_are_refused() -> None:
    bench = DriveBench(wall_xml(5.0))
    config = ScannerConfig("laser_vertical", effects=Effects(panes=Panes()))
    with pytest.raises(SimulationError, match="'laser_vertical' need the world's optics"):
        Scanner(config, MOUNTS["laser_vertical"], bench.caster, np.random.SeedSequence(0))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Beam(divergence=-0.01), "divergence must be >= 0"),
        (lambda: Mixing(blend=1.5), "blend must be a share between 0 and 1, got 1.5"),
        (lambda: Spreading(gain=math.nan), "gain must be >= 0"),
        (lambda: Sensitivity(range_at_10_percent=0.0), "range_at_10_percent must be > 0"),
        (lambda: Sensitivity(reliability=1.0), r"reliability must be in \[0.5, 1\)"),
        (lambda: Panes(depth=0), "depth must be at least 1"),
        (lambda: Panes(lobe=0.0), "lobe must be > 0"),
        (lambda: Sunlight(level=100_000.0), "level must be a share"),
        (lambda: Bias(-0.1), "bound must be >= 0"),
        (lambda: Quantisation(0.0), "step must be > 0"),
    ],
)
def test_impossible_effects_are_refused_by_parameter(
    make: Callable[[], object], message: str
) -> None:
    with pytest.raises(SensorError, match=message):
        make()
