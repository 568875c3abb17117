"""A hint that explains much of what is seen, but leaves room for a better place, is checked before it is trusted."""

from __future__ import annotations

import numpy as np
import pytest

from localization.pipeline.localizer import Localizer
from localization.types import SECOND, Estimate, Health, Hint, Inertial, Pose, Verdict
from tests.localization.pipeline.wheel_log import block, upright
from tests.support_rooms import MOUNTS, Drive, Face, Place, apart, box

pytestmark = pytest.mark.slow


def room(x: float) -> list[Face]:
    return upright(box((x, 0.0, -1.0), (x + 6.0, 5.0, 2.5), inside=True))


TWO_ROOMS = Place(
    [
        *room(0.0),
        *block((0.0, 0.0), (1.0, 0.8)),
        *room(8.0),
        *block((8.0, 0.0), (9.0, 0.8)),
        *block((11.2, 4.0), (13.0, 5.0)),
        *block((13.0, 0.0), (14.0, 1.2)),
    ]
)
"""Two rooms with a cupboard each; the second has two more."""
TRUE, WRONG = Pose.planar(10.0, 2.0, 0.2), Pose.planar(2.0, 2.0, 0.2)


def driven(hint: Pose, speed: float) -> list[Estimate]:
    """Stand or drive about in the second room after a hint; the estimate of each reading."""
    localizer = Localizer(TWO_ROOMS.prepared(), MOUNTS)
    drive = Drive(TWO_ROOMS, TRUE, (1.0, 0.0, 0.0), (12.0, speed, 0.9 * speed))
    readings = drive.readings()
    localizer.add(Hint(0, hint, np.diag([0.04, 0.04, 0.0, 0.0, 0.0, 0.01])))
    return [localizer.add(reading) for reading in readings]


def error(estimate: Estimate) -> float:
    assert estimate.map_from_base is not None
    return abs(float(estimate.map_from_base.position[0]) - float(TRUE.position[0]))


def test_wrong_hint_into_a_room_much_like_the_right_one_is_suspect_and_found_out_by_driving() -> (
    None
):
    estimates = driven(WRONG, 0.4)
    placed = [e for e in estimates if e.map_from_base is not None]
    wrong = [e for e in placed if error(e) > 4.0]
    assert wrong, "the wrong room explains enough to be accepted"
    assert {e.health for e in wrong} == {Health.SUSPECT}
    assert any("other places may explain" in reason for reason in wrong[-1].reasons)
    assert error(placed[-1]) < 2.0, "it finds the other room, in which it drives about"
    assert placed[-1].health is Health.TRACKING


def test_right_hint_is_trusted_at_once() -> None:
    placed = [e for e in driven(TRUE, 0.0) if e.map_from_base is not None]
    assert {e.health for e in placed[5:]} == {Health.TRACKING}


def test_ambiguous_hint_to_a_pose_that_explains_less_has_its_places_compared_by_driving() -> None:
    """The true room looks alike from both ends, with a cupboard at each; the wrong one has none."""
    cupboards = [*block((8.0, 0.0), (9.6, 1.3)), *block((12.4, 3.7), (14.0, 5.0))]
    plain = Place([*room(0.0), *room(8.0), *cupboards])
    middle = Pose.planar(11.0, 2.5, 1.8)
    localizer = Localizer(plain.prepared(), MOUNTS)
    drive = Drive(plain, TRUE, (3.0, 0.0, 0.0), (3.0, 0.4, 0.3))
    hints = {
        SECOND: Hint(SECOND, WRONG, np.diag([1e-4, 1e-4, 0.0, 0.0, 0.0, 1e-4])),
        2 * SECOND: Hint(2 * SECOND, middle, np.diag([1.0, 1.0, 0.0, 0.0, 0.0, 1.0])),
    }
    verdicts, estimates = [], []
    for reading in drive.readings():
        estimate = localizer.add(reading)
        if isinstance(reading, Inertial):
            verdicts += [estimate.verdict.verdict] if estimate.verdict else []
            estimates += [estimate] if len(verdicts) == 2 else []
            if reading.stamp in hints:
                localizer.add(hints[reading.stamp])
    assert verdicts == [Verdict.ACCEPTED, Verdict.AMBIGUOUS]
    assert len(estimates[1].hypotheses) == 3
    assert {e.health for e in estimates[1:]} <= {Health.SUSPECT, Health.LOST, Health.RELOCALISING}
    assert not any(apart(c.map_from_base, WRONG)[0] < 4.0 for c in estimates[-1].hypotheses)
