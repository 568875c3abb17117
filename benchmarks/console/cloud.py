"""A cloud of a megabyte, from the frame's bytes to buffers: the page's own reader beside roslib with ros3d."""

from __future__ import annotations

import asyncio
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.common.figures import OURS, Figure
from benchmarks.console.browser import PATIENCE, chromium
from benchmarks.console.bundles import HERE, bundled
from benchmarks.console.publisher import cloud_message, offer_scripts, server_of
from teleop.rosbridge import Server

POINTS = 50_000
"""Of 20 bytes each: a megabyte."""
CLOUDS = 60
WARM = 10
"""Clouds until what is compiled is compiled; they are not counted."""
PERIOD = 0.25
"""Between two clouds [s]."""
GOAL = 5.0
"""Longest time from bytes to buffers [ms]."""

PEER = "roslib 1.4 and ros3d 1.1"


def cloud() -> Iterator[Figure]:
    """Yield how long a cloud takes by the page's reader, and by the libraries that others use."""
    with tempfile.TemporaryDirectory() as folder:
        script = (HERE / "cloud_clock.js").read_bytes() + bundled("cloud_ours.ts")
        ours, theirs = asyncio.run(_both(script, _packages(Path(folder))))
    case = "cloud of 1 MB in CBOR"
    for method, found, goal in ((OURS, ours, GOAL), (PEER, theirs, None)):
        whole, reader = (np.array([one[k] for one in found[WARM:]]) for k in ("whole", "reader"))
        n = len(whole)
        yield Figure(
            case, method, "bytes to buffers, p50", float(np.median(whole)), "ms", n, most=goal
        )
        yield Figure(case, method, "p95", float(np.percentile(whole, 95)), "ms", n)
        yield Figure(case, method, "of it after decoding, p50", float(np.median(reader)), "ms", n)


def _packages(folder: Path) -> bytes:
    """Fetch the libraries that others use; return them and their page's script as one."""
    npm = shutil.which("npm")
    if npm is None:
        raise SystemExit("npm is not installed: it fetches ros3d")
    words = ("--no-audit", "--no-fund", "--ignore-scripts", "--loglevel=error")
    subprocess.run(
        [npm, "install", *words, "ros3d@1.1.0"], cwd=folder, check=True, stdout=subprocess.DEVNULL
    )
    modules = folder / "node_modules"
    files = (
        HERE / "cloud_clock.js",
        modules / "roslib" / "build" / "roslib.min.js",
        modules / "ros3d" / "build" / "ros3d.min.js",
        HERE / "cloud_theirs.js",
    )
    return b"\n;\n".join(file.read_bytes() for file in files)


async def _both(ours: bytes, theirs: bytes) -> list[list[dict[str, float]]]:
    """Return the times of both on the same stream, one page after the other [ms]."""
    server = server_of()
    offer_scripts(server, {"ours": ours, "theirs": theirs})
    server.protocol.topics.advertise("/cloud", "sensor_msgs/msg/PointCloud2")
    async with server, chromium() as browser:
        publishing = asyncio.create_task(_publish(server))
        found = list[list[dict[str, float]]]()
        for name in ("ours", "theirs"):
            page_of = await browser.new_page()
            await page_of.goto(f"http://127.0.0.1:{server.port}/{name}.html")
            times: list[dict[str, Any]] = []
            async with asyncio.timeout(PATIENCE):
                while len(times) < CLOUDS + WARM:
                    await asyncio.sleep(1.0)
                    times = await page_of.evaluate("window.times")
            assert times[-1]["points"] == POINTS, f"{name} read {times[-1]['points']} points"
            found.append(times)
            await page_of.close()
        publishing.cancel()
        return found


async def _publish(server: Server) -> None:
    random = np.random.default_rng(0)
    message = cloud_message(server.now, random.uniform(-20.0, 20.0, (POINTS, 3)), random)
    while True:
        server.protocol.topics.publish("/cloud", message, server.now)
        await asyncio.sleep(PERIOD)
