"""Robots for the console page: ``farsteer serve`` as people start it, with maps as large as one likes.

``python -m benchmarks.console.robot FILE serve ...`` runs the command and writes a line to the file whenever the wheels'
command begins or ceases to move: Unix time at the end of the tick [ns] and 1 or 0.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import re
import signal
import sys
import time
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from localization.maps.cloud import Cloud
from localization.maps.map_files import save_cloud
from teleop.scene_clouds import load_scene_cloud

SCENE = "office"
JITTER = 0.005
"""Noise of the points that fill a map up, one sigma along each axis [m]."""


@dataclass(frozen=True, slots=True)
class Served:
    """A robot that is served in processes of its own."""

    port: int
    edges_file: Path | None = None

    @property
    def page(self) -> str:
        """Address of its page."""
        return f"http://127.0.0.1:{self.port}/"

    def edges(self) -> list[tuple[float, bool]]:
        """Return when the wheels' command began and ceased to move [s, Unix time]."""
        assert self.edges_file is not None
        return read_edges(self.edges_file.read_text(encoding="utf-8"))


def read_edges(text: str) -> list[tuple[float, bool]]:
    """Return the times of a file of edges [s]; a line that is still being written does not count."""
    whole = text[: text.rfind("\n") + 1].splitlines()
    return [(int(at) / 1e9, moving == "1") for at, moving in map(str.split, whole)]


@asynccontextmanager
async def serving(*options: str, edges: Path | None = None) -> AsyncIterator[Served]:
    """Serve a robot in the office until the end of the block.

    Args:
        options: further options of ``farsteer serve``.
        edges: file for when the wheels' command begins and ceases to move.
    """
    program = ["teleop"] if edges is None else ["benchmarks.console.robot", str(edges)]
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", *program, "serve", "--port", "0", "--scene", SCENE, *options),
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.DEVNULL,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
    )
    assert process.stdout is not None
    reading: asyncio.Task[bytes] | None = None
    try:
        found = None
        while found is None:
            line = (await process.stdout.readline()).decode()
            if not line:
                raise SystemExit("farsteer serve has ended")
            found = re.search(r"wss?://[^\s:]+:(\d+)", line)
        reading = asyncio.create_task(process.stdout.read())
        await asyncio.sleep(2.0)  # what begins takes the processor from what is measured
        yield Served(int(found[1]), edges)
    finally:
        with contextlib.suppress(ProcessLookupError):
            process.send_signal(signal.SIGINT)
        try:
            await asyncio.wait_for(process.wait(), 15)
        except TimeoutError:
            process.kill()
            await process.wait()
        if reading is not None:
            await reading


def filled_up(cloud: Cloud, points: int) -> Cloud:
    """Return a cloud of so many points: all of another, and copies of some of them with noise."""
    random = np.random.default_rng(0)
    more = max(0, points - len(cloud.points))
    chosen = random.integers(0, len(cloud.points), more)
    noise = random.normal(scale=JITTER, size=(more, 3))
    return replace(
        cloud,
        points=np.concatenate((cloud.points, cloud.points[chosen] + noise))[:points],
        normals=np.concatenate((cloud.normals, cloud.normals[chosen]))[:points],
    )


def office_map(folder: Path, points: int) -> Path:
    """Write a map of the office with so many points; return its path."""
    path = folder / f"office-{points}.ply"
    save_cloud(filled_up(load_scene_cloud(SCENE), points), path)
    return path


def _run(file: Path, words: Sequence[str]) -> int:
    """Serve, and note when the wheels' command begins and ceases to move."""
    from teleop.__main__ import main
    from teleop.robot.real_time.control_process import ControlProcess
    from teleop.robot.tick_record import NO_PACING, DriveRecord, Pacing

    tick, moved = ControlProcess.tick, False

    def noted(self: ControlProcess, now: int, pacing: Pacing = NO_PACING) -> DriveRecord:
        nonlocal moved
        record = tick(self, now, pacing)
        twist = record.control.twist
        moving = bool(np.any(twist.linear) or np.any(twist.angular))
        if moving != moved:
            moved = moving
            out.write(f"{time.time_ns()} {int(moving)}\n")
            out.flush()
        return record

    ControlProcess.tick = noted  # type: ignore[method-assign]
    with file.open("w", encoding="utf-8") as out:
        return main(list(words))


if __name__ == "__main__":
    sys.exit(_run(Path(sys.argv[1]), sys.argv[2:]))
