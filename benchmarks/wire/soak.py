"""Clients come, do everything, and go or vanish, again and again: what stays of them in the server.

``python -m benchmarks soak`` takes ten minutes, ``python -m benchmarks soak short`` one.
"""

from __future__ import annotations

import asyncio
import contextlib
import ctypes
import gc
import time
from pathlib import Path

from benchmarks.wire.crowd import come_and_go, crowded_server, open_files, publish
from teleop.rosbridge import Connection, Observer

PARTS = ("short",)

_WARM_UP = 0.1
"""Share of the time after which growth counts."""


def main(parts: list[str] | None = None) -> None:
    """Print what the process holds, ten times on the way, and its growth."""
    asyncio.run(_soak(60.0 if parts else 600.0))


class Served(Observer):
    """Counts connections."""

    clients = 0

    def connected(self, connection: Connection, now: int) -> None:
        self.clients += 1


async def _soak(seconds: float) -> None:
    print("     time   rounds   clients   RSS MB   tasks   files")
    async with crowded_server() as server:
        served = Served()
        server.protocol.observers.add(served)
        publisher = asyncio.create_task(publish(server))
        begun, rounds, told = time.monotonic(), 0, 0
        first = last = 0.0
        while (passed := time.monotonic() - begun) < seconds:
            await come_and_go(server, rounds)
            rounds += 1
            if passed >= told * seconds / 10:
                told += 1
                await asyncio.sleep(1.2)  # a topic's time of grace
                gc.collect()
                last = _resident()
                if passed >= _WARM_UP * seconds and not first:
                    first = last
                figures = f"{last:8.1f} {len(asyncio.all_tasks()):7d} {open_files():7d}"
                print(f"{passed:8.0f} s {rounds:8d} {served.clients:9d} {figures}", flush=True)
        publisher.cancel()
        print(f"growth of RSS since {_WARM_UP:.0%} of the time: {last / first - 1:+.1%}")


def _resident() -> float:
    """Return what the process occupies [MB], without what the C library keeps for the next clouds."""
    with contextlib.suppress(OSError, AttributeError):  # another C library has no such function
        ctypes.CDLL("libc.so.6").malloc_trim(0)
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) / 1000
    raise OSError("no VmRSS in /proc/self/status")
