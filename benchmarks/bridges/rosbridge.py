"""The rosbridge server beside foxglove-sdk's and a plain one, on one machine, by the same client.

Contenders take turns; each server is a process of its own, of which the time on processors counts.
"""

from __future__ import annotations

import asyncio
import platform
from collections.abc import Awaitable, Callable
from contextlib import AsyncExitStack
from dataclasses import dataclass, field
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from typing import TypeAlias

import numpy as np

from benchmarks.bridges.client import (
    Figures,
    Peer,
    advertise,
    behind,
    crowd,
    running,
    stick,
    stream,
)
from benchmarks.bridges.large_frames import GARBAGE, LARGE
from benchmarks.bridges.servers import KINDS

ROUNDS = 3

Measure: TypeAlias = Callable[[Peer], Awaitable[tuple[list[float], Figures]]]
"""Returns times [s], and other figures."""


@dataclass
class Row:
    """One line: a goal, and what each contender makes of it."""

    name: str
    measure: Measure
    show: str
    """How the figures are written; what stands behind a bar is ours only."""

    goal: str = ""
    met: Callable[[Figures], bool] | None = None
    reference: str = ""
    """What rosbridge_suite had, measured on such a machine before."""

    foxglove: bool = False
    """Whether foxglove-sdk takes part: it has one encoding, and its own protocol."""

    by: dict[str, list[Figures]] = field(default_factory=dict)
    times: dict[str, list[float]] = field(default_factory=dict)

    async def round(self, peer: Peer) -> None:
        """Measure a contender once more."""
        if peer.kind != "foxglove" or self.foxglove:
            times, figures = await self.measure(peer)
            self.times.setdefault(peer.kind, []).extend(times)
            self.by.setdefault(peer.kind, []).append(figures)

    def figures(self, kind: str) -> Figures:
        """Return percentiles of all rounds' times [ms], and medians of the other figures."""
        rounds = self.by[kind]
        done = {name: float(np.median([f[name] for f in rounds])) for name in rounds[0]}
        p50, p95, p99 = np.percentile(np.array(self.times[kind]) * 1e3, [50, 95, 99])
        return done | {"p50": p50, "p95": p95, "p99": p99}

    def line(self) -> str:
        """Return it as a row of Markdown."""
        cells = [self.name, self.goal]
        for kind in KINDS:
            if kind not in self.by:
                cells.append("")
                continue
            figures = self.figures(kind)
            shared, _, own = self.show.partition("|")
            text = (shared + own if kind == "ours" else shared).format(**figures)
            if kind == "ours" and self.met is not None:
                text += ", **met**" if self.met(figures) else ", **missed**"
            cells.append(text)
        return f"| {' | '.join((*cells, self.reference))} |"


CLOUD = "1 MB cloud at 10 Hz"
SENT = "p95 {p95:.1f} ms, {cpu:.1f} % CPU"
SHARED = "{cpu:.1f} % CPU|: {encode:.2f} ms to encode, {send:.2f} to send"
BESIDE = (
    "p99 {p99:.1f} ms, {rate:.1f} Hz, {held:+.0f} MB|: {queue:.1f} wait, {unsent:.1f} half sent"
)
BEHIND = "{p50:.1f} ms, {used:.2f} ms CPU|, of which others wait {judged:.2f}"

ONE = Row(f"{CLOUD}, JSON, 1 client", partial(stream, topic="/cloud", coding="none"), SHARED)
EIGHT = Row(
    f"{CLOUD}, JSON, 8 clients",
    partial(stream, topic="/cloud", coding="none", clients=8),
    SHARED,
    goal="to encode <= 1.5 x that for one",
    met=lambda f: f["encode"] <= 1.5 * ONE.figures("ours")["encode"],
    reference="8 % (320 kB)",
)


def rows() -> list[Row]:
    """Return what is measured, in the order of the table."""
    return [*_streams(), ONE, EIGHT, *_stalls(), *_sticks(), *_frames()]


