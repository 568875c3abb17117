"""The figures of the console page: what needs no browser for it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks.console import parts as console
from benchmarks.console.frames import script_times
from benchmarks.console.losing import ALL, figures
from benchmarks.console.losses import KINDS, Loss
from benchmarks.console.publisher import cloud_message
from benchmarks.console.robot import filled_up, read_edges
from benchmarks.console.traffic import megabytes, slope
from benchmarks.sheets.figure_table import pooled
from localization.maps.cloud import Cloud


def loss(kind: str = "closed", *, after: float = 0.5, on: bool = False, said: str = "left") -> Loss:
    return Loss(kind, after, on, said)


def test_losing_it_stands_for_all_its_chunks() -> None:
    assert console.chosen(["losing"]) == [f"losing-{n}" for n in range(1, 9)]
    assert console.chosen(["cloud", "losing-2", "cloud"]) == ["cloud", "losing-2"]
    assert console.chosen([]) == list(console.PARTS)


def test_unknown_part_is_named_with_those_there_are(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        console.main(["clouds"])
    assert "no part clouds; there are opening, rate, frames" in capsys.readouterr().err


def test_trials_that_stop_late_drive_on_or_say_nothing_miss_the_goal() -> None:
    some = [loss(), loss(after=0.54), loss(on=True), loss(said="Ready")]
    found = {f.quantity: f for f in figures(ALL, some)}
    assert found["stopped in time"].value == 75.0
    assert found["drove on when all was back"].value == 25.0
    assert found["said why"].value == 75.0
    assert found["longest until zero"].value == 0.54
    assert {f.verdict for f in found.values()} == {"missed"}


def test_trials_that_all_stop_in_time_meet_the_goal() -> None:
    found = list(figures(ALL, [loss(after=0.52)] * 10))
    assert all(f.verdict.startswith("met") for f in found)
    assert not list(figures(KINDS[0], []))


def test_chunks_of_losing_it_count_as_one() -> None:
    one, other = list(figures(ALL, [loss()] * 20)), list(figures(ALL, [loss(), loss(after=0.6)]))
    found = {f.quantity: f for f in pooled([*one, *other])}
    assert found["stopped in time"].value == pytest.approx(100.0 * 21 / 22)
    assert found["longest until zero"].value == 0.6
    assert all(f.n == 22 for f in found.values())


def test_script_times_are_those_of_callbacks_for_frames() -> None:
    events = [
        {"name": "FireAnimationFrame", "dur": 9000, "tdur": 1500},
        {"name": "FunctionCall", "dur": 9000, "tdur": 8000},
        {"name": "FireAnimationFrame", "ph": "I"},
    ]
    assert script_times({"traceEvents": events}) == [1.5]


def test_edges_are_read_up_to_the_last_whole_line() -> None:
    assert read_edges("1500000000 1\n2000000000 0\n25000") == [(1.5, True), (2.0, False)]
    assert read_edges("15") == []


def test_map_is_filled_up_near_its_own_points_and_cut_to_size() -> None:
    points = np.random.default_rng(1).uniform(0.0, 30.0, (50, 3))
    cloud = Cloud(points, np.tile([0.0, 0.0, 1.0], (50, 1)), "room")
    more = filled_up(cloud, 120)
    assert len(more.points) == len(more.normals) == 120
    assert np.array_equal(more.points[:50], points)
    apart = np.linalg.norm(more.points[50:, None] - points, axis=2).min(axis=1)
    assert apart.max() < 0.05
    assert len(filled_up(cloud, 20).points) == 20


def test_cloud_of_fifty_thousand_points_is_a_megabyte() -> None:
    message = cloud_message(0, np.zeros((50_000, 3)), np.random.default_rng(0))
    assert len(message["data"]) == message["row_step"] == 1_000_000


def test_memory_is_all_that_script_holds_and_its_growth_per_minute() -> None:
    usage = {
        "usedSize": 2e6,
        "totalSize": 9e6,
        "embedderHeapUsedSize": 1e6,
        "backingStorageSize": 5e6,
    }
    assert megabytes(usage) == 8.0
    grows, half = slope([10.0, 12.0, 11.0, 13.0])  # one every 20 s
    assert grows == pytest.approx(2.4)
    assert half == pytest.approx(
        4.303 * math.sqrt(0.9 / 5.0) * 3.0, rel=1e-3
    )  # Student's t, 2 degrees of freedom
