"""Attacks on ``farsteer serve`` beside a driver and a second client, each after the same run without.

``python -m benchmarks attacks`` runs all attacks one by one, ``attacks pings paths`` some, and ``attacks soak`` all at
once for ten minutes; ``--seconds N`` is the length of a run. Attackers run at nice 19. Every figure but CPU is wall time.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import os
import resource
import signal
import sys
import tempfile
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final
from urllib.parse import urlsplit

import numpy as np

from benchmarks.attacks.attackers import ATTACKS, WITH_CAMERA, WITHOUT_ANONYMOUS
from benchmarks.attacks.requests import admitted, print_refusals
from benchmarks.attacks.witness import Driver, Observed, processor_time, second_client, wall

TAKES_WORDS = True

_TOKEN: Final = "a token of the benchmark's operator"
_HEADER: Final = (
    f"{'attack':12s} {'tick ms':>8s} {'clock ms':>9s} {'rt':>5s} {'stick ms':>11s} {'start ms':>13s} "
    f"{'stop ms':>8s} {'p99 ms':>7s} {'CPU %':>6s} {'lost':>4s} {'log kB':>6s} {'RSS +MB':>7s}"
)


@dataclass(frozen=True, slots=True)
class Robot:
    """A robot that ``farsteer serve`` serves."""

    url: str
    pid: int
    log: Path
    """What it writes to its standard error."""


def main(words: list[str] | None = None) -> None:
    """Run the attacks that are named and print a line for each."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks attacks")
    parser.add_argument(
        "attacks", nargs="*", help=f"some of {', '.join((*ATTACKS, 'refusals', 'soak'))}"
    )
    parser.add_argument("--seconds", type=float, help="length of a run (14, of a soak 600)")
    options = parser.parse_args(words or [])
    names = options.attacks or [*ATTACKS, "refusals"]
    for name in names:
        if name not in (*ATTACKS, "refusals", "soak"):
            parser.error(f"no attack {name}")
    asyncio.run(_run(names, options.seconds))


async def _run(names: list[str], seconds: float | None) -> None:
    print(
        f"  load {os.getloadavg()[0]:.1f}, {os.cpu_count()} cores; tick: longest gap by the robot's diagnostics;"
    )
    print(
        "  clock: longest gap on /clock at the second client; rt: robot time over wall time; start: from the"
    )
    print(
        "  stick to turning wheels, median and worst; stop: from a driver's last frame to slowing wheels, worst;"
    )
    print("  stick: from a position of the stick to its echo at the driver, p50 and p99;")
    print(
        "  p99: of the second client's calls; lost: connections of either; log: written to the terminal"
    )
    print(_HEADER, flush=True)
    attacks = [name for name in names if name in ATTACKS]
    if attacks:
        await _one("none", None, seconds or 14.0)
    if WITH_CAMERA.intersection(attacks):
        await _one("camera", None, seconds or 14.0, camera=True)
    for name in attacks:
        await _one(name, name, seconds or 14.0)
    if "soak" in names:
        await _soak(seconds or 600.0)
    if "refusals" in names:
        async with serving() as robot:
            await print_refusals(robot.url, _TOKEN, robot.log)


async def _one(label: str, attack: str | None, seconds: float, *, camera: bool = False) -> None:
    camera = camera or attack in WITH_CAMERA
    anonymous = attack not in WITHOUT_ANONYMOUS
    async with serving(camera=camera, anonymous=anonymous) as robot:
        occupied = _resident(robot.pid)
        async with attacking(robot.url, attack):
            if attack is not None:
                await asyncio.sleep(2.0)
            written = robot.log.stat().st_size
            line = await _line(label, robot, seconds)
            if not anonymous:
                line += f"  log-ins {await admitted(robot.url)};"
        log = (robot.log.stat().st_size - written) / 1e3
        print(f"{line} {log:6.1f} {_resident(robot.pid) - occupied:7.0f}", flush=True)


