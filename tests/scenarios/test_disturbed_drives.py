"""Drives in which the localiser was wrong while all its other tests passed."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.localization.alarms import LongDrive, watch
from benchmarks.localization.drives import ours
from benchmarks.localization.faults import OUTAGES, SILENCES, carry, farthest, silenced
from benchmarks.localization.small_carries import REACH, shoved
from benchmarks.replay.recordings import map_of, record, world_of

pytestmark = [pytest.mark.slow, pytest.mark.long]


def test_robot_whose_level_scanner_falls_silent_is_not_drawn_along_its_walls() -> None:
    silence = next(s for s in SILENCES if s.name == "horizontal scanner silent for 10 s")
    drive = record(world_of("office"), name="office", seed=71, seconds=OUTAGES[0] + 14.0)
    faulty, spans = silenced(drive, silence)
    (off,) = farthest(ours(faulty, map_of("office")), faulty, spans[:1])
    assert 0.0 < off < 0.15


def test_robot_that_is_carried_along_a_wall_does_not_trust_its_old_place() -> None:
    scene, seed = "building-702-400", 93
    drive = record(world_of(scene), name=scene, seed=seed, seconds=140.0)
    rng = np.random.default_rng(seed)
    recording, moved = [carry(drive, rng, reach=REACH) for _ in range(3)][-1]
    fate = shoved(ours(recording, map_of(scene)), recording, moved)
    assert fate.said < 0.5
    assert fate.trusted < 0.5


def test_robot_that_people_shove_while_they_hide_all_it_sees_is_doubted_within_two_seconds() -> (
    None
):
    seen = watch(LongDrive("office", 1040, alive=True), 184.0)
    assert seen.seconds > 150.0
    assert seen.trusted == 0
