"""The page in a headset: it stands whatever happens, comes back by itself, and is not there without a headset."""

from __future__ import annotations

import asyncio
import math
from contextlib import AsyncExitStack
from dataclasses import replace
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
from playwright.async_api import Page

from benchmarks.console.headset_losses import EXPECTED, KINDS, trial
from benchmarks.console.losses import LIMIT
from localization.types import Pose
from robot_sim import World
from teleop.console.lan.certificate import ensure_certificate
from teleop.robot.guard.verdict import GuardState
from teleop.robot.serving.serve_config import ServeConfig
from tests.teleop.console.arm_hands import office_with_parcel
from tests.teleop.console.conftest import Meets, Pages, Served
from tests.teleop.console.hands import hold_until, says, seen, until
from tests.teleop.console.headset_hands import (
    CYCLES,
    FRAME,
    VIVE,
    aim,
    drives,
    enter,
    figures,
    grip,
    headset,
    inside,
    pinch_key,
    tap,
    worn,
)
from tests.teleop.console.paced_robot import PacedRobot
from tests.teleop.console.test_arm_lets_go import rates
from tests.teleop.console.test_losing_it import BUSY
from tests.teleop.console.test_restart import front
from tests.teleop.support import PATIENCE, in_a_loop

pytestmark = [
    pytest.mark.process,
    pytest.mark.slow,
    pytest.mark.usefixtures("page_tools"),
]

SIZE = {"width": 1120, "height": 600}
SLOW = EXPECTED["no frames"]
"""What the page says instead where a loaded machine draws fewer than four pictures a second."""


@pytest.mark.long
@pytest.mark.parametrize("kinds", [KINDS[:5], KINDS[5:]], ids=["person", "hands and links"])
@in_a_loop
async def test_robot_stands_whatever_happens_to_the_headset_and_drives_again_without_reload(
    kinds: tuple[str, ...], meets: Meets
) -> None:
    chance = Random(28)
    async with meets(placed=False, scripts=[headset()]) as (robot, page, visit):
        await says(page, "Ready")
        for kind in kinds:
            loss = await trial(page, robot, kind, chance)
            assert loss.stopped_after_s <= LIMIT + 1e-6, loss
            assert not loss.drove_on, loss
            assert any(words in loss.said for words in (EXPECTED[kind], BUSY, SLOW)), loss
        assert visit.violations == []
        assert [e for e in visit.errors if "ERR_" not in e] == []


@pytest.mark.long
@in_a_loop
async def test_hundred_times_in_and_out_leave_a_page_that_drives(meets: Meets) -> None:
    async with meets(scripts=[headset()]) as (robot, page, visit):
        entered = await page.evaluate(CYCLES, 100)
        assert entered == 100
        assert await figures(page) is None
        await enter(page)
        await hold_until(page, grip(page), lambda: robot.ticks[-1].moves, "that it drives")
        assert visit.errors == []


@pytest.mark.long
@in_a_loop
async def test_way_ahead_ends_in_a_headset_where_the_guard_stops_the_robot(
    meets: Meets, office: World
) -> None:
    """The wall is 1.3 m away; uncut, three seconds at full speed lead twice as far."""
    always = "localStorage.setItem('farsteer.pathAhead', JSON.stringify('always'));"
    before_wall = replace(office, spawn=Pose.planar(20.9, 4.6, math.pi))
    async with meets(before_wall, scripts=[always, headset()]) as (robot, page, _visit):
        await enter(page)

        def driven() -> float:
            return float(20.9 - robot.simulation.truth().map_from_base.position[0])

        ends: list[float] = []

        async def watch() -> None:
            while True:
                way = await page.evaluate("farsteerFigures().way ?? null")
                if way is not None and way["cut"]:
                    ends.append(driven() + way["length"])
                await asyncio.sleep(0.02)

        states: list[GuardState] = []
        robot.service.stepped.observers += (lambda tick: states.append(tick.drive.guard.state),)

        def stopped() -> bool:
            return robot.speed < 0.01 and states[-1] is GuardState.STOPPED

        hold, watching = grip(page), asyncio.create_task(watch())
        await hold_until(page, hold, stopped, "that the guard stops it")
        watching.cancel()
        await hold(False)
        assert len(ends) > 3
        assert np.median(ends) == pytest.approx(driven(), abs=0.15)


