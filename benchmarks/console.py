"""The console page in Debian's Chromium: opening, frames, clouds, stick, memory, bandwidth, and losing it.

Parts by name: opening frames cloud stick memory bandwidth clients losing hint. ``--minutes N`` is how long is driven
for ``memory`` (5; the goal is of 30), ``--trials N`` how often it is lost for ``losing`` (200). All is on loopback and
in real time, so other work on the machine shows. Without a graphics card Chromium draws on the processor, in a process of
its own that takes time from the robot and from the page.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path

from benchmarks._console_cloud import cloud
from benchmarks._console_frames import frames
from benchmarks._console_hint import hint
from benchmarks._console_losing import losing
from benchmarks._console_opening import opening
from benchmarks._console_stick import clients, stick
from benchmarks._console_traffic import bandwidth, memory
from benchmarks._figures import Figure, measure

TAKES_WORDS = True

PARTS: dict[str, Callable[..., Iterator[Figure]]] = {
    "opening": opening,
    "frames": frames,
    "cloud": cloud,
    "stick": stick,
    "memory": memory,
    "bandwidth": bandwidth,
    "clients": clients,
    "losing": losing,
    "hint": hint,
}


def main(words: Sequence[str] = (), *, out: Path | None = None) -> None:
    """Measure some parts, or all, and print their figures.

    Args:
        words: names of parts, and options.
        out: a sheet of figures; parts that are measured take their places in it, the others stay.
    """
    parser = argparse.ArgumentParser(prog="python -m benchmarks console")
    parser.add_argument("parts", nargs="*", help=f"some of {', '.join(PARTS)}")
    parser.add_argument("--minutes", type=int, default=5, help="of driving, for memory")
    parser.add_argument("--trials", type=int, default=200, help="of losing it")
    options = parser.parse_args(list(words))
    for name in options.parts:
        if name not in PARTS:
            parser.error(f"no part {name}; there are {', '.join(PARTS)}")
    if options.minutes < 2 or options.trials < 1:
        parser.error("--minutes wants 2 or more, --trials 1 or more")
    parts: dict[str, Callable[[], Iterator[Figure]]] = {
        **PARTS,
        "memory": partial(memory, minutes=options.minutes),
        "losing": partial(losing, trials=options.trials),
    }
    measure({name: parts[name] for name in options.parts or PARTS}, out)