async def _soak(seconds: float) -> None:
    async with serving() as robot:
        print(await _line("before", robot, min(seconds, 14.0)), flush=True)
        async with attacking(robot.url, "all"):
            await asyncio.sleep(2.0)
            for number in range(1, 11):
                print(
                    await _line(f"{number * seconds / 10:.0f} s", robot, seconds / 10), flush=True
                )
                print(f"{'':12s} resident {_resident(robot.pid):.0f} MB", flush=True)
        print(await _line("after", robot, min(seconds, 14.0)), flush=True)


async def _line(label: str, robot: Robot, seconds: float) -> str:
    """Observe a robot for a while; return the figures."""
    seen, headers = Observed(), {"Authorization": f"Bearer {_TOKEN}"}
    used, begun = processor_time(robot.pid), wall()
    until = asyncio.get_running_loop().time() + seconds
    await asyncio.gather(
        Driver(robot.url, headers, seen).drive(until),
        second_client(robot.url, headers, seen, until),
    )
    used = (processor_time(robot.pid) - used) / (wall() - begun)
    tick = "-" if seen.tick_gap is None else f"{1e3 * seen.tick_gap:.0f}"
    starts = seen.starts or [np.nan]
    p50, p99 = 1e3 * np.percentile(seen.sticks or [np.nan], [50, 99])
    return (
        f"{label:12s} {tick:>8s} {1e3 * max(seen.clock_gaps, default=np.nan):9.0f} {seen.real_time:5.2f} "
        f"{p50:5.0f}/{p99:5.0f} "
        f"{1e3 * float(np.median(starts)):6.0f}/{1e3 * max(starts):6.0f} "
        f"{1e3 * max(seen.stops, default=np.nan):8.0f} "
        f"{1e3 * float(np.percentile(seen.answers or [np.nan], 99)):7.0f} {100 * used:6.0f} {seen.lost:4d}"
    )


@asynccontextmanager
async def serving(*, camera: bool = False, anonymous: bool = True) -> AsyncIterator[Robot]:
    """Serve a robot with an operator's token, beside which everybody may watch and drive if there may be anonymous clients."""
    with tempfile.TemporaryDirectory() as folder:
        tokens, log = Path(folder) / "tokens.toml", Path(folder) / "log"
        tokens.write_text(
            'anonymous = "operate"\n' * anonymous
            + f'[tokens.operator]\nrole = "operate"\ntoken = "{_TOKEN}"\n'
        )
        tokens.chmod(0o600)
        with log.open("w") as errors:
            process = await asyncio.create_subprocess_exec(
                *(sys.executable, "-m", "teleop", "serve", "--port", "0", "--tokens", str(tokens)),
                *(("--camera", "kinect") if camera else ()),
                stdout=asyncio.subprocess.PIPE,
                stderr=errors,
                env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
                preexec_fn=_few_files,
            )
            assert process.stdout is not None
            reading = None
            try:
                url = ""
                while not url.startswith("ws"):
                    line = (await process.stdout.readline()).decode()
                    if not line:
                        raise SystemExit(f"farsteer serve has ended: {log.read_text()[-500:]}")
                    url = next((word for word in line.split() if word.startswith("ws://")), "")
                reading = asyncio.create_task(process.stdout.read())
                await asyncio.sleep(1.5)
                yield Robot(url, process.pid, log)
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


def _few_files() -> None:
    """Give the server as few open files as most systems do."""
    resource.setrlimit(resource.RLIMIT_NOFILE, (1024, 1024))


@asynccontextmanager
async def attacking(url: str, attack: str | None) -> AsyncIterator[None]:
    """Attack a server meanwhile, from a process at nice 19."""
    if attack is None:
        yield
        return
    assert urlsplit(url).port
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "benchmarks.attacks.attackers", attack, url),
        stderr=asyncio.subprocess.DEVNULL,
    )
    try:
        yield
    finally:
        with contextlib.suppress(ProcessLookupError):
            process.kill()
        await process.wait()


def _resident(pid: int) -> float:
    """Return what a process and its descendants occupy [MB]."""
    total, waiting = 0.0, [pid]
    while waiting:
        one = waiting.pop()
        with contextlib.suppress(OSError):
            pages = int(Path(f"/proc/{one}/statm").read_text().split()[1])
            total += pages * resource.getpagesize() / 1e6
            children = Path(f"/proc/{one}/task/{one}/children").read_text().split()
            waiting += [int(child) for child in children]
    return total