@in_a_loop
async def test_page_without_a_headset_fetches_nothing_of_it(meets: Meets) -> None:
    async with meets() as (_robot, page, visit):
        assert await page.get_by_role("button", name="Enter VR").count() == 0
        assert [path for path in visit.paths if "/parts/xr-" in path] == []


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "controllers"),
    [("oculusQuest1", "undefined"), ("metaQuestPro", "undefined"), ("metaQuest2", VIVE)],
    ids=["oculusQuest1", "metaQuestPro", "touch pads"],
)
@in_a_loop
async def test_controllers_of_other_headsets_drive_and_nothing_is_asked_of_others(
    name: str, controllers: str, meets: Meets
) -> None:
    async with meets(scripts=[headset(name, controllers=controllers)]) as (robot, page, visit):
        await enter(page)
        hold = grip(page)
        await hold_until(page, hold, lambda: robot.ticks[-1].forward > 0.2, "that it drives")
        await hold(False)
        turn = grip(page, 0.0, 0.9)
        await hold_until(page, turn, lambda: robot.ticks[-1].turn > 0.2, "that it turns left")
        await turn(False)
        assert {host.partition(":")[0] for host in visit.hosts} == {"127.0.0.1"}


@pytest.mark.long
@in_a_loop
async def test_controller_of_which_nothing_is_known_drives_nothing_and_is_named(
    meets: Meets,
) -> None:
    async with meets(scripts=[headset()]) as (robot, page, _visit):
        await enter(page)
        await worn(page, "model", "right", ["acme-wand"], "")
        await inside(page, lambda it: "“acme-wand”" in " ".join(it["words"]))
        hold = grip(page)
        await hold(True)
        await asyncio.sleep(1.0)
        assert not any(tick.moves for tick in robot.ticks)
        await hold(False)
        # The browser maps no buttons, but names a model whose buttons are known.
        await worn(
            page, "model", "right", ["acme-wand-2", "generic-trigger-squeeze-thumbstick"], ""
        )
        await inside(page, lambda it: "“acme-wand”" not in " ".join(it["words"]))
        await hold_until(page, hold, lambda: robot.ticks[-1].moves, "that a known one drives")
        await hold(False)


@pytest.mark.long
@in_a_loop
async def test_arm_stands_when_its_controller_is_gone_and_the_hand_feels_limits_and_refusals(
    meets: Meets,
) -> None:
    async with meets(office_with_parcel(0.21, 0.03), scripts=[headset()]) as (robot, page, _visit):
        await page.locator(".arm-tip").wait_for(state="attached")
        await enter(page)
        await _lead(page, robot)
        await page.evaluate("window.worn.device.controllers.left.connected = false; 0")
        await until(lambda: rates(robot) < 0.01, "that the arm stands without its controller")
        await page.evaluate("window.worn.device.controllers.left.connected = true; 0")
        for step in range(20):
            await worn(page, "place", "left", -0.25, 1.5 + 0.005 * step, -0.4)
            await asyncio.sleep(0.05)
        assert rates(robot) < 0.01, "the arm follows a grip that was not let go"
        await worn(page, "button", "left", "squeeze", 0)
        await asyncio.sleep(2 * FRAME)

        # As far as the arm does not reach, at a pace of hands.
        felt = 0.0
        async with asyncio.timeout(PATIENCE):
            while felt == 0.0:
                await _lead(page, robot)
                for step in range(60):
                    await worn(page, "place", "left", -0.25, 1.5 + 0.02 * step, -0.4)
                    await asyncio.sleep(0.05)
                felt = max((one["strength"] for one in await _pulses(page)), default=0.0)
                await worn(page, "button", "left", "squeeze", 0)
        assert felt in (0.25, 0.6, 1.0), (
            "the robot's own strengths of limits, refusals and contacts"
        )
        await tap(page, "right", "b-button")
        await inside(page, lambda it: any("E-stop" in words for words in it["words"]))
        await worn(page, "button", "left", "squeeze", 1)
        async with asyncio.timeout(PATIENCE):
            while 0.8 not in [one["strength"] for one in await _pulses(page)]:  # noqa: ASYNC110
                await asyncio.sleep(0.05)


async def _pulses(page: Page) -> list[dict[str, Any]]:
    """Return what the left controller was let feel."""
    pulses: list[dict[str, Any]] = await page.evaluate("window.worn.pulses")
    return [one for one in pulses if one["hand"] == "left"]


async def _lead(page: Page, robot: PacedRobot) -> None:
    """Close the clutch and lead the arm upwards until it moves, again where a loaded machine let go."""
    async with asyncio.timeout(PATIENCE):
        while True:
            await worn(page, "button", "left", "squeeze", 0)
            await worn(page, "place", "left", -0.25, 1.5, -0.4)
            await asyncio.sleep(4 * FRAME)
            await worn(page, "button", "left", "squeeze", 1)
            await asyncio.sleep(4 * FRAME)
            for step in range(20):
                await worn(page, "place", "left", -0.25, 1.5 + 0.005 * step, -0.4)
                await asyncio.sleep(0.05)
                if rates(robot) > 0.05:
                    return


