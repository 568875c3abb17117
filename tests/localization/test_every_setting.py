"""Each setting of the localiser changes what it answers in some situation: none is dead, none stops half way."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from enum import StrEnum
from functools import cache
from itertools import zip_longest
from typing import Any

import pytest

from localization.errors import LocalizationError
from localization.settings import setting_types
from tests.localization.settings_situations import SITUATIONS

pytestmark = [pytest.mark.slow, pytest.mark.sweep, pytest.mark.long]

SITUATION_OF = {
    "jump_detection.match_distance": "carried",
    "search.default_sigma_yaw": "tracked",
    "matcher": "tracked",
    "wheels": "slipping",
    "scanner_patience": "blind",
    "wheels.max_acceleration": "slipping, flat",
    "map_share": "odometry",
    "min_inlier_ratio": "odometry",
    "ekf": "tracked",
    "ekf.level": "flat",
    "ekf.slip_forward": "slipping",
    "ekf.slip_side": "slipping",
    "ekf.still_angle": "standing",
    "ekf.still_gate": "odometry and gyro",
    "ekf.still_position": "standing",
    "ekf.odometry": "odometry",
    "fixed_covariance": "kiss",
    "belief": "carried",
    "health": "carried",
    "health.notable_unexplained": "changed room",
    "kiss": "odometry",
    "kiss.convergence": "kiss",
    "kiss.iterations": "kiss",
    "kiss.kernel": "kiss",
    "kiss.max_correspondence_distance": "kiss",
    "kiss.point_noise": "tracked",
    "kiss.voxel": "kiss",
    "late_readings": "shaken stamps",
    "map_search": "searched",
    "registration": "tracked",
    "registration.rough": "odometry",
    "registration.rough_kernel": "odometry",
    "registration.rough_kernel_wide": "odometry",
    "registration.tangential": "odometry",
    "scan_consistency": "changed room",
    "search": "narrow hint",
    "search_schedule": "ambiguous",
}
"""Where a setting shows, by its name or the beginning of it; the longest name counts."""
RARE: frozenset[str] = frozenset(
    {
        "belief.carried",
        "extrinsics_monitor.min_offset",
        "extrinsics_monitor.remembered",
        "extrinsics_monitor.sigmas",
        "extrinsics_monitor.stretches",
        "belief.rate",
        "health.agreement_distance",
        "health.check_after",
        "health.lost_sigma",
        "health.silence",
        "jump_detection.points",
        "kiss_odometry",
        "late_readings.horizon",
        "map_search.max_blocks",
        "map_search.max_work",
        "map_search.reach",
        "map_search.refine",
        "retry_below",
        "retry_sigma",
        "search.default_sigma",
        "search.max_tilt",
        "search.max_tilt_uneven",
        "sweep_distance",
        "search_schedule.distance",
        "search_schedule.period",
        "good_inlier_ratio",
        "undo_memory",
    }
)
"""Settings that no drive here has shown; all others must show."""
SETTINGS = sorted(name for name in setting_types() if not name.startswith("sensors."))


def situation_of(name: str) -> str:
    """Return the situation in which a setting shows."""
    fitting = [known for known in SITUATION_OF if name == known or name.startswith(f"{known}.")]
    return SITUATION_OF[max(fitting, key=len)]


def others(value: Any) -> Iterator[Any]:
    """Yield other values of a setting, first those near its own."""
    match value:
        case bool():
            yield not value
        case StrEnum():
            yield from (member for member in type(value) if member is not value)
        case int():
            yield from (2 * value + 1, value // 2, 1)
        case float():
            finite = value if value < 1e9 else 1.0
            yield from (
                1.5 * finite + 0.01,
                0.5 * finite - 0.001,
                4.0 * finite + 0.3,
                0.05 * finite,
            )
        case tuple():
            yield from zip(*map(others, value), strict=False)


def value_of(config: Any, name: str) -> Any:
    """Return the value of a setting."""
    for part in name.split("."):
        config = getattr(config, part)
    return config


def changed(config: Any, name: str, value: Any) -> Any:
    """Return settings with another value for one of them."""
    first, _, rest = name.partition(".")
    return replace(
        config, **{first: changed(getattr(config, first), rest, value) if rest else value}
    )


@cache
def usual(situation: str) -> tuple[object, ...]:
    """The answers of a situation with its own settings."""
    return tuple(SITUATIONS[situation].run(SITUATIONS[situation].config))


def shows(name: str, situation: str) -> bool:
    """Return whether some other value of a setting changes what is answered in a situation."""
    config, run = SITUATIONS[situation].config, SITUATIONS[situation].run
    for other in others(value_of(config, name)):
        try:
            answers = run(changed(config, name, other))
            if any(a != b for a, b in zip_longest(answers, usual(situation))):
                return True
        except (LocalizationError, ValueError, ArithmeticError):
            continue  # A value that is refused shows nothing.
    return False


@pytest.mark.parametrize("situation", SITUATIONS)
def test_a_situation_repeats_itself_to_the_bit(situation: str) -> None:
    assert tuple(SITUATIONS[situation].run(SITUATIONS[situation].config)) == usual(situation)


@pytest.mark.parametrize("name", [name for name in SETTINGS if name not in RARE])
def test_setting_changes_what_the_localiser_answers(name: str) -> None:
    assert shows(name, situation_of(name)), name


def test_every_setting_that_is_left_out_exists() -> None:
    assert set(SETTINGS) >= RARE
