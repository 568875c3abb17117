"""Optical effects of lidars, one by one, in small worlds, against their formulas."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import pytest

from benchmarks.pictures.optical_bench import (
    box_xml,
    wall_xml,
)
from localization.types import IntArray
from robot_sim.array_types import FloatArray
from robot_sim.errors import SensorError, SimulationError
from robot_sim.robot.p3at import MOUNTS
from robot_sim.scene_objects.materials import MATERIALS
from robot_sim.sensors.echoes import (
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
from robot_sim.sensors.scanner_config import ScannerConfig
from tests.robot_sim.sensors.support import AHEAD, EffectsBench

NARROW: dict[str, Any] = {"field_of_view": 1e-5, "resolution": 1e-7}
"""A hundred beams straight ahead."""


@pytest.mark.slow
def test_sigma_grows_with_the_depth_of_the_footprint() -> None:
    bench = EffectsBench(box_xml(0.0, -1.0, (40.0, 0.001, 2.0), "wall"))
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
        bench = EffectsBench(box_xml(10.0, 0.0, (0.001, 6.0, 2.0), "asphalt", yaw=slope))
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
def test_dark_surfaces_are_lost_by_the_lidar_equation(material: str, distance: float) -> None:
    sensitivity = Sensitivity(range_at_10_percent=18.0)
    bench = EffectsBench(wall_xml(distance, material))
    scans = bench.sweeps(30, effects=Effects(sensitivity=sensitivity), range_max=30.0, **NARROW)
    share = float(np.isfinite([scan.ranges for scan in scans]).mean())
    rho = MATERIALS[material].reflectivity
    # The same as the logistic of log power, by hand: 19 to 1 for 10 % at 18 m.
    odds = 19.0 * ((rho / distance**2) / (0.1 / 18.0**2)) ** (1.0 / 0.10)
    assert share == pytest.approx(odds / (1.0 + odds), abs=0.03)


def test_retroreflectors_are_bright_from_afar_and_aslant() -> None:
    bench = EffectsBench(box_xml(15.0, 0.0, (0.001, 1.0, 1.0), "retroreflector", yaw=1.0))
    (scan,) = bench.sweeps(1, effects=Effects(sensitivity=Sensitivity()))
    assert scan.intensities[AHEAD] == pytest.approx(20.0)


def test_sun_shortens_the_range_by_the_power_it_costs() -> None:
    share = {}
    for level in (0.0, 1.0):
        effects = Effects(sensitivity=Sensitivity(), sunlight=Sunlight(level, false_echoes=0.0))
        bench = EffectsBench(wall_xml(14.0, "dark_fabric"))
        scans = bench.sweeps(30, effects=effects, **NARROW)
        share[level] = float(np.isfinite([scan.ranges for scan in scans]).mean())
    odds = 19.0 * (18.0 / 14.0) ** (2.0 / 0.10)
    assert share[0.0] == pytest.approx(odds / (1.0 + odds), abs=0.02)
    # Full sun asks for twice the power.
    bright = odds * 0.5 ** (1.0 / 0.10)
    assert share[1.0] == pytest.approx(bright / (1.0 + bright), abs=0.03)


def test_sun_adds_false_echoes_only_to_beams_without_one() -> None:
    effects = Effects(sensitivity=Sensitivity(), sunlight=Sunlight(level=0.5, false_echoes=0.04))
    bench = EffectsBench(box_xml(5.1, 0.0, (0.1, 2.0, 2.0), "wall"))
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
        bench = EffectsBench(wall_xml(distance, material))
        effects = Effects(sensitivity=Sensitivity(), sunlight=sunlight)
        scans = bench.sweeps(60, effects=effects, sigma=0.012, **NARROW)
        ranges = np.array([scan.ranges for scan in scans])
        sigma[material] = float(ranges[np.isfinite(ranges)].std())
    assert sigma["wall"] == pytest.approx(0.012, rel=0.03)
    weakness = Sensitivity().threshold / (0.1 / 17.0**2)
    assert sigma["dark_fabric"] == pytest.approx(0.012 * (1.0 + weakness), rel=0.06)


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
    (scan,) = EffectsBench(PLATE, [walker]).sweeps(1)
    seen = np.isfinite(scan.ranges)
    x = scan.ranges[seen] * np.cos(scan.angles[seen])
    np.testing.assert_allclose(x, 2.0 - 1.4 * 1e-9 * scan.offsets[seen], atol=1e-5)
    # From one shoulder to the other the mirror takes 4 ms of its 100: 5.6 mm.
    width = np.ptp(scan.angles[seen]) / (2.0 * math.pi) * 0.1
    assert np.ptp(x) == pytest.approx(1.4 * width, rel=0.01)
    assert 0.004 < np.ptp(x) < 0.007


@pytest.mark.parametrize("speed", [-1.4, 0.0, 1.4])
def test_walker_who_goes_along_with_the_sweep_looks_wider(speed: float) -> None:
    (scan,) = EffectsBench(PLATE, [Walker((0.0, speed))]).sweeps(
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


def test_bias_is_one_number_per_unit_within_the_sheets_bound() -> None:
    bench = EffectsBench(wall_xml(5.0))
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


def test_ranges_are_integer_steps() -> None:
    (scan,) = EffectsBench(wall_xml(5.0)).sweeps(
        1, effects=Effects(quantisation=Quantisation(0.01)), sigma=0.02
    )
    steps = scan.ranges[np.isfinite(scan.ranges)] / 0.01
    np.testing.assert_allclose(steps, np.rint(steps), atol=2e-4)
    assert len(np.unique(np.rint(steps))) > 100


def test_enabling_an_effect_does_not_change_the_draws_of_the_others() -> None:
    bench = EffectsBench(wall_xml(5.0))
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
def test_realistic_scanner_has_all_effects_with_its_models_figures(model: str) -> None:
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


def test_optical_effects_without_the_worlds_optics_are_rejected() -> None:
    bench = EffectsBench(wall_xml(5.0))
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
def test_invalid_effects_are_rejected_by_parameter(
    make: Callable[[], object], message: str
) -> None:
    with pytest.raises(SensorError, match=message):
        make()
