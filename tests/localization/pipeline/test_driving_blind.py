"""A robot whose scanners fall silent, and whose wheels spin meanwhile, is not where its wheels have it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from localization.maps.prepared_map import PreparedMap
from localization.pipeline.localizer import Localizer
from localization.types import SECOND, Health, Hint, Pose, Scan, WheelSpeeds
from tests.localization.pipeline.wheel_log import block, upright
from tests.support_rooms import MOUNTS, Drive, Place, box

pytestmark = pytest.mark.slow

HEDGE = Place(
    [
        *upright(box((-2.0, -1.6, -1.0), (26.0, 5.0, 2.5), inside=True)),
        *(f for i in range(-1, 26) for f in block((i + 0.0, -1.6), (i + 0.45, -1.2))),
        *block((9.0, 4.3), (11.0, 5.0)),
        *block((16.5, 3.9), (17.5, 5.0)),
    ]
)
"""A yard along whose southern side a post stands each metre."""

SILENT = (4 * SECOND, 10 * SECOND)
"""When both scanners send nothing [ns]."""
SPINNING = (5 * SECOND, 7 * SECOND)
"""When the wheels turn faster than the robot moves [ns]."""

BESIDE = (0.0, 0.01, 0.03, 0.05, 0.1)
"""Ways that differ by next to nothing: what holds on one only, holds by luck [m]."""


@dataclass(frozen=True, slots=True)
class Instant:
    """What an estimate said, and how wrong it was."""

    stamp: int
    health: Health
    off: float
    """[m]"""
    sigma: float
    """Of the position along the hall, by the estimate itself [m]."""


@pytest.fixture(scope="module")
def hedge() -> PreparedMap:
    return HEDGE.prepared()


def driven(
    world: PreparedMap,
    *,
    slip: float,
    within: float = 0.0,
    spinning: tuple[int, int] = SPINNING,
    beside: float = 0.0,
) -> list[Instant]:
    """Drive along the posts; for some time without sight the wheels claim ``slip`` times the way.

    They come to that, and back from it, within some seconds: at once, no tyre could follow them. The way leads so far
    beside the middle of the hall [m].
    """
    start = Pose.planar(0.0, beside, 0.0)
    drive = Drive(HEDGE, start, (22.0, 0.5, 0.0))
    localizer = Localizer(world, MOUNTS)
    localizer.add(Hint(0, start, np.zeros((6, 6))))
    instants = []
    for reading in drive.readings():
        if isinstance(reading, Scan) and SILENT[0] < reading.stamp < SILENT[1]:
            continue
        if isinstance(reading, WheelSpeeds) and spinning[0] < reading.stamp <= spinning[1]:
            inside = min(reading.stamp - spinning[0], spinning[1] - reading.stamp) / SECOND
            times = 1.0 + (slip - 1.0) * (min(1.0, inside / within) if within else 1.0)
            reading = replace(reading, left=times * reading.left, right=times * reading.right)
        estimate = localizer.add(reading)
        if estimate.map_from_base is not None:
            off = estimate.map_from_base.position - drive.pose(estimate.stamp).position
            sigma = float(estimate.covariance[0, 0] ** 0.5)
            far = float(np.hypot(*off[:2]))
            instants.append(Instant(estimate.stamp, estimate.health, far, sigma))
    return instants


@pytest.mark.long
def test_wheels_that_spun_while_the_robot_was_blind_are_found_out_once_it_sees(
    hedge: PreparedMap,
) -> None:
    """When it is right again depends on when a search meets a place that no other metre of the hall equals."""
    right = []
    for beside in BESIDE:
        run = driven(hedge, slip=2.0, within=0.4, beside=beside)
        wrong = [i for i in run if i.off > 0.3]
        assert max(i.off for i in wrong) > 0.8, "the wheels misled it"
        sure = {Health.TRACKING, Health.DEGRADED}
        assert sum(i.health in sure for i in wrong if i.stamp > SPINNING[1] + SECOND) < 5
        right.append(max(i.stamp for i in run if i.off > 0.05) - SILENT[1])
    assert np.median(right) < 5 * SECOND
    assert max(right) < 8 * SECOND


@pytest.mark.long
def test_wheels_that_spin_at_once_are_not_believed_before_something_else_shows_their_speed(
    hedge: PreparedMap,
) -> None:
    """The robot feels no push to that speed; the wheels spin for half a metre.

    What it feels depends on its tilt, which a hall shows by half a degree: in a second and a half 0.12 m, as it says.
    """
    for beside in BESIDE:
        run = driven(hedge, slip=2.0, spinning=(5 * SECOND, 6 * SECOND), beside=beside)
        blind = [i for i in run if SILENT[0] < i.stamp < SILENT[1]]
        assert all(i.off < 2.0 * i.sigma for i in blind)
        assert max(i.off for i in run) < 0.25


def test_robot_that_drove_blind_as_its_wheels_say_is_trusted_as_soon_as_it_sees(
    hedge: PreparedMap,
) -> None:
    run = driven(hedge, slip=1.0)
    assert all(i.off < 0.05 for i in run)
    after = [i for i in run if i.stamp > SILENT[1] + SECOND]
    assert {i.health for i in after} == {Health.TRACKING}
