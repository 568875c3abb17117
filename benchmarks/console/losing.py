"""Losing it at full speed, in all the ways there are: how long until the robot's command is zero.

The trials come in chunks, each with seeds of its own and of a few minutes, so that many can be made one by one.
"""

from __future__ import annotations

import asyncio
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from random import Random

from benchmarks.common.figures import Figure, say, share
from benchmarks.console.browser import chromium, context_of, seen
from benchmarks.console.losses import EXPECTED, KINDS, LIMIT, Loss, trial
from robot_sim import load_world
from teleop.scene_clouds import load_scene_cloud
from tests.teleop.console.hands import GAMEPAD, says
from tests.teleop.console.paced_robot import paced_robot

CHUNKS = 8
TRIALS = 200
"""In all chunks together."""
ALL = "all ways of losing it"

BUSY = "too busy to drive"
"""What the page says instead where the machine gave it no time for half a second."""
STOPPED, DROVE_ON, LONGEST = "stopped in time", "drove on when all was back", "longest until zero"


def losing(chunk: int, trials: int = TRIALS) -> Iterator[Figure]:
    """Yield the figures of one chunk of so many trials in all.

    Args:
        chunk: its number from 0 on.
        trials: in all chunks.
    """
    numbers = range(chunk * trials // CHUNKS, (chunk + 1) * trials // CHUNKS)
    losses = asyncio.run(_losses(numbers))
    for kind in KINDS:
        yield from figures(kind, [loss for loss in losses if loss.kind == kind])
    yield from figures(ALL, losses)


def figures(case: str, losses: Sequence[Loss]) -> Iterator[Figure]:
    """Yield what became of some trials; nothing of none."""
    if not losses:
        return
    n = len(losses)
    late = sum(loss.stopped_after_s > LIMIT + 1e-6 for loss in losses)
    on = sum(loss.drove_on for loss in losses)
    silent = sum(EXPECTED[loss.kind] not in loss.said and BUSY not in loss.said for loss in losses)
    longest = max(loss.stopped_after_s for loss in losses)
    yield share(case, "page", STOPPED, n - late, n, least=100.0)
    yield share(case, "page", DROVE_ON, on, n, most=0.0)
    yield share(case, "page", "said why", n - silent, n, least=100.0)
    yield Figure(case, "page", LONGEST, longest, "s", n, most=round(LIMIT, 3))


async def _losses(numbers: range) -> list[Loss]:
    world, cloud, losses = load_world("office"), load_scene_cloud("office"), list[Loss]()
    with tempfile.TemporaryDirectory() as folder:
        async with (
            paced_robot(world, cloud, Path(folder)) as robot,
            chromium() as browser,
        ):
            robot.place()
            page = await (await context_of(browser, GAMEPAD)).new_page()
            await page.goto(robot.page, wait_until="commit")
            await seen(page)
            await says(page, "Ready")
            for number in numbers:
                kind = KINDS[number % len(KINDS)]
                loss = await trial(page, robot, kind, Random(number))
                good = loss.stopped_after_s <= LIMIT + 1e-6 and not loss.drove_on
                say(
                    f"    {number:3d} {kind:18s} {loss.stopped_after_s:.2f} s{'' if good else f': {loss}'}"
                )
                losses.append(loss)
    return losses
