"""MJPEG and WebRTC side by side: latency in Chromium by a time code in the picture, bytes, and processor time.

Both show the same pictures, 640 x 480 at 15 Hz, in turns of one run, on the pages ``/stream_viewer`` and
``/webrtc_viewer``, and MJPEG also in a program that decodes each part when it is there. Latency is the time from the
complete picture in the robot's memory to the first screen refresh of the browser in which the page has it, or to the
program's decoded picture; both clocks are the machine's, and a refresh adds up to 17 ms.
``python -m benchmarks webrtc 20`` measures each for so many seconds in each of two turns (15 by default).
"""

from __future__ import annotations

import asyncio
import io
import os
import re
import sys
import time
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import numpy as np
from PIL import Image
from playwright.async_api import Browser, Page

from benchmarks.camera.video_source import BAR, BITS, ROWS, read_code
from benchmarks.common.figures import Figure
from benchmarks.common.sheet import Sheet
from benchmarks.console.browser import chromium

TAKES_WORDS = True
TURNS = 2
QUALITY = 30
"""Quality of the JPEGs, as headsets ask for it."""
PAGES = {
    "MJPEG": f"/stream_viewer?topic=/camera/rgb/image_rect_color&quality={QUALITY}",
    "WebRTC": "/webrtc_viewer",
}
PROGRAM = "MJPEG, read by a program"
SETTLING = 5.0
"""Time before each measurement, in which WebRTC finds its rate [s]."""

READ = f"""seconds => new Promise(done => {{
  const shown = document.querySelector("img, video");
  const width = {BITS * BAR}, row = {ROWS // 2}, found = [];
  const canvas = Object.assign(document.createElement("canvas"), {{ width, height: {ROWS} }});
  const strip = canvas.getContext("2d", {{ willReadFrequently: true }});
  const end = Date.now() + 1000 * seconds;
  let last = -1;
  const look = () => {{
    const now = Date.now();
    strip.drawImage(shown, 0, 0, width, {ROWS}, 0, 0, width, {ROWS});
    const pixels = strip.getImageData(0, row, width, 1).data;
    let word = 0;
    for (let bit = 0; bit < {BITS}; bit++) {{
      word = word * 2 + (pixels[4 * (bit * {BAR} + {BAR // 2}) + 1] > 127 ? 1 : 0);
    }}
    const stamp = Math.floor(word / 256), check = word % 256;
    if (((stamp ^ (stamp >> 8) ^ (stamp >> 16)) & 255) === check && stamp !== last) {{
      last = stamp;
      found.push((now - stamp) & 0xffffff);
    }}
    now < end ? requestAnimationFrame(look) : done(found);
  }};
  look();
}})"""

RECEIVED = """async () => {
  if (!document.querySelector("video")) return -1;
  let bytes = 0;
  for (const each of (await connection.getStats()).values()) {
    if (each.type === "inbound-rtp") bytes += each.bytesReceived + each.headerBytesReceived;
  }
  return bytes;
}"""


class Taken:
    """What was measured of one way."""

    def __init__(self) -> None:
        self.latencies: list[float] = []
        self.seconds = self.bytes = 0.0
        self.processor = {"robot": 0.0, "viewer": 0.0}


def main(words: list[str] | None = None, out: Path | None = None) -> None:
    """Print latencies, rates and processor time of both, and keep them."""
    begun = time.process_time()
    taken = asyncio.run(_measure(float(words[0]) if words else 15.0))
    figures = [figure for name, each in taken.items() for figure in _figures(name, each)]
    for figure in figures:
        print(f"{figure.method:<26}{figure.quantity:<30} {figure.text}", flush=True)
    Sheet(out).put("chromium", figures, seconds=time.process_time() - begun)


def _figures(name: str, taken: Taken) -> list[Figure]:
    latencies, count = np.array(taken.latencies), len(taken.latencies)
    p50, p95 = np.quantile(latencies, (0.5, 0.95))
    rows = [
        ("latency p50", float(p50), "ms"),
        ("latency p95", float(p95), "ms"),
        ("longest latency", float(latencies.max()), "ms"),
        ("pictures/s", count / taken.seconds, ""),
        ("received", taken.bytes * 8e-3 / taken.seconds, "kbit/s"),
    ]
    rows += [
        (f"processor time of the {who}", 100.0 * used / taken.seconds, "%")
        for who, used in taken.processor.items()
    ]
    return [Figure("640 x 480, 15 Hz", name, *row, n=count) for row in rows]


