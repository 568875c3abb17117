"""Preview of a hint: it agrees with the verdict, changes nothing, and survives any pose."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st

from localization.maps.prepared_map import PreparedMap
from localization.pipeline.localizer import Localizer
from localization.relocalization.preview import PreviewError, explained_share
from localization.types import Estimate, Hint, Inertial, InvalidReadingError, Pose, Reading, Verdict
from tests.support import bits
from tests.support_rooms import HALL, MOUNTS, Drive

START = Pose.planar(2.6, 1.6, 0.2)
WRONG = START @ Pose.planar(0.4, -0.3, 0.2)
AWAY = START @ Pose.planar(1.5, 0.8, 1.0)
ANY = st.floats(allow_nan=True, allow_infinity=True)


def readings(*, hint: Pose | None, seconds: float = 2.0, speed: float = 0.0) -> list[Reading]:
    drive = Drive(HALL, START, (seconds, speed, 0.0), noise=0.01, seed=2)
    found = list(drive.readings())
    if hint is not None:
        found.insert(25, Hint(found[24].stamp, hint, np.zeros((6, 6))))
    return found


def feed(localizer: Localizer, given: list[Reading]) -> list[Estimate]:
    found = [(reading, localizer.add(reading)) for reading in given]
    return [estimate for reading, estimate in found if isinstance(reading, Inertial)]


def test_preview_of_the_place_that_was_accepted_is_the_share_in_the_verdict(
    hall: PreparedMap,
) -> None:
    localizer = Localizer(hall, MOUNTS)
    estimates = feed(localizer, readings(hint=WRONG))
    verdict = next(e.verdict for e in estimates if e.verdict is not None)
    assert verdict.verdict is Verdict.ACCEPTED
    found = verdict.candidates[0]
    preview = localizer.preview(found.map_from_base)
    assert preview.explained == pytest.approx(found.score, abs=0.02)
    assert preview.present == pytest.approx(preview.explained, abs=0.02)
    assert localizer.preview(AWAY).explained < 0.6 < preview.explained


def test_preview_of_a_robot_that_drives_takes_the_way_since_the_sweep_into_account(
    hall: PreparedMap,
) -> None:
    localizer = Localizer(hall, MOUNTS)
    (*_, last) = feed(localizer, readings(hint=START, seconds=3.0, speed=0.7))
    assert last.map_from_base is not None
    preview = localizer.preview(last.map_from_base)
    assert preview.stamp <= last.stamp
    assert preview.present is not None
    assert preview.explained == pytest.approx(preview.present, abs=0.01)
    assert preview.explained > 0.95


def test_robot_without_a_pose_has_a_preview_and_no_present_share(hall: PreparedMap) -> None:
    localizer = Localizer(hall, MOUNTS)
    with pytest.raises(PreviewError, match="no sweep yet"):
        localizer.preview(START)
    feed(localizer, readings(hint=None, seconds=0.5))
    preview = localizer.preview(START)
    assert preview.present is None
    assert preview.explained > 0.95


def test_previews_change_no_bit_of_any_estimate(hall: PreparedMap) -> None:
    given = readings(hint=WRONG, seconds=1.0, speed=0.4)
    asked, left_alone = Localizer(hall, MOUNTS), Localizer(hall, MOUNTS)
    for k, reading in enumerate(given):
        a, b = asked.add(reading), left_alone.add(reading)
        assert bits(a.map_from_base) == bits(b.map_from_base)
        assert bits(a.covariance) == bits(b.covariance)
        assert (a.health, a.reasons) == (b.health, b.reasons)
        if k > 20 and k % 7 == 0:
            asked.preview(AWAY)


def test_pose_outside_the_map_is_answered_with_the_extent_of_the_map(hall: PreparedMap) -> None:
    sweep = HALL.sweep(START)
    for x, y in ((1e9, 0.0), (0.0, -1e300), (-500.0, 3.0)):
        with pytest.raises(PreviewError, match="lies outside the map, which spans x"):
            explained_share(Pose.planar(x, y, 0.0), sweep, hall, Pose.identity())


def share_or_reason(position: object, quaternion: object, hall: PreparedMap) -> float | str:
    """Return the share that a pose of these numbers explains, or why there is none."""
    try:
        pose = Pose(np.array(position), np.array(quaternion))
        return explained_share(pose, HALL.sweep(START), hall, Pose.identity())
    except (PreviewError, InvalidReadingError) as error:
        return str(error)


@given(position=st.tuples(ANY, ANY, ANY), quaternion=st.tuples(ANY, ANY, ANY, ANY))
def test_share_of_any_pose_is_a_share_or_an_error_in_words(
    hall: PreparedMap,
    position: tuple[float, float, float],
    quaternion: tuple[float, float, float, float],
) -> None:
    found = share_or_reason(position, quaternion, hall)
    assert found if isinstance(found, str) else 0.0 <= found <= 1.0


@given(
    position=st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 1.0), ANY.filter(np.isfinite)),
    quaternion=st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(lambda q: bool(np.dot(q, q) > 1e-6)),
)
def test_any_pose_near_the_map_has_a_share(
    hall: PreparedMap,
    position: tuple[float, float, float],
    quaternion: tuple[float, float, float, float],
) -> None:
    low, high = hall.cloud.bounds
    place = low[:2] - 1.0 + (high - low + 2.0)[:2] * position[:2]
    found = share_or_reason([*place, position[2]], quaternion, hall)
    assert isinstance(found, float)
    assert 0.0 <= found <= 1.0
