"""Scanners from data sheets: what they send, when, and which settings are refused."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from localization.logs.laser_scan_message import read_scan, same_scan, scan_message
from localization.types import Scan
from robot_sim.errors import SensorError, SimulationError
from robot_sim.sensors.lidar_models import LIDARS, lidar_model
from robot_sim.sensors.scanner_config import ScannerConfig
from robot_sim.simulation import Simulation, SimulationConfig
from robot_sim.worlds.world import World
from tests.robot_sim.driving import readings_of


def scans_of(world: World, scanner: ScannerConfig, ticks: int) -> list[Scan]:
    simulation = Simulation(world, config=SimulationConfig(scanners=(scanner,)))
    return readings_of(Scan, simulation, ticks)


def test_every_figure_of_every_model_names_its_source() -> None:
    figures = {
        "field_of_view_deg", "modes", "range_min", "range_max", "range_at_10_percent", "sigma",
        "systematic", "beam", "quantum",
    }  # fmt: skip
    for model in LIDARS.values():
        assert set(model.sources) == figures
        assert all(model.sources.values())


@pytest.mark.parametrize(
    ("model", "settings", "beams", "period_ns", "degree_ns"),
    [
        # The note's table: 37.0 us a degree, 27.8 us a beam in both modes, 17.4 us a beam.
        ("sick_lms200", {"resolution_deg": 1.0}, 181, 13_333_333, 37_037),
        ("sick_lms200", {}, 361, 26_666_666, 37_037),
        ("sick_lms200", {"resolution_deg": 0.25}, 401, 53_333_332, 37_037),
        ("sick_lms111", {}, 541, 40_000_000, 2 * 55_556),
        ("sick_lms111", {"rate_hz": 50}, 541, 20_000_000, 2 * 27_778),
        ("sick_lms111", {"resolution_deg": 0.25}, 1081, 40_000_000, 4 * 27_778),
        ("sick_lms111", {"rate_hz": 5}, 541, 200_000_000, 2 * 55_556),
        ("hokuyo_utm30lx", {}, 1081, 25_000_000, 4 * 17_361),
        ("hokuyo_utm30lx", {"rate_hz": 10}, 1081, 100_000_000, 4 * 17_361),
    ],
)
def test_models_give_their_sheets_beams_rates_and_beam_times(
    model: str, settings: dict[str, float], beams: int, period_ns: int, degree_ns: int
) -> None:
    config = ScannerConfig.of("laser_horizontal", model, **settings)  # type: ignore[arg-type]
    assert config.beams == beams
    assert config.period_ns == period_ns
    scan = config.scan(0, np.ones(config.beams_of(0)))
    per_degree = scan.offsets[-1] / math.degrees(scan.angles[-1] - scan.angles[0])
    assert per_degree == pytest.approx(degree_ns, rel=1e-3)
    assert sum(config.beams_of(part) for part in range(config.interlace)) == beams


@pytest.mark.parametrize("model", LIDARS)
def test_scans_of_every_model_survive_the_message(room: World, model: str) -> None:
    scans = scans_of(room, ScannerConfig.of("laser_horizontal", model), 8)
    sheet = lidar_model(model)
    assert len(scans) >= 3
    for scan in scans:
        message = scan_message(scan)
        assert same_scan(read_scan(message), scan)
        half = math.radians(sheet.field_of_view_deg / 2.0)
        assert message.angle_min == pytest.approx(-half, abs=math.radians(0.6))
        assert message.angle_max == pytest.approx(half, abs=math.radians(0.6))
        assert message.range_min == pytest.approx(sheet.range_min)
        assert message.range_max == pytest.approx(sheet.range_max)


def test_lms200_sends_odd_beams_one_turn_of_the_mirror_after_the_even_ones(room: World) -> None:
    scans = scans_of(room, ScannerConfig.of("laser_horizontal", "sick_lms200"), 8)
    # Two pictures from the start; simulated time is 160 ms, 12 turns of 13.33 ms.
    assert len(scans) == 12
    even, odd = scans[0], scans[1]
    assert (len(even.ranges), len(odd.ranges)) == (181, 180)
    np.testing.assert_allclose(np.diff(even.angles), math.radians(1.0), atol=1e-6)
    assert odd.angles[0] - even.angles[0] == pytest.approx(math.radians(0.5), abs=1e-6)
    at_even, at_odd = even.stamp + even.offsets[:-1], odd.stamp + odd.offsets
    # Half a degree later on top of the turn: 13.333 ms + 18.5 us.
    np.testing.assert_allclose(at_odd - at_even, 13_333_333 + 18_519, atol=50)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"model": "sick_lms100"}, "no lidar model named 'sick_lms100'.*sick_lms111"),
        (
            {"model": "sick_lms111", "rate_hz": 30},
            r"rate_hz.*30 Hz.*25 \(0.5 deg\), 50 \(0.5 deg\)",
        ),
        ({"model": "sick_lms111", "rate_hz": 0}, "rate_hz"),
        ({"model": "hokuyo_utm30lx", "resolution_deg": 0.5}, "resolution_deg.*it has 0.25"),
        ({"model": "sick_lms111", "rate_hz": 50, "resolution_deg": 0.25}, "rate_hz.*50 Hz"),
    ],
)
def test_settings_a_model_lacks_are_rejected_with_those_it_has(
    settings: dict[str, object], message: str
) -> None:
    with pytest.raises(SensorError, match=message):
        ScannerConfig.of("laser_horizontal", **settings)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"field_of_view": -0.1}, "field_of_view must be > 0"),
        ({"field_of_view": 7.0}, "field_of_view must be > 0 and <= 360 deg"),
        ({"resolution": 0.0}, "resolution must be > 0"),
        (
            {"resolution": math.radians(0.7)},
            "resolution must be an integer fraction .* such as 0.699482 deg",
        ),
        ({"period_ns": 0}, "period"),
        ({"phase_ns": -1}, "phase"),
        ({"interlace": 0}, "interlace must be from 1 to 540"),
        ({"turn_ns": 200_000_000}, "turn_ns must be > 0 and at most 100000000 ns"),
        ({"range_min": -1.0}, "range_min must be >= 0 m"),
        ({"range_min": 20.0}, "range_max must be > range_min, 20 m"),
        ({"range_max": math.inf}, "range_max"),
        ({"sigma": -0.01}, "sigma must be >= 0"),
        ({"sigma": math.nan}, "sigma must be >= 0"),
        ({"sigma_bands": ((20.0, 0.1), (10.0, 0.2))}, "sigma_bands must be in order"),
        ({"name": "laser_sideways"}, "laser_horizontal, laser_vertical"),
    ],
)
def test_invalid_parameters_are_rejected_by_name(
    parameters: dict[str, object], message: str
) -> None:
    with pytest.raises(SimulationError, match=message):
        ScannerConfig(**({"name": "laser_vertical"} | parameters))  # type: ignore[arg-type]


def test_sigma_follows_the_bands_of_the_sheet() -> None:
    noise = ScannerConfig.of("laser_horizontal", "hokuyo_utm30lx").noise
    np.testing.assert_array_equal(
        noise.at(np.array([0.5, 9.99, 10.01, 29.0, np.inf])), [0.01, 0.01, 0.03, 0.03, 0.03]
    )
    assert ScannerConfig.of("laser_horizontal", "sick_lms111").noise.at(np.ones(3)) == 0.012


def test_table_in_the_documentation_holds_the_models_figures() -> None:
    page = (Path(__file__).parents[3] / "docs/sheets/catalogues.md").read_text(encoding="utf-8")
    for m in LIDARS.values():
        modes = "; ".join(
            f"{mode.resolution_deg:g}° at {mode.rate_hz:g} Hz"
            + (f", {mode.interlace} turns" if mode.interlace > 1 else "")
            for mode in m.modes
        )
        sigma = f"{1e3 * m.sigma:g}" + "".join(
            f", {1e3 * s:g} from {r:g} m" for r, s in m.sigma_bands
        )
        spot = f"{1e3 * m.beam.divergence:g} mrad + {1e3 * m.beam.aperture:g} mm"
        cells = (
            f"`{m.name}`", f"{m.field_of_view_deg:g}°", modes,
            f"{m.range_min:g} to {m.range_max:g}", f"{m.range_at_10_percent:g}", sigma,
            f"±{1e3 * m.systematic:g}", spot, f"{1e3 * m.quantum:g}",
        )  # fmt: skip
        assert f"| {' | '.join(cells)} |" in page
