"""Video of a served robot: latency at a viewer, and ten viewers of which one does not read.

A robot with the Kinect-like camera stands in the office. Latency is the time from the tick whose state a picture
shows to the picture's last byte at a viewer. When that tick was is known from ``/clock``: the smallest difference
between arrival and stamp of its messages within a second, so that the latency is too short by what the quickest of
them took, about a millisecond. ``python -m benchmarks video 60`` measures for so many seconds (20 by default).
"""

from __future__ import annotations

import asyncio
import json
import os
import re
import time
from collections import deque
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from websockets.asyncio.client import connect

from benchmarks.wire.served_robot import served_robot

TAKES_WORDS = True

STREAM = "/stream?topic=/camera/rgb/image_rect_color&type=mjpeg&quality=30"
"""As a headset asks for it."""
GOAL = 0.100
"""Latency that 95 % of the pictures may have [s]."""
VIEWERS = 10
_WINDOW = 50
"""Messages of ``/clock`` in a second."""


def main(words: list[str] | None = None) -> None:
    """Print latencies, pictures and processor time."""
    asyncio.run(_measure(float(words[0]) if words else 20.0))


@dataclass
class Clock:
    """The time of a robot by the messages of its clock."""

    differences: deque[float] = field(default_factory=lambda: deque(maxlen=_WINDOW))

    async def listen(self, url: str) -> None:
        async with connect(url, compression=None) as client:
            await client.send(json.dumps({"op": "subscribe", "topic": "/clock"}))
            async for frame in client:
                arrived = time.monotonic()
                stamp = json.loads(frame)["msg"]["clock"]
                self.differences.append(arrived - stamp["sec"] - stamp["nanosec"] / 1e9)

    def age(self, stamp: float) -> float:
        """Return how long ago a stamp was [s]."""
        return time.monotonic() - stamp - min(self.differences)


@dataclass
class Viewer:
    """Reads a stream, or begins to and stops."""

    port: int
    latencies: list[float] = field(default_factory=list)
    bytes: int = 0

    async def watch(self, clock: Clock | None) -> None:
        reader, writer = await asyncio.open_connection("127.0.0.1", self.port, limit=1_000_000)
        writer.write(f"GET {STREAM} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n".encode())
        try:
            while True:
                head = await reader.readuntil(b"\r\n\r\n")
                if (length := re.search(rb"Content-Length: (\d+)", head)) is None:
                    continue
                size = int(length[1])
                await reader.readexactly(size)
                self.bytes += size
                stamp = re.search(rb"X-Timestamp: ([\d.]+)", head)
                assert stamp is not None
                if clock is not None and clock.differences:
                    self.latencies.append(clock.age(float(stamp[1])))
        finally:
            writer.close()


async def _measure(duration: float) -> None:
    async with served_robot("--scene", "office", "--camera", "kinect") as (url, pid):
        port = int(url.rpartition(":")[2])
        clock = Clock()
        listening = asyncio.create_task(clock.listen(url))
        for count in (1, VIEWERS):
            await _part(port, pid, clock, count, duration)
        listening.cancel()


async def _part(port: int, pid: int, clock: Clock, count: int, duration: float) -> None:
    """Measure with so many viewers; with more than one, the last does not read."""
    viewers = [Viewer(port) for _ in range(count if count == 1 else count - 1)]
    tasks = [asyncio.create_task(viewer.watch(clock)) for viewer in viewers]
    stalled = None
    if count > 1:
        _, stalled = await asyncio.open_connection("127.0.0.1", port, limit=4096)
        stalled.write(f"GET {STREAM} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n".encode())
    await asyncio.sleep(2.0)
    for viewer in viewers:
        viewer.latencies.clear()
    before, begun = shares(pid), time.monotonic()
    await asyncio.sleep(duration)
    elapsed = time.monotonic() - begun
    after = shares(pid)
    for task in tasks:
        task.cancel()
    if stalled is not None:
        stalled.close()
    await asyncio.sleep(0.5)
    latencies = np.array([latency for viewer in viewers for latency in viewer.latencies])
    rates = [len(viewer.latencies) / elapsed for viewer in viewers]
    p50, p95, worst = np.quantile(latencies, (0.5, 0.95, 1.0)) * 1e3
    verdict = "" if count > 1 else ", goal met" if p95 <= GOAL * 1e3 else ", GOAL MISSED"
    title = "one viewer" if count == 1 else f"{count} viewers, one stalled"
    print(
        f"{title}: latency p50 {p50:.1f} ms, p95 {p95:.1f} ms{verdict}, longest {worst:.0f} ms;"
        f" {min(rates):.1f} to {max(rates):.1f} pictures/s each; processor time:"
        f" {', '.join(f'{name} {100 * (after[name] - before[name]) / elapsed:.1f} %' for name in after)}",
        flush=True,
    )


def shares(pid: int) -> dict[str, float]:
    """Return the processor time of a robot's processes so far [s]."""
    ticks = os.sysconf("SC_CLK_TCK")
    found = {}
    for folder in Path("/proc").iterdir():
        if not folder.name.isdigit():
            continue
        try:
            stat = (folder / "stat").read_text().rpartition(")")[2].split()
            line = (folder / "cmdline").read_text()
        except OSError:
            continue
        if int(folder.name) == pid:
            name = "control"
        elif int(stat[1]) == pid:
            module = re.search(r"(\w+)_process", line)
            name = module[1] if module else folder.name
        else:
            continue
        found[name] = (int(stat[11]) + int(stat[12])) / ticks
    return dict(sorted(found.items()))
