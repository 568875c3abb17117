"""Links with names, and links replayed from recordings."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st

from teleop.errors import SettingError
from teleop.link.emulation import SECOND, LinkConfig, LinkEmulation
from teleop.link.profiles import profile_names
from teleop.link.recorded_trips import parse_trips
from teleop.package_data import assets


def trips(link: LinkEmulation, times: np.ndarray, *, ping: bool = False) -> np.ndarray:
    """Return round trips [s] of small frames that a client sends at times [s], answered at once."""
    found = []
    for time in times:
        sent = round(time * SECOND)
        there = link.arrival(1, 60, sent, ping=ping)
        found.append((link.departure(1, 60, there, ping=ping) - sent) / SECOND)
    return np.array(found)


def test_starlink_has_the_percentiles_of_its_source_and_its_worst_at_the_begin_of_each_cycle() -> (
    None
):
    link = LinkEmulation(LinkConfig.parse(("starlink",)))
    times = np.arange(0.0, 120.0, 0.1) + 0.05
    # As its source measured: no ping waits for another.
    measured = trips(link, times, ping=True)
    assert np.quantile(measured, 0.5) == pytest.approx(0.0576, rel=0.05)
    assert np.quantile(measured, 0.95) == pytest.approx(0.0737, rel=0.12)
    cycles = (times // 15.0).astype(int)
    worst = [measured[cycles == n].argmax() for n in range(8)]
    assert np.mean(np.array(worst) < 12) >= 0.5, "what was lost may hold up later frames as well"


@pytest.mark.parametrize(
    ("name", "least", "most"), [("lan", 0.0005, 0.0012), ("lte", 0.088, 0.125), ("geo", 0.6, 0.65)]
)
def test_a_profile_has_the_round_trips_that_its_source_says(
    name: str, least: float, most: float
) -> None:
    measured = trips(LinkEmulation(LinkConfig.parse((name,))), np.arange(0.0, 60.0, 0.5))
    assert measured.min() >= least
    assert np.median(measured) <= most


def test_roaming_holds_up_everything_for_as_long_as_a_cheap_module_takes() -> None:
    measured = trips(LinkEmulation(LinkConfig.parse(("wifi-roaming",))), np.arange(0.0, 80.0, 0.1))
    assert 1.1 < measured.max() < 1.3
    assert np.quantile(measured, 0.9) < 0.02


def test_every_profile_says_where_it_is_from_and_can_be_changed_by_later_words() -> None:
    assert profile_names() == ["geo", "lan", "lte", "starlink", "wifi-roaming"]
    for name in profile_names():
        text = (assets() / "links" / f"{name}.toml").read_text(encoding="utf-8")
        assert "source = " in text
        assert "title = " in text
    assert LinkConfig.parse(("geo", "up.delay=0.1")).up.delay == 0.1
    assert LinkConfig.parse(("geo", "up.delay=0.1")).down.delay == 0.3


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig"])
def test_a_recording_is_replayed_row_by_row_and_begins_again(tmp_path: Path, encoding: str) -> None:
    file = tmp_path / "trips.csv"
    file.write_text("time_s,up_ms,down_ms\n0,100,10\n1,200,\n2,300,30\n3,0,0\n", encoding)
    link = LinkEmulation(LinkConfig.parse((f"trips={file}",)))
    sent = [0.0, 0.5, 1.0, 1.9, 2.5, 3.0, 4.2]
    arrived = [link.arrival(1, 100, round(t * SECOND)) / SECOND for t in sent]
    assert arrived == pytest.approx([0.1, 0.6, 1.2, 2.1, 2.8, 3.1, 4.4])
    left = [link.departure(1, 100, round(t * SECOND)) / SECOND for t in (0.0, 1.0, 1.5, 2.0)]
    assert left == pytest.approx([0.01, 2.03, 2.03, 2.03]), "what was lost comes with the next row"


@given(
    rows=st.lists(st.one_of(st.none(), st.floats(0.0, 5000.0)), min_size=1, max_size=20),
    sends=st.lists(st.floats(0.0, 3.0), min_size=1, max_size=30),
)
def test_a_recording_loses_and_reorders_nothing(
    rows: list[float | None], sends: list[float]
) -> None:
    if all(row is None for row in rows):
        rows.append(1.0)
    lines = ["time_s,round_trip_ms", *(f"{n},{'' if v is None else v}" for n, v in enumerate(rows))]
    up, down = parse_trips([*lines, f"{len(rows)},0"], "drawn")
    link = LinkEmulation(LinkConfig(up_trips=up, down_trips=down))
    now, last = 0, 0
    for pause in sends:
        now += round(pause * SECOND)
        arrival = link.arrival(1, 100, now)
        assert arrival >= max(now, last)
        last = arrival


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "must begin with time_s,round_trip_ms or time_s,up_ms,down_ms, got nothing"),
        ("a,b\n", "got a,b"),
        ("time_s,round_trip_ms\n0,1\n", "two rows at least, got 1"),
        ("time_s,round_trip_ms\n0,1\n0,2\n", "line 3: time_s must rise"),
        ("time_s,round_trip_ms\n1,1\n2,2\n", "line 2: time_s must rise, from 0 on, got 1"),
        (
            "time_s,round_trip_ms\n0,fast\n1,2\n",
            "line 2: round_trip_ms must be a number, got 'fast'",
        ),
        ("time_s,round_trip_ms\n0,nan\n1,2\n", "line 2: round_trip_ms must be 0 to 60000, got nan"),
        ("time_s,round_trip_ms\n0,1,2\n", "line 2: 3 values, the header has 2"),
        ("time_s,up_ms,down_ms\n0,,1\n1,0,0\n", "nothing gets through"),
    ],
)
def test_a_wrong_recording_is_refused_by_its_line(tmp_path: Path, text: str, reason: str) -> None:
    file = tmp_path / "trips.csv"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(SettingError, match=reason):
        LinkConfig.parse((f"trips={file}",))


def test_a_recording_that_is_not_there_is_named() -> None:
    with pytest.raises(SettingError, match=r"trips=nowhere\.csv: No such file"):
        LinkConfig.parse(("trips=nowhere.csv",))
