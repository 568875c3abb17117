"""The path ahead on the display: drawn while the link is slow, by what was sent and what the robot says."""

from __future__ import annotations

from pathlib import Path

import pytest

from localization.display.entity_paths import BASE
from localization.display.rerun_sink import Sink
from localization.types import SECOND
from teleop.operator.display.display import Display
from teleop.operator.display.path_ahead import PathWhen
from teleop.operator.robot_state.alarm_rules import Notice, Severity
from teleop.operator.robot_state.banner import Banner
from teleop.operator.robot_state.station_view import Pulse
from tests.teleop.operator.display.test_display import _control, _tf
from tests.teleop.operator.support import column

LIMITS = {
    "acceleration": 0.5,
    "braking": 1.0,
    "turn_acceleration": 2.6,
    "turn_braking": 5.2,
    "lag": 0.05,
}


def paths(file: Path, when: PathWhen, round_trip: float, **more: float) -> list[float]:
    """Return how far the path reaches in each drawing, of a robot that drives ahead at 0.5 m/s."""
    display = Display(None, sink=Sink(file=file), strict=True, path_ahead=when)
    display.show("/drive_limits", LIMITS)
    notice = Notice(Severity.CALM, "connected")
    display.pulse(Pulse(0, frozenset(), "connected", Banner(notice, (), ("",)), round_trip))
    for tick in range(20):
        stamp = (100 + 2 * tick) * SECOND // 20
        state = _control(stamp, "armed", "me", "driving") | {"linear": 0.5, "angular": 0.0, **more}
        display.show("/teleop/state", state)
        display.show("/tf", _tf(stamp, 0.05 * tick))
    display.close()
    strips = column(file, f"{BASE}/ahead/path", "LineStrips3D:strips")
    return [float(strip[0][-1][0]) for strip in strips]


@pytest.mark.parametrize(
    ("when", "round_trip", "reach"),
    [
        ("late", 0.3, 0.5 * 3.3),
        ("late", 0.1, None),
        ("always", 0.1, 0.5 * 3.1),
        ("never", 0.9, None),
    ],
)
def test_path_reaches_three_seconds_beyond_the_round_trip_while_it_is_wanted(
    tmp_path: Path, when: PathWhen, round_trip: float, reach: float | None
) -> None:
    found = paths(tmp_path / "x.rrd", when, round_trip)
    assert found == ([] if reach is None else [pytest.approx(reach, abs=0.011)] * 20)


def test_path_ends_where_the_guard_would_stop_the_robot(tmp_path: Path) -> None:
    found = paths(tmp_path / "x.rrd", "late", 0.3, guard_ahead=1.5)
    assert found == [pytest.approx(0.75, abs=0.011)] * 20


def test_path_goes_as_soon_as_the_link_is_fast_again(tmp_path: Path) -> None:
    file = tmp_path / "x.rrd"
    display = Display(None, sink=Sink(file=file), strict=True)
    display.show("/drive_limits", LIMITS)
    notice = Notice(Severity.CALM, "connected")
    for tick, round_trip in enumerate((0.3, 0.1, 0.1)):
        banner = Banner(notice, (), ("",))
        display.pulse(Pulse(0, frozenset(), "connected", banner, round_trip))
        state = _control(tick * SECOND, "armed", "me", "driving") | {"linear": 0.5, "angular": 0.0}
        display.show("/teleop/state", state)
        display.show("/tf", _tf(tick * SECOND, 0.0))
    display.close()
    assert len(column(file, f"{BASE}/ahead", "Clear:is_recursive")) == 1
