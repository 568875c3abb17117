"""The page in a headset: first view, script time of a frame, going in and out, and how soon it stands after each loss.

iwer stands in for the headset; software draws both eyes' pictures, so that only the time in script counts here.
"""

from __future__ import annotations

import asyncio
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
from playwright.async_api import Browser, Page

from benchmarks.common.figures import OURS, Figure, say
from benchmarks.console.browser import chromium, context_of, seen
from benchmarks.console.bundles import Modules, bundled, readable_page
from benchmarks.console.headset_losses import KINDS, HeadsetLoss, trial
from benchmarks.console.losses import LIMIT
from benchmarks.console.publisher import publishing
from benchmarks.console.robot import office_map, serving
from benchmarks.wire.shaped_link import shaped_link
from robot_sim import load_world
from teleop.scene_clouds import load_scene_cloud
from tests.teleop.console.headset_hands import CYCLES, POINTS_SHOWN, enter, figures, headset
from tests.teleop.console.paced_robot import paced_robot

RATE = 20e6
"""Of the link, each way [bit/s]."""
VISITS = 5
POINTS = 300_000
"""Of the map, all of them shown."""
BUDGET = 11.0
"""Longest script time of a frame [ms]: that of a headset of 90 frames per second."""
SETTLE, WATCH = 5.0, 20.0
"""Until what is compiled is compiled, and for how long frames are watched [s]."""
COMPILED = 20.0
"""Until all of the frame loop is compiled, where what it allocates is watched [s]."""
FEW = 60_000
"""Points of the map where that is watched."""
OWN_MEMORY = 0.5
"""Most that the page's own code may allocate in a frame [kB], without what it reads of WebXR's poses. Chosen: at 90
frames a second it is a collection of young objects (1 MB) each twenty seconds, which takes less than a millisecond."""
GROUPS = {
    "src/xr/webxr_pose": "numbers of WebXR's poses",
    "src/": OURS,
    "node_modules/three": "three.js",
    "": "iwer and the browser",
}
"""Who allocates, by the beginnings of modules' names; the first that fits counts."""
CYCLES_WANTED = 100
TRIALS = 3
"""Of each loss."""
BACK = 1.0
"""Longest time until the page goes on [s]."""


def xr() -> Iterator[Figure]:
    """Yield all figures of the headset."""
    yield from _first_view()
    yield from _budget()
    yield from _losses()


def _first_view() -> Iterator[Figure]:
    times = asyncio.run(_visits())
    case = f"headset, {RATE / 1e6:.0f} Mbit/s"
    yield Figure(
        case,
        "address opened to view in the headset",
        "median",
        float(np.median(times)),
        "s",
        len(times),
        most=5.0,
    )
    yield Figure(
        case, "address opened to view in the headset", "longest", max(times), "s", len(times)
    )


async def _visits() -> list[float]:
    """Return the times from the address to the robot seen and the headset entered [s]."""
    times = list[float]()
    async with serving() as robot, shaped_link(robot.port, RATE) as link, chromium() as browser:
        for _ in range(VISITS):
            context = await context_of(browser, headset(building=True))
            page = await context.new_page()
            begun = time.monotonic()
            await page.goto(f"http://127.0.0.1:{link.port}/", wait_until="commit")
            await seen(page)
            await enter(page)
            times.append(time.monotonic() - begun)
            await context.close()
    return times


def _budget() -> Iterator[Figure]:
    with tempfile.TemporaryDirectory() as folder:
        office = office_map(Path(folder), POINTS)
        bare, times = asyncio.run(_bare(office)), asyncio.run(_ours(office))
    case = f"headset, {POINTS // 1000}k points shown, 1.1k live at 10 Hz"
    for method, found, goal in (("bare three.js, same points", bare, None), (OURS, times, BUDGET)):
        p50, p95 = np.percentile(found, [50, 95])
        yield Figure(case, method, "time in script, p50", float(p50), "ms", len(found))
        yield Figure(case, method, "p95", float(p95), "ms", len(found), most=goal)
    page = readable_page()
    grown, frames = asyncio.run(_allocated(page))
    made = dict.fromkeys(GROUPS.values(), 0.0)
    for module, size in grown.items():
        made[next(group for name, group in GROUPS.items() if module.startswith(name))] += size
    for group, kilobytes in made.items():
        goal = OWN_MEMORY if group == OURS else None
        yield Figure(
            case, group, "memory allocated by a frame", kilobytes / frames, "kB", frames, most=goal
        )


async def _bare(map_file: Path) -> list[float]:
    """Return the script times of frames of the bare library [ms]."""
    scripts = {"bare": bundled("headset_bare.ts")}
    async with publishing(map_file, scripts=scripts) as address, chromium() as browser:
        page = await (await context_of(browser, headset())).new_page()
        await page.goto(f"{address}bare.html", wait_until="commit")
        await seen(page)
        await page.evaluate("window.enterBare()")
        await asyncio.sleep(SETTLE)
        await page.evaluate("window.bareTimes.length = 0")
        await asyncio.sleep(WATCH)
        times: list[float] = await page.evaluate("window.bareTimes")
        return times