async def _measure(duration: float) -> dict[str, Taken]:
    taken = {name: Taken() for name in (*PAGES, PROGRAM)}
    async with _source() as (port, pid), chromium() as browser:
        for _ in range(TURNS):
            for name, path in PAGES.items():
                await _turn(browser, port, path, pid, taken[name], duration)
            await _program_turn(port, pid, taken[PROGRAM], duration)
    return taken


async def _turn(
    browser: Browser, port: int, path: str, pid: int, taken: Taken, duration: float
) -> None:
    page = await browser.new_page(viewport={"width": 700, "height": 600})
    page.set_default_timeout(60_000)
    try:
        await page.goto(f"http://127.0.0.1:{port}{path}", wait_until="commit")
        await asyncio.sleep(SETTLING)
        before, at = await _counters(page, port, pid), time.monotonic()
        taken.latencies += await page.evaluate(READ, duration)
        after = await _counters(page, port, pid)
        taken.seconds += time.monotonic() - at
        taken.bytes += after["bytes"] - before["bytes"]
        for who in taken.processor:
            taken.processor[who] += after[who] - before[who]
    finally:
        await page.close()


async def _program_turn(port: int, pid: int, taken: Taken, duration: float) -> None:
    reader, writer = await asyncio.open_connection("127.0.0.1", port, limit=1_000_000)
    path = PAGES["MJPEG"].replace("stream_viewer", "stream")
    writer.write(f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n".encode())
    begun = time.monotonic()
    before: float | None = None
    try:
        while (now := time.monotonic()) < begun + SETTLING + duration:
            if before is None and now > begun + SETTLING:
                before, own = _processor_times(pid)["robot"], time.process_time()
            head = await reader.readuntil(b"\r\n\r\n")
            if (length := re.search(rb"Content-Length: (\d+)", head)) is None:
                continue
            data = await reader.readexactly(int(length[1]))
            stamp = read_code(np.asarray(Image.open(io.BytesIO(data)).convert("L")))
            if before is not None and stamp is not None:
                taken.latencies.append(float(time.time_ns() // 1_000_000 - stamp & 0xFFFFFF))
                taken.bytes += len(data)
        assert before is not None
        taken.seconds += duration
        taken.processor["robot"] += _processor_times(pid)["robot"] - before
        taken.processor["viewer"] += time.process_time() - own
    finally:
        writer.close()


async def _counters(page: Page, port: int, pid: int) -> Mapping[str, float]:
    received: Any = await page.evaluate(RECEIVED)
    if received < 0:
        with await asyncio.to_thread(urlopen, f"http://127.0.0.1:{port}/jpeg_bytes") as answer:
            received = int(answer.read())
    return {"bytes": received, **_processor_times(pid)}


def _processor_times(pid: int) -> dict[str, float]:
    """Return the processor time of the source, and of all others that this process has started [s]."""
    parents, used = dict[int, int](), dict[int, int]()
    for folder in Path("/proc").iterdir():
        if folder.name.isdigit():
            try:
                stat = (folder / "stat").read_text().rpartition(")")[2].split()
            except OSError:
                continue
            parents[int(folder.name)] = int(stat[1])
            used[int(folder.name)] = int(stat[11]) + int(stat[12])
    browser = 0
    for each in used:
        above = each
        while above in parents and above not in (os.getpid(), pid):
            above = parents[above]
        browser += used[each] if above == os.getpid() != each else 0
    ticks = os.sysconf("SC_CLK_TCK")
    return {"robot": used[pid] / ticks, "viewer": browser / ticks}


@asynccontextmanager
async def _source() -> AsyncIterator[tuple[int, int]]:
    """Serve pictures in a process of its own; yield its port and process."""
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "benchmarks.camera.video_source"), stdout=asyncio.subprocess.PIPE
    )
    try:
        assert process.stdout is not None
        yield int(await process.stdout.readline()), process.pid
    finally:
        process.terminate()
        await process.communicate()