def _streams() -> list[Row]:
    scan = "{rate:.0f} Hz, p95 {p95:.1f} ms"
    grid = "p50 {p50:.1f} ms, p95 {p95:.1f}"
    return [
        Row(
            f"{CLOUD}, JSON",
            partial(stream, topic="/cloud", coding="none"),
            SENT,
            "p95 <= 10 ms, <= 4 % CPU",
            lambda f: f["p95"] <= 10 and f["cpu"] <= 4,
            "p95 204 ms, 5 %",
        ),
        Row(
            f"{CLOUD}, CBOR",
            partial(stream, topic="/cloud", coding="cbor"),
            SENT,
            "<= 2 % CPU",
            lambda f: f["cpu"] <= 2,
            "p50 7.0 ms, 2 %",
            foxglove=True,
        ),
        Row(
            "scan of 1080, intensities, JSON",
            partial(stream, topic="/scan", coding="none"),
            scan,
            ">= 1000 Hz",
            lambda f: f["rate"] >= 1000,
            "392 Hz",
        ),
        Row(
            "scan of 1080, intensities, CBOR",
            partial(stream, topic="/scan", coding="cbor"),
            scan,
            ">= 2000 Hz",
            lambda f: f["rate"] >= 2000,
            "783 Hz",
            foxglove=True,
        ),
        Row(
            "grid of 1000 x 1000, JSON",
            partial(stream, topic="/grid", coding="none"),
            grid,
            "p95 <= 40 ms",
            lambda f: f["p95"] <= 40,
            "144 ms",
        ),
        Row(
            "grid of 1000 x 1000, CBOR",
            partial(stream, topic="/grid", coding="cbor"),
            grid,
            reference="26 ms",
            foxglove=True,
        ),
    ]


def _stalls() -> list[Row]:
    """Return a stream alone, and beside a client that does not read."""
    table = []
    for name, coding, size in (("JSON", "none", 1.4), ("CBOR", "cbor", 1.1)):
        alone = partial(stream, topic="/cloud", coding=coding)
        binary = coding == "cbor"
        table.append(Row(f"{CLOUD}, {name}, alone", alone, BESIDE, foxglove=binary))
        table.append(
            Row(
                f"{CLOUD}, {name}, beside one that does not read",
                partial(alone, stalled=True),
                BESIDE,
                "as alone; one waits",
                lambda f, size=size: f["queue"] <= size and f["rate"] >= 9.5,  # type: ignore[misc]
                "" if binary else "a gap of 8.0 s",
                foxglove=binary,
            )
        )
    return table


def _sticks() -> list[Row]:
    times = "p50 {p50:.1f} ms, p99 {p99:.1f}"
    return [
        Row("stick and back", partial(stick, load=False), times, reference="p99 3.7 ms"),
        Row(
            "stick and back, 1 MB stream in JSON on its socket",
            partial(stick, load=True),
            times,
            "p99 <= 10 ms",
            lambda f: f["p99"] <= 10,
            "p99 146 ms",
        ),
        Row(
            "100 clients connect, call and leave",
            crowd,
            "{p50:.0f} ms",
            "< 1 s",
            lambda f: f["p50"] < 1000,
            "2.4 s",
            foxglove=True,
        ),
    ]


def _frames() -> list[Row]:
    """Return what a frame delays: the next answer to its sender, and others, while it is judged.

    The plain server only takes frames in.
    """
    table = [Row("answer behind a status", partial(behind, frame='{"op":"status"}'), BEHIND)]
    for what, frame in GARBAGE.items():
        row = Row(
            f"answer behind {what}", partial(behind, frame=frame), BEHIND, "others wait < 1 ms"
        )
        row.met = lambda f: f["judged"] < 1
        row.reference = "31.7 s" if what.startswith("2401") else ""
        table.append(row)
    for what, frame in LARGE.items():
        name = f"answer behind {what}, {len(frame) / 1e6:.1f} MB"
        table.append(Row(name, partial(behind, frame=frame), BEHIND, "is read"))
    return table


async def _measure(kinds: list[str]) -> None:
    async with AsyncExitStack() as stack:
        peers = [await stack.enter_async_context(running(kind)) for kind in kinds]
        keep = await advertise(next(peer for peer in peers if peer.kind == "ours"))
        for row in rows():
            for turn in range(ROUNDS):
                # Each round begins with another, so that no place in the row is anybody's.
                for peer in peers[turn % len(peers) :] + peers[: turn % len(peers)]:
                    await row.round(peer)
            print(row.line(), flush=True)
        await keep.close()


def main() -> None:
    """Measure, and print the table in Markdown, each row when it is there."""
    kinds = list(KINDS)
    try:
        sdk = version("foxglove-sdk")
    except PackageNotFoundError:
        kinds.remove("foxglove")
        sdk = "is not installed: pip install foxglove-sdk"
    print(f"{platform.system()} loopback; websockets {version('websockets')}, foxglove-sdk {sdk};")
    print("rosbridge_suite 0.11.17 was measured before, on such a machine, and is not run here.\n")
    heads = ("", "goal", "farsteer", "foxglove-sdk", "websockets, encoded beforehand")
    print(f"| {' | '.join((*heads, 'rosbridge_suite'))} |\n{'|---' * 6}|")
    asyncio.run(_measure(kinds))
