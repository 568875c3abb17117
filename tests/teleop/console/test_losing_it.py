"""Losing one's grip on the robot at full speed, in every way that the page knows: it stops, and stays where it is."""

from __future__ import annotations

from random import Random

import pytest

from benchmarks.console.losses import EXPECTED, KINDS, LIMIT, trial
from tests.teleop.console.conftest import Meets
from tests.teleop.console.hands import GAMEPAD, says
from tests.teleop.support import in_a_loop

pytestmark = [pytest.mark.process, pytest.mark.slow]

BUSY = "too busy to drive"
"""What the page says instead where the machine gave it no time for half a second; the robot stops all the same."""


@pytest.mark.long
@pytest.mark.parametrize("kinds", [KINDS[:5], KINDS[5:]], ids=["hands", "machines"])
@in_a_loop
async def test_robot_stops_in_time_and_does_not_drive_on(
    kinds: tuple[str, ...], meets: Meets
) -> None:
    chance = Random(14)
    async with meets(placed=False, scripts=[GAMEPAD]) as (robot, page, visit):
        await says(page, "Ready")
        for kind in (*kinds, chance.choice(kinds))[:5]:
            loss = await trial(page, robot, kind, chance)
            assert loss.stopped_after_s <= LIMIT + 1e-6, loss
            assert not loss.drove_on, loss
            assert EXPECTED[kind] in loss.said or BUSY in loss.said, loss
        assert visit.violations == []