@pytest.mark.long
@in_a_loop
async def test_socket_that_drops_on_entering_comes_back_within_the_session(meets: Meets) -> None:
    async with meets(scripts=[headset()]) as (robot, page, _visit):
        await page.evaluate(
            "navigator.xr.requestSession = ((request) => async (...given) => "
            "{ const it = await request.apply(navigator.xr, given); window.begun = true; return it; })(navigator.xr.requestSession); 0"
        )
        await page.get_by_role("button", name="Enter VR").focus()
        await page.keyboard.press("Enter")
        while not await page.evaluate("window.begun === true"):  # noqa: ASYNC110 - a page has no event of ours
            await asyncio.sleep(0.01)
        robot.proxy.drop()
        await inside(page)
        assert not any(tick.moves for tick in robot.ticks)
        await hold_until(page, grip(page), lambda: robot.ticks[-1].moves, "that it drives")
        await worn(page, "button", "right", "squeeze", 0)


@pytest.mark.long
@in_a_loop
async def test_certificate_that_is_renewed_meanwhile_ends_the_drive_and_not_the_session(
    page_of: Pages, served: Served, tmp_path: Path
) -> None:
    async with AsyncExitStack() as last, front() as door:
        robot = await last.enter_async_context(served(_encrypted(tmp_path, "old"), lockstep=False))
        door.target = robot.port
        door.whole.set()
        address = f"https://127.0.0.1:{door.port}/"
        async with page_of(
            address, scripts=[headset()], viewport=SIZE, ignore_https_errors=True
        ) as visit:
            page = visit.page
            await seen(page)
            await enter(page)
            hold = grip(page)
            await drives(page, hold)
            async with served(_encrypted(tmp_path, "new"), lockstep=False) as renewed:
                door.target = renewed.port
                door.drop()
                await last.aclose()
                await says(page, "Stopped:")
                await inside(page)
                # In the drawer of a small window.
                nobody = page.get_by_text("Nobody drives", exact=True)
                await nobody.first.wait_for(state="attached")
                await hold(False)
                await drives(page, hold)
                await hold(False)


def _encrypted(folder: Path, name: str) -> ServeConfig:
    """Return settings with a certificate of their own."""
    certificate, key = folder / f"{name}.crt", folder / f"{name}.key"
    ensure_certificate(certificate, key, ["127.0.0.1"])
    return ServeConfig(tls_cert=certificate, tls_key=key)


@pytest.mark.long
@in_a_loop
async def test_empty_hand_drives_steps_by_pinching_keys_and_stops_with_the_headset(
    meets: Meets,
) -> None:
    async with meets(scripts=[headset()]) as (robot, page, _visit):
        await enter(page)
        await worn(page, "hands")
        await asyncio.sleep(2 * FRAME)
        await pinch_key(page, "+ m")
        await inside(page, lambda it: "Steps of 1 m and 15°" in it["words"])
        await pinch_key(page, "↑ ahead")
        await until(lambda: robot.speed > 0.1, "that the step is driven")
        await page.evaluate("window.worn.device.updateVisibilityState('hidden')")
        await until(lambda: robot.speed < 0.01, "that the step ends with the headset")
        gone = robot.simulation.truth().map_from_base.position[0]
        assert abs(gone - 24.2) < 0.9, "the whole step was driven all the same"


@in_a_loop
async def test_building_stands_on_the_table_that_a_person_looks_at_without_its_ground(
    meets: Meets,
) -> None:
    async with meets(scripts=[headset(), TABLE]) as (_robot, page, _visit):
        await enter(page, "AR")
        await inside(page, lambda it: it["stand"] == "table")
        await aim(page, "right", {"x": 0.25, "y": 1.5, "z": 5.0})
        await tap(page, "right", "trigger")
        middle = await page.evaluate(MIDDLE)
        assert middle == pytest.approx([1.0, 0.6, -1.5], abs=0.01)


TABLE = """
worn.device.installSEM(class {
  environmentCanvas = document.createElement('canvas');
  trackedPlanes = new Set();
  trackedMeshes = new Set();
  render() {}
  // A table at which the person looks: a pose in the room, column by column.
  computeHitTestResults() { return [[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 0.6, -1.5, 1]]; }
});
"""
MIDDLE = """() => {
  const { toRoom, plan } = farsteerFigures().headset;
  const at = toRoom(plan.x, plan.y, plan.z);
  return [at.x, at.y, at.z];
}"""