async def _ours(map_file: Path) -> list[float]:
    """Return the script times of the page's frames [ms]."""
    async with publishing(map_file) as address, chromium() as browser:
        page = await _worn_page(browser, address, headset(building=True), POINTS_SHOWN)
        before = int(await page.evaluate("window.worn.count"))
        await asyncio.sleep(WATCH)
        frames = int(await page.evaluate("window.worn.count")) - before
        times: list[float] = (await figures(page) or {})["frameTimes"]
        return times[-frames:]


async def _worn_page(browser: Browser, address: str, *scripts: str) -> Page:
    page = await (await context_of(browser, *scripts)).new_page()
    await page.goto(address, wait_until="commit")
    await seen(page)
    await enter(page)
    await asyncio.sleep(SETTLE)
    return page


async def _allocated(page_folder: Path) -> tuple[Counter[str], int]:
    """Return what each module allocates in all frames [kB], and their number.

    With few points, for these decide nothing here, and the code must have run often enough to be compiled: what is
    interpreted makes an object of each number.
    """
    with tempfile.TemporaryDirectory() as folder:
        async with (
            publishing(office_map(Path(folder), FEW), page_folder) as address,
            chromium() as browser,
        ):
            page = await _worn_page(browser, address, headset())
            await asyncio.sleep(COMPILED)
            devtools = await page.context.new_cdp_session(page)
            await devtools.send(
                "HeapProfiler.startSampling",
                {
                    "samplingInterval": 1024,
                    "includeObjectsCollectedByMajorGC": True,
                    "includeObjectsCollectedByMinorGC": True,
                },
            )
            counted = await page.evaluate("window.worn.count")
            await asyncio.sleep(WATCH)
            profile = (await devtools.send("HeapProfiler.stopSampling"))["profile"]
            frames = int(await page.evaluate("window.worn.count")) - counted
            return in_frames(profile["head"], Modules(page_folder)), max(frames, 1)


def in_frames(node: Mapping[str, Any], modules: Modules, inside: bool = False) -> Counter[str]:
    """Return what each module allocated below iwer's frame loop in a sampled profile [kB]."""
    inside = inside or node["callFrame"]["functionName"].endswith("onDeviceFrame")
    found = Counter[str]({modules.of(node["callFrame"]): node["selfSize"] / 1e3 if inside else 0})
    for child in node["children"]:
        found.update(in_frames(child, modules, inside))
    return found


def _losses() -> Iterator[Figure]:
    losses, cycles, entered = asyncio.run(_lose())
    yield Figure(
        "headset",
        "in and out",
        "entered",
        entered,
        f"of {CYCLES_WANTED}",
        CYCLES_WANTED,
        least=CYCLES_WANTED,
    )
    yield Figure("headset", "in and out", "mean", cycles / CYCLES_WANTED, "s", CYCLES_WANTED)
    for kind in KINDS:
        some = [loss for loss in losses if loss.kind == kind]
        case = f"headset: {kind}"
        yield Figure(
            case,
            "page",
            "longest until zero",
            max(loss.stopped_after_s for loss in some),
            "s",
            len(some),
            most=round(LIMIT, 3),
        )
        yield Figure(
            case, "page", "drove on", sum(loss.drove_on for loss in some), "", len(some), most=0.0
        )
        yield Figure(
            case,
            "page",
            "longest until it goes on",
            max(loss.back_after_s for loss in some),
            "s",
            len(some),
            most=BACK,
        )


async def _lose() -> tuple[list[HeadsetLoss], float, int]:
    """Return the trials, and how long going in and out so often took [s], and how often it went in."""
    losses = list[HeadsetLoss]()
    with tempfile.TemporaryDirectory() as folder:
        async with (
            paced_robot(load_world("office"), load_scene_cloud("office"), Path(folder)) as robot,
            chromium() as browser,
        ):
            robot.place()
            page = await (await context_of(browser, headset())).new_page()
            await page.goto(robot.page, wait_until="commit")
            await page.locator(".driving-status").get_by_text("Ready").wait_for()
            begun = time.monotonic()
            entered = int(await page.evaluate(CYCLES, CYCLES_WANTED))
            cycles = time.monotonic() - begun
            for number in range(TRIALS * len(KINDS)):
                kind = KINDS[number % len(KINDS)]
                loss = await trial(page, robot, kind, Random(number))
                say(
                    f"    {number:3d} {kind:24s} {loss.stopped_after_s:.2f} s, back {loss.back_after_s:.2f} s"
                )
                losses.append(loss)
    return losses, cycles, entered
